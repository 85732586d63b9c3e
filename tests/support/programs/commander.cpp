// A controller that is there to be killed: commands one robot, exclusively and strongly, to one pose.
// Usage: takt-test-commander DOMAIN CELL ROBOT FIRST_JOINT [LEASE_S]. Sends, prints "ready", and stays until
// it is killed. With a lease it promises a sign of life every second, as takt's own clients do; DDS itself
// misses it after that many seconds.
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <string>

#include "tests/support/raw_dds_client.h"

int main(int argc, char** argv) {
  if (argc != 5 && argc != 6) return 2;
  takt::test::RawDdsClient client(static_cast<std::uint32_t>(std::atoi(argv[1])),
                                  argc == 6 ? std::atoi(argv[5]) : 2);
  const std::string topic = std::string("rt/") + argv[2] + "/" + argv[3] + "/joint_commands";
  auto writer = client.write<sensor_msgs::msg::JointState>(topic, true, 9, argc == 6 ? 1.0 : 0.0);
  if (!writer.matches->wait_for(1)) return 1;
  sensor_msgs::msg::JointState message;
  message.name = {"shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint",
                  "wrist_1_joint",      "wrist_2_joint",       "wrist_3_joint"};
  constexpr double kQuarter = 1.5707963267948966;
  message.position = {std::atof(argv[4]), -kQuarter, kQuarter, -kQuarter, -kQuarter, 0.0};
  if (!takt::written(*writer.writer, message)) return 1;
  // Reliable: acknowledged means that the cell has it.
  if (!takt::is_ok(writer.writer->wait_for_acknowledgments(takt::DdsDuration(60, 0)))) return 1;
  std::printf("ready\n");
  std::fflush(stdout);
  for (;;) pause();
}
