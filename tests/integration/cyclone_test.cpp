// Another vendor's DDS: a program in C with Cyclone DDS drives a robot and reads the cell's samples.
#ifdef TAKT_HAS_CYCLONE
#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/support/child_process.h"
#include "tests/support/dds_service.h"

namespace takt {
namespace {

TEST(CycloneDds, ACycloneClientDrivesARobotAndReadsStateEventsAndJointStates) {
  ASSERT_EQ(setenv("CYCLONEDDS_URI",
                   "<General><Interfaces><NetworkInterface name='lo' multicast='true'/></Interfaces>"
                   "<AllowMulticast>true</AllowMulticast></General>",
                   1),
            0);
  RunLoopOptions options;
  options.pace = Pace::realtime;
  test::DdsService service(options);
  test::ChildProcess client({std::string(TAKT_BIN_DIR) + "/takt-test-cyclone",
                             std::to_string(test::test_domain()), test::test_cell(), "Robot1"});
  EXPECT_EQ(client.wait(), 0) << client.text;
  EXPECT_NE(client.text.find("first joint: shoulder_pan_joint, frame: Robot1/base_link"), std::string::npos)
      << client.text;
  EXPECT_NE(client.text.find("position 100 rad of joint 'shoulder_pan_joint' is outside"), std::string::npos)
      << client.text;
  EXPECT_NE(client.text.find("arrived 1, applied 1, rejected 1"), std::string::npos) << client.text;
  service.stop();
  Snapshot snapshot = service.simulation().make_snapshot();
  EXPECT_NEAR(snapshot.robots[0].position[0], 0.02, 1e-12) << "seen by the simulation itself";
  EXPECT_GT(snapshot.robots[0].commands_applied, 0U);
}

}  // namespace
}  // namespace takt
#endif
