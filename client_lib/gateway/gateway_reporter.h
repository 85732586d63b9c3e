#pragma once
// Reports a gateway to its cell, for the status of the cell: each second, and when its other side comes or goes. A thread of its
// own does it, so that the protocol's thread never waits for DDS.
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "client_lib/client.h"

namespace takt::gateway {

/// What a protocol knows of its other side.
struct PeerStatus {
  std::string peer{};          ///< its address; empty: none has come so far
  bool connected = false;      ///< it is there, and its messages come in time
  std::uint64_t messages = 0;  ///< applied or answered
  std::uint64_t late = 0;      ///< cycles without a message in time
};

/// Waits of this thread call `poll` while it is set; those of a GatewayReporter's thread do not. `poll` outlives the client.
inline ClientOptions polled_by_this_thread(ClientOptions options, const std::function<void()>& poll) {
  options.while_waiting = [&poll, own = std::this_thread::get_id()] {
    if (poll && std::this_thread::get_id() == own) poll();
  };
  return options;
}

class GatewayReporter {
 public:
  /// `client` outlives this.
  GatewayReporter(Client& client, std::string name, std::string protocol, std::vector<std::string> targets);
  ~GatewayReporter();
  GatewayReporter(const GatewayReporter&) = delete;
  GatewayReporter& operator=(const GatewayReporter&) = delete;

  /// At any rate; does not wait.
  void set(PeerStatus peer);

 private:
  void run();

  Client& client_;
  requests::ReportGateway report_;  ///< of the thread alone, but for the beginning
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<PeerStatus> peer_;  // guarded by mutex_, as all below
  bool news_ = false, over_ = false;
  std::thread thread_;
};

}  // namespace takt::gateway
