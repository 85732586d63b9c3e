// libFuzzer over the coders of RSI and EGM (target takt-fuzz-gateway, preset fuzz). The first byte chooses the reader.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "client_lib/gateway/egm/controller.h"
#include "client_lib/gateway/egm/follower.h"
#include "client_lib/gateway/rsi/krc.h"
#include "client_lib/gateway/rsi/sensor_pc.h"
#include "tests/support/rsi_examples.h"

namespace {

using namespace takt::gateway;

void require(bool holds) {
  if (!holds) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  switch (data[0] % 5) {
    case 0: {
      rsi::Krc krc(takt::test::rsi_configuration(), {.relative = true, .first_ipoc = 4208163634});
      krc.start({});
      for (int i = 0; i < 3; ++i) {
        krc.begin_cycle({});
        krc.answer(bytes);
        krc.end_cycle();
      }
      for (const double axis : krc.target()) require(std::isfinite(axis));
      break;
    }
    case 1: {
      rsi::SensorPc pc(takt::test::rsi_configuration(), {});
      const rsi::Reception packet = pc.receive(bytes, 1.0);
      if (packet.state) {
        for (const double axis : packet.state->actual_axes) require(std::isfinite(axis));
      }
      break;
    }
    case 2:
      try {
        (void)rsi::parse_configuration(std::string(bytes), "rsi.xml");
      } catch (const rsi::ConfigurationError&) {
      }
      break;
    case 3: {
      egm::Controller controller({}, 6);
      controller.start({0, 0, 0, 0, 0, 0});
      controller.receive(bytes);
      for (int i = 0; i < 3; ++i) controller.step(0.004, controller.planned());
      for (const double joint : controller.planned()) require(std::isfinite(joint));
      break;
    }
    default: {
      egm::Follower follower({});
      const egm::Reception message = follower.receive(bytes, 1.0);
      if (message.state) {
        for (const double joint : egm::Follower::joints_of(*message.state, false))
          require(std::isfinite(joint));
      }
    }
  }
  return 0;
}
