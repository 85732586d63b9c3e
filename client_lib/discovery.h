#pragma once
// Which cells are announced on a domain: every server writes rt/<cell>/status.
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "client_lib/dds_link.h"

namespace takt::client {

/// Listener of a participant that collects the names of announced cells and of other participants.
class CellWatch : public DiscoveryListener {
 public:
  /// `on_new` runs in a thread of DDS after each new announcement.
  explicit CellWatch(std::function<void()> on_new = {}) : on_new_(std::move(on_new)) {}
  void on_writer(const DiscoveredWriter& writer) override;
  void on_participant(const DdsGuid& guid, const std::string& name) override;
  std::vector<std::string> names() const;
  /// By name, how many servers there are of it.
  std::map<std::string, int> servers() const;
  /// Names of the other participants that have one. DomainParticipant::get_participant_names()
  /// of 2.9.1 reads them without the lock of the threads that write them.
  std::vector<std::string> participants() const;

 private:
  std::function<void()> on_new_;
  mutable std::mutex mutex_;
  std::map<DdsGuid, std::string> cells_, participants_;
};

}  // namespace takt::client
