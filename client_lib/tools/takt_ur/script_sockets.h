#pragma once
// Sockets that a URScript program opens, by their names.
#include <map>

#include "client_lib/tools/takt_ur/call_arguments.h"
#include "client_lib/tools/takt_ur/ur_controller.h"

namespace takt::ur {

class ScriptSockets {
 public:
  explicit ScriptSockets(UrController& controller) : controller_(controller) {}
  ~ScriptSockets();
  ScriptSockets(const ScriptSockets&) = delete;
  ScriptSockets& operator=(const ScriptSockets&) = delete;

  /// A function socket_..; nothing while it waits. `begun_cycle`: when the call began. As on the real controller, what is
  /// sent without a connection is lost, and the program goes on.
  std::optional<urscript::Value> call(const CallArguments& arguments, bool begins, std::uint64_t begun_cycle);

 private:
  struct Socket {
    std::shared_ptr<gateway::Connection> connection{};
    std::string received{};
    bool connecting = false;
  };

  urscript::Value open(const CallArguments& arguments);
  /// False where the socket is not open.
  bool send(const CallArguments& arguments, const std::string& name, const std::string& text);
  bool is_full(const std::string& name) const;
  static std::string name_of(const CallArguments& arguments, std::size_t position);

  UrController& controller_;
  std::map<std::string, std::shared_ptr<Socket>> sockets_;
};

}  // namespace takt::ur
