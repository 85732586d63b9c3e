// A program on ros-industrial/abb_libegm: a sine of 10 degrees on joint 1 with velocity references. Prints the largest
// difference between the measured position and the reference of the message before.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <thread>

#include "abb_libegm/egm_controller_interface.h"

int main(int argc, char** argv) {
  boost::asio::io_service io;
  abb::egm::BaseConfiguration configuration;
  configuration.use_velocity_outputs = true;
  abb::egm::EGMControllerInterface robot(
      io, static_cast<unsigned short>(argc > 1 ? std::atoi(argv[1]) : 6510), configuration);
  if (!robot.isInitialized()) return 2;
  std::thread thread([&io] { io.run(); });
  std::puts("ready");
  std::fflush(stdout);
  const int cycles = argc > 2 ? std::atoi(argv[2]) : 1000;
  abb::egm::wrapper::Input input;
  abb::egm::wrapper::Output output;
  double start = 0.0, reference = 0.0, worst = 0.0;
  unsigned first = 0;
  for (int k = 0; k < cycles; ++k) {
    if (!robot.waitForMessage(5000)) std::_Exit(3);
    robot.read(&input);
    const unsigned seqno = input.header().sequence_number();
    const double at = input.feedback().robot().joints().position().values(0);
    if (k == 0) {
      start = at;
      first = seqno;
      output.mutable_robot()->mutable_joints()->mutable_position()->CopyFrom(
          input.feedback().robot().joints().position());
      for (int i = 0; i < 6; ++i)
        output.mutable_robot()->mutable_joints()->mutable_velocity()->add_values(0.0);
    } else {
      worst = std::max(worst, std::abs(at - start - reference));
    }
    const double w = M_PI, t = 0.004 * (seqno - first);
    reference = 10.0 * std::sin(w * t);
    output.mutable_robot()->mutable_joints()->mutable_position()->set_values(0, start + reference);
    output.mutable_robot()->mutable_joints()->mutable_velocity()->set_values(0, 10.0 * w * std::cos(w * t));
    robot.write(output);
  }
  io.stop();
  thread.join();
  std::printf(
      "{\"messages\": %d, \"worst_deg\": %.6f, \"last_seqno\": %u, \"motors\": %d, \"mci\": %d, \"rapid\": "
      "%d}\n",
      cycles, worst, input.header().sequence_number(), static_cast<int>(input.status().motor_state()),
      static_cast<int>(input.status().egm_state()), static_cast<int>(input.status().rapid_execution_state()));
  return 0;
}
