// A complete client: publishes a scripted motion for one robot and reads back where it went.
//   scripted_publisher [--lockstep] [ROBOT [JOINT]]     e.g. scripted_publisher Robot1 5
// Start the cell first: takt-server config/scenarios/block_assembly.yaml
// With --lockstep the cell waits for each command: the same bits on any machine.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <takt/client.h>
#include <takt/lockstep_controller.h>

namespace {

/// One joint swings by 0.2 rad and back within 4 s of simulated time.
struct Swing {
  static constexpr double kAmplitude_rad = 0.2, kDuration_s = 4.0, kW = 2.0 * M_PI / kDuration_s;
  std::vector<double> start;
  std::size_t joint;

  std::vector<double> position(double t_s) const {
    auto q = start;
    q.at(joint) += 0.5 * kAmplitude_rad * (1.0 - std::cos(kW * t_s));
    return q;
  }
  std::vector<double> velocity(double t_s) const {
    std::vector<double> v(start.size(), 0.0);
    v.at(joint) = 0.5 * kAmplitude_rad * kW * std::sin(kW * t_s);
    return v;
  }
};

/// The state is the clock: each command is sent when the cell has come to its time, says where the joint is
/// to be one period later, and with which velocity.
bool publish(takt::Client& cell, const std::string& robot, const Swing& swing, double period_s) {
  const double begin_s = cell.state().time;
  cell.play();
  for (int k = 0; k * period_s < Swing::kDuration_s + 2.0 * period_s; ++k) {
    const double t_s = k * period_s;
    const auto due = [&](const auto& s) { return s.time >= begin_s + t_s - 1e-9; };
    if (!cell.wait_for(takt::topics::state, due, std::chrono::seconds(10))) return false;
    const double next_s = std::min(t_s + period_s, Swing::kDuration_s);
    cell.send_joint_command(robot, swing.position(next_s), swing.velocity(next_s));
  }
  return true;
}

/// The cell waits for each command.
void publish_in_lockstep(takt::Client& cell, const std::string& robot, const Swing& swing, double period_s) {
  takt::LockstepController controller(cell, {.targets = {robot}, .period_s = period_s});
  for (int k = 1; k * period_s < Swing::kDuration_s + 2.0 * period_s; ++k) {
    const double t_s = std::min(k * period_s, Swing::kDuration_s);
    controller.move(robot, swing.position(t_s), swing.velocity(t_s));
    controller.advance();
  }
}

}  // namespace

int main(int argc, char** argv) try {
  std::vector<std::string> arguments(argv + 1, argv + argc);
  const bool lockstep = !arguments.empty() && arguments.front() == "--lockstep";
  if (lockstep) arguments.erase(arguments.begin());

  takt::Client cell;  // the cell named by TAKT_CELL (default "cell") on domain TAKT_DOMAIN (default 0)
  const auto info = cell.cell();
  const std::string robot = !arguments.empty() ? arguments[0] : info->robots.at(0).name;
  Swing swing{cell.state().robot(robot).position, 0};
  swing.joint =
      arguments.size() > 1 ? std::strtoul(arguments[1].c_str(), nullptr, 10) : swing.start.size() - 1;
  const double period_s = info->robots.at(static_cast<std::size_t>(info->find_robot(robot))).command_period;

  if (lockstep) {
    publish_in_lockstep(cell, robot, swing, period_s);
  } else if (!publish(cell, robot, swing, period_s)) {
    std::fprintf(stderr, "The simulation stands still at %.3f s.\n", cell.state().time);
    return 1;
  }
  const auto end = cell.state();
  std::printf("%s joint %zu: %.4f rad before, %.4f rad after, at %.3f s, hash 0x%016llx\n", robot.c_str(),
              swing.joint, swing.start.at(swing.joint), end.robot(robot).position.at(swing.joint), end.time,
              static_cast<unsigned long long>(end.state_hash));
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
