#pragma once
// Remote procedures that the threads of a URScript program call (client_lib/gateway/urscript/xml_rpc.h): the call waits, the other
// threads and the robot go on.
#include <map>

#include "client_lib/gateway/urscript/xml_rpc.h"
#include "client_lib/tools/takt_ur/call_arguments.h"
#include "client_lib/tools/takt_ur/ur_controller.h"

namespace takt::ur {

class RemoteCalls {
 public:
  static constexpr double kMost_s = 60.0;

  explicit RemoteCalls(UrController& controller) : controller_(controller) {}
  ~RemoteCalls();
  RemoteCalls(const RemoteCalls&) = delete;
  RemoteCalls& operator=(const RemoteCalls&) = delete;

  /// `arguments`: of urscript::kRemoteCall. Nothing while the call waits. `begun_cycle`: when it began. Throws
  /// urscript::ValueError for a fault, a server that cannot be reached, and after kMost_s.
  std::optional<urscript::Value> call(std::uint64_t thread, std::span<const urscript::Value> arguments,
                                      bool begins, std::uint64_t begun_cycle);
  /// The thread has ended in its call.
  void forget(std::uint64_t thread);

 private:
  struct Call {
    std::shared_ptr<gateway::Connection> connection{};
    rpc::ReplyStream reply{};
    bool connecting = true;
  };
  void begin(std::uint64_t thread, const rpc::Address& address, std::string request);

  UrController& controller_;
  std::map<std::uint64_t, std::shared_ptr<Call>> calls_;  ///< by thread
};

}  // namespace takt::ur
