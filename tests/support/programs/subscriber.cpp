// A client that only listens, reliably, to everything a cell says: for tests that freeze or kill it.
// Usage: takt-test-subscriber DOMAIN CELL ROBOT. Prints "ready" when it has received a sample of each topic,
// then runs until it is killed.
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <string>

#include "tests/support/raw_dds_client.h"

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  using namespace takt_msgs::msg;
  takt::test::RawDdsClient client(static_cast<std::uint32_t>(std::atoi(argv[1])));
  const std::string cell = std::string("rt/") + argv[2] + "/";
  const auto any = [](const auto& messages) { return !messages.empty(); };
  const auto status = client.read<Status>(cell + "status", true, true, 1);
  const auto events = client.read<Event>(cell + "events", true, false, 1000);
  const auto state = client.read<CellState>(cell + "state", false, false, 1);
  const auto joints =
      client.read<sensor_msgs::msg::JointState>(cell + argv[3] + "/joint_states", true, false, 10);
  const auto clock = client.read<rosgraph_msgs::msg::Clock>("rt/clock", true, false, 1);
  if (!status->wait_until(any) || !state->wait_until(any) || !joints->wait_until(any) ||
      !clock->wait_until(any))
    return 1;
  std::printf("ready\n");
  std::fflush(stdout);
  for (;;) pause();
}
