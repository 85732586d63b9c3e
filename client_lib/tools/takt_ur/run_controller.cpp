#include <algorithm>
#include <chrono>

#include "client_lib/gateway/cell_link.h"
#include "client_lib/lockstep_controller.h"
#include "client_lib/tools/takt_ur/gateway_options.h"
#include "client_lib/tools/takt_ur/servers.h"
#include "idl/common/text.h"
#include "takt_event_table.h"

namespace takt::ur {
namespace {

/// How many cycles of wall time are made up for after a delay. More would be a jump of the set-points, so that they are
/// left out: paths take longer, and servoj follows its driver at the joints' speeds.
constexpr std::uint64_t kMostCatchUp = 2;
/// How often a wait for the driver is reported.
constexpr std::chrono::seconds kWaitingReported{5};
constexpr double kRounding_s = 1e-9;

UrMapping mapping_of(const GatewayRun& options, const CellInfo& cell) {
  UrMapping mapping = options.mapping_file.empty() ? default_ur_mapping(cell, options.robot)
                                                   : read_ur_mapping(options.mapping_file, cell);
  if (!options.address.empty()) mapping.address = options.address;
  return mapping;
}

/// What the gateway commands. A gripper that no mapping file names is left to others, too.
std::vector<std::string> targets_of(const GatewayRun& options, const UrMapping& mapping) {
  auto targets = gateway::targets_of(mapping.robot.robot, mapping.outputs);
  if (!options.mapping_file.empty() && !mapping.robotiq.empty() &&
      std::find(targets.begin(), targets.end(), mapping.robotiq) == targets.end())
    targets.push_back(mapping.robotiq);
  return targets;
}

void report_ports(const std::string& name, const UrMapping& mapping) {
  gateway::report(name, "RTDE at " + mapping.address + ":" + std::to_string(mapping.rtde_port) +
                            ", primary " + std::to_string(mapping.primary_port) + ", dashboard " +
                            std::to_string(mapping.dashboard_port) + "; a " + mapping.model + ", software " +
                            mapping.version + ".");
}

/// As the controller of a real robot, which stops where torques would leave the limits.
void stop_at_limits(const Client& client, UrController& controller) {
  constexpr std::string_view ended = EventTable<events::TorquesEnded>::info.code;
  while (const auto event = client.wait_for(topics::event, Seconds{0.0}))
    if (event->code == ended && event->subject == controller.mapping().robot.robot)
      controller.protective_stop("torques would take a joint out of its limits");
}

/// The cell at the boundaries of a LockstepController.
class LockstepCell final : public gateway::RobotCell, gateway::CommandSink {
 public:
  LockstepCell(Client& client, const LockstepOptions& options) : controller_(client, options) { renew(); }

  /// Answers this boundary, and returns at the next one.
  void advance() {
    controller_.advance();
    renew();
  }

  std::shared_ptr<const CellInfo> cell() const override { return state_->cell; }
  std::shared_ptr<const State> state() const override { return state_; }
  /// A cell that stands does not come to the next boundary.
  bool plays() const override { return true; }
  CommandSink& sender() override { return *this; }

 private:
  void renew() { state_ = std::make_shared<const State>(controller_.state()); }
  void move(const std::string& robot, std::vector<double> positions,
            std::vector<double> velocities) override {
    controller_.move(robot, positions, velocities);
  }
  void apply_torques(const std::string& robot, std::vector<double> torques) override {
    controller_.apply_torques(robot, torques);
  }
  void stop(const std::string& /*robot*/) override {}  // it stays at the set-point that it has
  void grip(const std::string& gripper, GripperAction action, double width_m, double max_force_N) override {
    controller_.grip(gripper, action, width_m, max_force_N);
  }
  void set_signals(const std::string& device, const std::map<std::string, double>& signals) override {
    controller_.set_signals(device, signals);
  }

  LockstepController controller_;
  std::shared_ptr<const State> state_;
};

}  // namespace

int run_controller(const GatewayRun& options) {
  Client client(options.client);
  const auto cell = client.cell();
  const UrMapping mapping = mapping_of(options, *cell);
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
                         targets_of(options, mapping));
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
    stop_at_limits(client, controller);
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
  report_ports(name, mapping);
  loop.run();
  gateway::report(name, link.figures());
  if (servers.left_out() > 0)
    gateway::report(name, std::to_string(servers.left_out()) +
                              " data packages were left out for clients that do not read.");
  return 0;
}

int run_lockstep(const GatewayRun& options) {
  gateway::EventLoop loop;
  loop.stop_on_signals();
  // Sockets are served while the cell computes.
  const std::function<void()> serve = [&loop] {
    loop.poll();
    if (loop.stopped()) throw ClientError(ClientError::Kind::timeout, "Ended by a signal.");
  };
  Client client(gateway::polled_by_this_thread(options.client, serve));
  UrMapping mapping = mapping_of(options, *client.cell());
  if (options.mapping_file.empty()) mapping.robotiq.clear();  // the cell would wait for its commands
  const std::string name = "takt-ur " + mapping.robot.robot;
  LockstepOptions lockstep;
  lockstep.targets = targets_of(options, mapping);
  lockstep.period_s = std::max(UrController::kCycle_s, client.cell()->step_size);
  lockstep.name = name;
  lockstep.timeout = Seconds{86400.0};  // the longest that a server accepts
  lockstep.start = options.start;
  if (!options.start) client.set_pace(Pace::lockstep);
  LockstepCell cell(client, lockstep);
  gateway::GatewayReporter reporter(client, name, "RTDE", lockstep.targets);
  UrController controller(loop, cell, mapping);
  Servers servers(loop, controller, mapping);
  report_ports(name, mapping);
  const double begin_s = cell.state()->time;
  const auto wait_for_driver = [&] {
    while (controller.awaits_driver() && !loop.stopped()) {
      if (!loop.run_until([&] { return !controller.awaits_driver(); },
                          gateway::Clock::now() + kWaitingReported) &&
          !loop.stopped())
        gateway::report(name, "Waits for the driver's answer to a data package; the cell stands still.");
    }
    loop.poll();  // what the driver has sent ahead of it, on other sockets
  };
  try {
    while (!loop.stopped()) {
      reporter.set(servers.peer(0));
      const double time_s = cell.state()->time - begin_s;
      stop_at_limits(client, controller);
      while (UrController::kCycle_s * static_cast<double>(controller.cycle() + 1) <= time_s + kRounding_s) {
        controller.advance();
        if (servers.publish()) wait_for_driver();
        loop.poll();
      }
      cell.advance();
    }
  } catch (const ClientError&) {
    if (!loop.stopped()) throw;
  }
  const State& end = *cell.state();
  gateway::report(name, "Ends at " + number_text(end.time) + " s of simulated time, state hash " +
                            hexadecimal_text(end.state_hash) + ".");
  return 0;
}

}  // namespace takt::ur
