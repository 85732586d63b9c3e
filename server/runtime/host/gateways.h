#pragma once
// Gateways of a cell, as they report themselves (report_gateway): for the status, and for events about their other sides.
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "server/runtime/requests/outbound_queue.h"
#include "takt_request_table.h"

namespace takt {

/// Any thread. Times are of the monotonic clock.
class Gateways {
 public:
  static constexpr std::int64_t kSilence_ns = 3'000'000'000;
  static constexpr std::size_t kMost = 16;  ///< that a status has

  /// `events` outlive this.
  explicit Gateways(EventQueue& events) : events_(events) {}

  /// False if there are too many.
  bool report(const requests::ReportGateway& status, std::int64_t now_ns);
  /// In the order of their names. Forgets those that have been silent.
  std::vector<requests::ReportGateway> present(std::int64_t now_ns);

 private:
  struct Known {
    requests::ReportGateway status;
    std::int64_t heard_ns = 0;
  };
  EventQueue& events_;
  std::mutex mutex_;
  std::map<std::string, Known> known_;  // guarded by mutex_
};

}  // namespace takt
