// libFuzzer over the coders of RSI, EGM and Modbus (target takt-fuzz-gateway, preset fuzz). The first byte chooses the reader.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "client_lib/gateway/egm/controller.h"
#include "client_lib/gateway/egm/follower.h"
#include "client_lib/gateway/modbus/poller.h"
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
  switch (data[0] % 7) {
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
    case 4: {
      // A server: each message has a reply that its client understands.
      modbus::Table table(
          {{modbus::Area::coils, 3}, {modbus::Area::holding_registers, 1, modbus::NumberType::float32}});
      modbus::FrameStream stream;
      for (const std::string_view part :
           {bytes.substr(0, bytes.size() / 2), bytes.substr(bytes.size() / 2)}) {
        stream.add(part);
        while (const auto frame = stream.next()) {
          const std::string reply = modbus::reply_to(frame->pdu, table);
          require(reply.size() >= 2 && reply.size() <= modbus::kMostPdu_bytes);
          if (frame->pdu.size() >= 5) require(modbus::parse_reply(frame->pdu, reply).fault.empty());
        }
      }
      require(std::isfinite(table.number(1)));
      break;
    }
    case 5: {
      modbus::Poller poller({{modbus::Area::input_registers, 0, modbus::NumberType::float32},
                             {modbus::Area::discrete_inputs, 0},
                             {modbus::Area::coils, 0}},
                            {true, true, false}, {});
      (void)poller.begin({0, 0, 1});
      (void)poller.receive(bytes);
      require(std::isfinite(poller.number(0)));
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
