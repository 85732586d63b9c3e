// A complete client: publishes a scripted motion for one robot and reads back where it went.
//   scripted_publisher [ROBOT [JOINT]]     e.g. scripted_publisher Robot1 5
// Start the cell first: takt-server config/scenarios/block_assembly.yaml
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "client_lib/client.h"

int main(int argc, char** argv) try {
  takt::Client cell;  // the cell named by TAKT_CELL (default "cell") on domain TAKT_DOMAIN (default 0)
  const auto info = cell.cell();
  const std::string robot = argc > 1 ? argv[1] : info->robots.at(0).name;
  const auto state_before = cell.state();
  const std::vector<double> start = state_before.robot(robot).position;
  const std::size_t joint = argc > 2 ? std::strtoul(argv[2], nullptr, 10) : start.size() - 1;
  const double period_s = info->robots.at(static_cast<std::size_t>(info->find_robot(robot))).command_period_s;

  cell.play();

  // Swing one joint by 0.2 rad and back within 4 s of simulated time. The state is the clock: each command is
  // sent when the cell has come to its time, says where the joint is to be one period later, and with which
  // velocity.
  const double amplitude_rad = 0.2, duration_s = 4.0, w = 2.0 * M_PI / duration_s;
  std::vector<double> position = start, velocity(start.size(), 0.0);
  for (int k = 0; k * period_s < duration_s; ++k) {
    const double t_s = k * period_s;
    const auto due = [&](const auto& s) { return s.time_s >= state_before.time_s + t_s - 1e-9; };
    if (!cell.wait_for_state(due, std::chrono::seconds(10))) {
      std::fprintf(stderr, "The simulation stands still at %.3f s.\n", cell.state().time_s);
      return 1;
    }
    position.at(joint) = start.at(joint) + 0.5 * amplitude_rad * (1.0 - std::cos(w * (t_s + period_s)));
    velocity.at(joint) = 0.5 * amplitude_rad * w * std::sin(w * (t_s + period_s));
    cell.send_joint_command(robot, position, velocity);
  }

  const double end_s = state_before.time_s + duration_s + 2.0 * period_s;
  const auto end =
      cell.wait_for_state([&](const auto& s) { return s.time_s >= end_s; }, std::chrono::seconds(10));
  if (!end) return 1;
  std::printf("%s joint %zu: %.4f rad before, %.4f rad after, at %.3f s\n", robot.c_str(), joint,
              start.at(joint), end->robot(robot).position.at(joint), end->time_s);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
