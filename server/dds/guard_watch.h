#pragma once
// Reports packets that the guard has dropped, at most once a second.
#include <cstdint>

#include "idl/transport/rtps_guard/guard_transport.h"
#include "server/runtime/requests/event_queue.h"

namespace takt {

class GuardWatch {
 public:
  /// Call it often. `guard` may be null.
  void look(const PacketGuard* guard, std::int64_t now_ns, EventQueue& events) {
    constexpr std::int64_t interval_ns = 1'000'000'000;
    if (guard == nullptr || (reported_ > 0 && now_ns - reported_ns_ < interval_ns)) return;
    const std::uint64_t dropped = guard->dropped();
    if (dropped == reported_) return;
    events.post(events::PacketsDropped{dropped - reported_, guard->summary()});
    reported_ = dropped;
    reported_ns_ = now_ns;
  }

 private:
  std::uint64_t reported_ = 0;
  std::int64_t reported_ns_ = 0;
};

}  // namespace takt
