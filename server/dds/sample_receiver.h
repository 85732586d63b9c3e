#pragma once
// The step loop receives the packets with commands itself while it waits in lockstep.
#include "idl/transport/fastdds/udp_receiver.h"
#include "server/runtime/loop/loop_wakeup.h"

namespace takt {

class SampleReceiver final : public InputReceiver {
 public:
  explicit SampleReceiver(UdpReceiver& receiver) : receiver_(receiver) {}

  bool receive_until_ns(std::int64_t deadline_ns, const std::function<bool()>& ready) override {
    // std::chrono::steady_clock is CLOCK_MONOTONIC.
    const std::chrono::nanoseconds since_boot(deadline_ns);
    return receiver_.lead(UdpReceiver::Clock::time_point(since_boot), ready);
  }
  void interrupt() override { receiver_.interrupt(); }

 private:
  UdpReceiver& receiver_;
};

}  // namespace takt
