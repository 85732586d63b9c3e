#pragma once
// The listening sockets of takt-ur: RTDE, primary, secondary and real-time interface, dashboard.
#include <memory>

#include "client_lib/gateway/gateway_reporter.h"
#include "client_lib/tools/takt_ur/ur_controller.h"

namespace takt::ur {

class Servers {
 public:
  /// Listens at the addresses of the mapping. Throws gateway::SocketError. All outlive it.
  Servers(gateway::EventLoop& loop, UrController& controller, const UrMapping& mapping);
  ~Servers();
  Servers(const Servers&) = delete;
  Servers& operator=(const Servers&) = delete;

  /// After each cycle of the controller: data packages and primary states that are due. True where a client gets a data package.
  bool publish();
  std::size_t rtde_clients() const { return rtde_.size(); }
  /// The first RTDE client. `missed`: cycles that were left out.
  gateway::PeerStatus peer(std::uint64_t missed) const;
  /// Data packages that were not sent because their client does not read.
  std::uint64_t left_out() const { return left_out_; }

 private:
  struct Rtde;
  /// A client that sends programs and reads the robot's state.
  struct ScriptClient;
  using ScriptClients = std::vector<std::shared_ptr<ScriptClient>>;
  void accept_rtde(std::shared_ptr<gateway::Connection> connection);
  /// An interface for programs, and its read-only one where it has its standard port.
  void listen(gateway::EventLoop& loop, const std::string& address, int port, int standard_port,
              ScriptClients& clients);
  /// `clients`: the list that the client joins. Bytes of a read-only client are ignored.
  void accept_scripts(std::shared_ptr<gateway::Connection> connection, ScriptClients& clients,
                      bool read_only);
  /// Bytes for a client whose lines are answered one by one.
  struct Reply {
    std::string bytes;
    bool quit = false;  ///< the connection is closed
  };
  using Answer = std::function<Reply(std::string_view line, const std::string& peer_address)>;
  void accept_lines(std::shared_ptr<gateway::Connection> connection, Answer answer);

  UrController& controller_;
  rtde::InputOwners owners_;
  rtde::DashboardState dashboard_;
  std::uint64_t connections_ = 0, sent_ = 0, left_out_ = 0;
  std::vector<std::shared_ptr<Rtde>> rtde_;
  ScriptClients primary_, secondary_, realtime_;
  std::vector<std::shared_ptr<gateway::Connection>> line_clients_;  ///< of the dashboard and the interpreter
};

}  // namespace takt::ur
