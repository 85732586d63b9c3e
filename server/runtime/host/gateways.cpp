#include "server/runtime/host/gateways.h"

namespace takt {

bool Gateways::report(const requests::ReportGateway& status, std::int64_t now_ns) {
  bool was_connected = false;
  {
    const std::lock_guard lock(mutex_);
    const auto found = known_.find(status.name);
    if (found == known_.end() && known_.size() >= kMost) return false;
    was_connected = found != known_.end() && found->second.status.connected;
    known_.insert_or_assign(status.name, Known{status, now_ns});
  }
  if (status.connected && !was_connected)
    events_.post(events::GatewayConnected{status.name, status.peer, status.protocol});
  if (!status.connected && was_connected)
    events_.post(events::GatewayDisconnected{status.name, status.peer, status.protocol});
  return true;
}

std::vector<requests::ReportGateway> Gateways::present(std::int64_t now_ns) {
  std::vector<requests::ReportGateway> statuses;
  std::vector<std::string> ended;
  {
    const std::lock_guard lock(mutex_);
    for (auto known = known_.begin(); known != known_.end();) {
      if (now_ns - known->second.heard_ns > kSilence_ns) {
        ended.push_back(known->first);
        known = known_.erase(known);
      } else {
        statuses.push_back((known++)->second.status);
      }
    }
  }
  for (const std::string& name : ended) events_.post(events::GatewayEnded{name});
  return statuses;
}

}  // namespace takt
