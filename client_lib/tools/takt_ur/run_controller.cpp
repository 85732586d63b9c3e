#include "client_lib/tools/takt_ur/gateway_options.h"
#include "client_lib/tools/takt_ur/servers.h"

namespace takt::ur {
namespace {

/// How many cycles of wall time are made up for after a delay. More would be a jump of the set-points, so that they are
/// left out: paths take longer, and servoj follows its driver at the joints' speeds.
constexpr std::uint64_t kMostCatchUp = 2;

}  // namespace

int run_controller(const GatewayRun& options) {
  Client client(options.client);
  const auto cell = client.cell();
  UrMapping mapping = options.mapping_file.empty() ? default_ur_mapping(*cell, options.robot)
                                                   : read_ur_mapping(options.mapping_file, *cell);
  if (!options.address.empty()) mapping.address = options.address;
  if (options.start) {
    gateway::set_realtime(client);
    client.play();
  }
  const bool wall = mapping.time == gateway::TimeReference::wall;
  const std::string name = "takt-ur " + mapping.robot.robot;
  gateway::CellLink link(client,
                         {.name = name,
                          .protocol = "RTDE",
                          .period_s = UrController::kCycle_s,
                          .needs_wall_time = wall,
                          .robot = mapping.robot.robot,
                          .filter_rad_per_s = mapping.filter_rad_per_s},
                         gateway::targets_of(mapping.robot.robot, mapping.outputs));
  gateway::EventLoop loop;
  UrController controller(loop, link, mapping);
  Servers servers(loop, controller, mapping);
  loop.stop_on_signals();

  const auto begin = gateway::Clock::now();
  const double simulated_begin_s = link.state()->time;
  std::uint32_t epoch = link.state()->epoch;
  double simulated_before_s = 0.0;  // of earlier epochs
  std::uint64_t offset = 0;         // cycles that were left out
  loop.every(std::chrono::milliseconds(1), [&] {
    double time_s = std::chrono::duration<double>(gateway::Clock::now() - begin).count();
    if (!wall) {
      const auto state = link.state();
      if (state->epoch != epoch) {
        epoch = state->epoch;
        simulated_before_s = UrController::kCycle_s * static_cast<double>(controller.cycle() + offset);
      }
      time_s = simulated_before_s > 0.0 ? simulated_before_s + state->time : state->time - simulated_begin_s;
    }
    const auto due = static_cast<std::uint64_t>(std::max(0.0, time_s + 1e-9) / UrController::kCycle_s);
    std::uint64_t late = due > controller.cycle() + offset ? due - controller.cycle() - offset : 0;
    if (wall && late > kMostCatchUp) {
      offset += late - 1;
      late = 1;
    }
    link.show(servers.peer(offset));
    // A client gets the newest package of cycles that are made up for, as from a controller short of time.
    for (; late > 0; --late) {
      controller.advance();
      servers.publish();
    }
  });
  loop.every(std::chrono::seconds(1), [&] {
    if (client.cell() != link.cell())
      throw ClientError(ClientError::Kind::lost, "The cell has another scenario; start takt-ur again.");
    if (!client.connected()) throw ClientError(ClientError::Kind::lost, "The cell has gone away.");
    link.supervise();
  });
  gateway::report(name, "RTDE at " + mapping.address + ":" + std::to_string(mapping.rtde_port) +
                            ", primary " + std::to_string(mapping.primary_port) + ", dashboard " +
                            std::to_string(mapping.dashboard_port) + "; a " + mapping.model + ", software " +
                            mapping.version + ".");
  loop.run();
  gateway::report(name, link.figures());
  if (servers.left_out() > 0)
    gateway::report(name, std::to_string(servers.left_out()) +
                              " data packages were left out for clients that do not read.");
  return 0;
}

}  // namespace takt::ur
