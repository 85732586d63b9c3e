// A program on KUKA's own RSI client (kroshu/kuka-external-control-sdk): a sine of 10 degrees on axis 1, then Stop. Prints
// the largest difference between the measured position and the command of the cycle before.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "kuka/external-control-sdk/kss/rsi/robot_interface.h"

using namespace kuka::external::control;
using kuka::external::control::kss::JointConfiguration;

int main(int argc, char** argv) {
  kss::Configuration configuration;
  configuration.client_ip = "127.0.0.1";
  configuration.client_port = argc > 1 ? std::atoi(argv[1]) : 59152;
  configuration.dof = 6;
  for (int i = 1; i <= 6; ++i)
    configuration.joint_configs.emplace_back("joint_" + std::to_string(i), JointConfiguration::Type::REVOLUTE,
                                             false);
  kss::rsi::Robot robot(configuration);
  if (robot.Setup().return_code != ReturnCode::OK) return 2;
  std::puts("ready");
  std::fflush(stdout);
  const int cycles = argc > 2 ? std::atoi(argv[2]) : 1000;
  const double degree = M_PI / 180.0;
  std::vector<double> start, command;
  double worst = 0.0;
  for (int k = 0; k < cycles; ++k) {
    if (robot.ReceiveMotionState(std::chrono::milliseconds(20000)).return_code != ReturnCode::OK) return 3;
    const std::vector<double> at = robot.GetLastMotionState().GetMeasuredPositions();
    if (start.empty()) start = command = at;
    for (std::size_t i = 0; i < 6; ++i) worst = std::max(worst, std::abs(at[i] - command[i]));
    command = start;
    command[0] += 10.0 * degree * std::sin(2.0 * M_PI * 0.004 * k / 2.0);
    robot.GetControlSignal().AddJointPositionValues(command.begin(), command.end());
    if (robot.SendControlSignal().return_code != ReturnCode::OK) return 4;
  }
  if (robot.StopControlling().return_code != ReturnCode::OK) return 5;
  // A cycle's way of the sine is 0.126 degrees.
  std::printf("{\"cycles\": %d, \"worst_deg\": %.9f, \"delay\": %llu, \"last_ipoc\": %llu}\n", cycles,
              worst / degree, static_cast<unsigned long long>(robot.getDelay()),
              static_cast<unsigned long long>(robot.getIpoc()));
  return 0;
}
