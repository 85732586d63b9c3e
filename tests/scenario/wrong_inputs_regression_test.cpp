// Reports of wrong inputs, with component and remedy, and failing runs for faults: implausible scenes and
// units, Parts that start inside of others, leave the bounds or are carried through a table, diverging
// states.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/child_process.h"
#include "tests/support/temporary_directory.h"

namespace takt::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

struct Outcome {
  int code = -1;
  std::string text;
  nlohmann::json report;
};

class ReportedInputs : public testing::Test {
 protected:
  Outcome run(const std::string& scenario, const std::vector<std::string>& more) {
    const std::filesystem::path report = directory_.path() / "report.json";
    std::filesystem::remove(report);
    std::vector<std::string> words{TAKT_BIN_DIR "/takt-run", "run", TAKT_CONFIG_DIR "/scenarios/" + scenario,
                                   "--report", report.string()};
    words.insert(words.end(), more.begin(), more.end());
    ChildProcess process(words);
    Outcome outcome;
    outcome.code = process.wait();
    outcome.text = process.text;
    if (std::ifstream in(report); in) outcome.report = nlohmann::json::parse(in, nullptr, false);
    return outcome;
  }
  std::string program(const std::string& text) {
    const std::filesystem::path file = directory_.path() / "program.lua";
    std::ofstream(file) << text;
    return file.string();
  }

  TemporaryDirectory directory_;
};

const std::string kDrop = "contact/drop.yaml";
const std::string kLift = "contact/grasp_and_lift.yaml";

TEST_F(ReportedInputs, AStepBeyondTheStabilityLimitIsRefusedAtLoad) {
  const Outcome found = run("block_assembly.yaml", {"--lod", "1", "--step", "0.01"});
  EXPECT_EQ(found.code, 2) << found.text;
  EXPECT_THAT(found.text, HasSubstr("allowed: at most 6.39 ms"));
}

TEST_F(ReportedInputs, ATooLongStepOfADynamicRobotEndsWithAFault) {
  const Outcome found = run("block_assembly.yaml", {"--lod", "2", "--step", "0.006"});
  EXPECT_EQ(found.code, 1) << found.text;
  EXPECT_THAT(found.text,
              testing::AnyOf(HasSubstr("gains energy without a cause"), HasSubstr("has left the world")));
  EXPECT_EQ(found.report.at("verdict"), "fault");
  for (const auto& [name, component] : found.report.at("components").items())
    for (const auto& coordinate : component.at("position"))
      EXPECT_LT(std::abs(coordinate.get<double>()), 100.0) << name;
}

TEST_F(ReportedInputs, AnExplicitMethodForSurfaceContactFails) {
  const Outcome found =
      run("block_assembly.yaml", {"--lod", "3", "--set", "solver.contact={method: rk2, step_s: 0.001}"});
  EXPECT_TRUE(found.code == 1 || found.code == 2) << found.code << ": " << found.text;
}

TEST_F(ReportedInputs, APartThatStartsInsideAnotherIsAFaultAtEveryLevel) {
  for (const char* level : {"1", "2", "3"}) {
    const Outcome found = run(kDrop, {"--lod", level, "--set", "parts.Box.pose.position_m=[-0.1, 0, -0.01]"});
    EXPECT_EQ(found.code, 1) << found.text;
    EXPECT_THAT(found.text,
                AllOf(HasSubstr("Box starts inside Plate, 10 mm deep"), HasSubstr("parts.Box.pose"),
                      HasSubstr("world.allow_overlap: [[Box, Plate]]")));
    EXPECT_EQ(found.report.at("verdict"), "fault");
  }
  const Outcome meant =
      run(kDrop, {"--lod", "1", "--duration", "0.1", "--set", "parts.Box.pose.position_m=[-0.1, 0, -0.01]",
                  "--set", "world.allow_overlap=[[Box, Plate]]"});
  EXPECT_EQ(meant.code, 0) << meant.text;
}

TEST_F(ReportedInputs, APartThatFallsOutOfTheWorldIsAFault) {
  const std::string beside = "parts.Box.pose.position_m=[-3, 0, 0.05]";
  const Outcome found = run(kDrop, {"--lod", "1", "--duration", "30", "--set", beside});
  EXPECT_EQ(found.code, 1) << found.text;
  EXPECT_THAT(found.text, AllOf(HasSubstr("Box has left the world at t = "), HasSubstr("world.bounds_m")));
  EXPECT_LT(found.report.at("time").get<double>(), 3.0);
  const Outcome sooner = run(kDrop, {"--lod", "1", "--set", beside, "--set",
                                     "world.bounds_m={lower: [-5, -5, -1], upper: [5, 5, 5]}"});
  EXPECT_EQ(sooner.code, 1) << sooner.text;
  EXPECT_LT(sooner.report.at("time").get<double>(), 0.5);
  const Outcome wrong = run(kDrop, {"--set", "world.bounds_m={lower: [1, 0, 0], upper: [0, 1, 1]}"});
  EXPECT_EQ(wrong.code, 2);
  EXPECT_THAT(wrong.text, AllOf(HasSubstr("world.bounds_m"), HasSubstr("lower < upper")));
}

TEST_F(ReportedInputs, APartThatIsCarriedThroughTheTableIsACollision) {
  const std::string file = program(R"(
period_s = 0.008
local GRIP = pose{x = -0.22, y = 0.20, z = 0.7} * pose{z = 0.054, roll = math.pi}
routine("Robot1", function(r)
  r.gripper:width(0.060)
  r:move_to(GRIP:offset(0, 0, 0.12), {speed = 0.35, acceleration_rad_per_s2 = 1.5})
  r:move_line(GRIP, {speed_m_per_s = 0.25, acceleration_m_per_s2 = 1.0})
  r.gripper:close()
  r:wait(0.4)
  r:move_line(GRIP:offset(0, 0, 0.05), {duration_s = 1.0})
  r:move_line(GRIP:offset(0, 0, -0.02), {duration_s = 1.0})
end)
)");
  for (const char* level : {"1", "2"}) {
    const Outcome found = run(kLift, {"--lod", level, "--program", file, "--set",
                                      "collision_checking={ignore: [['Gripper1*', '*'], ['Robot1/*', '*']]}",
                                      "--set", "assertions={free way: {check: no_collision}}"});
    EXPECT_EQ(found.code, 3) << found.text;
    EXPECT_THAT(found.text, HasSubstr("P and Table1 overlap by "));
    EXPECT_EQ(found.report.at("verdict"), "failed");
  }
}

TEST_F(ReportedInputs, MeshesInMillimetresAreNoted) {
  const Outcome part = run(kDrop, {"--lod", "1", "--set", "parts.Box.mesh_scale=1000"});
  EXPECT_NE(part.code, 0) << "it starts in the other two";
  EXPECT_THAT(part.text, AllOf(HasSubstr("note: Box is "), HasSubstr(" m large (block.obj)"),
                               HasSubstr("parts.Box.mesh_scale: 1.")));
  const Outcome ground =
      run(kDrop, {"--lod", "1", "--duration", "0.01", "--set", "grounds.Plate.mesh_scale=1000"});
  EXPECT_THAT(ground.text, HasSubstr("grounds.Plate.mesh_scale: 1."));
  const Outcome gripper =
      run(kLift, {"--lod", "1", "--duration", "0.01", "--set", "grippers.Gripper1.mesh_scale=1000"});
  EXPECT_EQ(gripper.code, 0) << gripper.text;
  EXPECT_THAT(gripper.text, AllOf(HasSubstr("note: Gripper1 is "), HasSubstr("note: Gripper1/left_jaw is "),
                                  HasSubstr("grippers.Gripper1.mesh_scale: 1.")));
}

TEST_F(ReportedInputs, WidthsPosesAndAnglesInAWrongUnitAreNoted) {
  const Outcome width =
      run(kLift, {"--lod", "1", "--duration", "0.01", "--set", "grippers.Gripper1.max_width_m=85"});
  EXPECT_THAT(width.text,
              AllOf(HasSubstr("Gripper1 opens by 85 m"), HasSubstr("grippers.Gripper1.max_width_m")));
  const Outcome pose =
      run(kLift, {"--lod", "1", "--duration", "0.01", "--set", "parts.P.pose.position_m=[-220, 200, 0.7]"});
  EXPECT_THAT(pose.text, AllOf(HasSubstr("note: P stands at (-220, 200, 0.7) m"),
                               HasSubstr("parts.P.pose.position_m in metres")));
  const Outcome turn =
      run(kLift, {"--lod", "1", "--duration", "0.01", "--set", "parts.P.pose.rpy_rad=[0, 0, 90]"});
  EXPECT_EQ(turn.code, 0) << turn.text;
  EXPECT_THAT(turn.text, AllOf(HasSubstr("note: parts.P.pose.rpy_rad has 90 rad"),
                               HasSubstr("call it parts.P.pose.rpy_deg")));
  const Outcome angle = run(kLift, {"--lod", "1", "--duration", "0.01", "--program", program(R"(
routine("Robot1", function(r)
  for i = 1, 3 do local p = pose{x = 0.5, roll = 180} end
end)
)")});
  EXPECT_EQ(angle.code, 0) << angle.text;
  EXPECT_THAT(angle.text, AllOf(HasSubstr("program.lua:3: roll = 180 is more than a full turn"),
                                HasSubstr("math.rad(180)")));
  EXPECT_EQ(angle.text.find("roll = 180 is"), angle.text.rfind("roll = 180 is")) << "once for each line";
}

TEST_F(ReportedInputs, AnOddMeshIsReported) {
  ChildProcess check({TAKT_BIN_DIR "/takt-run", "check-mesh", TAKT_CONFIG_DIR "/meshes/contact/plate.obj",
                      "--scale", "1000"});
  EXPECT_EQ(check.wait(), 0);
  EXPECT_THAT(check.text, AllOf(HasSubstr("Odd: it is "), HasSubstr("mesh_scale: 1")));
  ChildProcess small({TAKT_BIN_DIR "/takt-run", "check-mesh", TAKT_CONFIG_DIR "/meshes/contact/plate.obj"});
  EXPECT_EQ(small.wait(), 0);
  EXPECT_THAT(small.text, Not(HasSubstr("Odd")));
}

TEST_F(ReportedInputs, TooManyContactElementsNamePartFileSizeAndRemedy) {
  const Outcome found = run(
      kDrop, {"--lod", "1", "--set", "parts.Box.mesh_scale=1000", "--set", "contact.element_edge_m=0.003"});
  EXPECT_EQ(found.code, 2);
  EXPECT_THAT(found.text,
              AllOf(HasSubstr("Box (block.obj): contact: an element edge of 0.003 m"),
                    HasSubstr(" m; choose a longer one (element_edge_m)"), HasSubstr("mesh_scale: 0.001")));
}

TEST_F(ReportedInputs, APartThatFallsRestsWhereItTouches) {
  for (const char* step : {"0.001", "0.005"}) {
    const Outcome found =
        run(kDrop, {"--lod", "1", "--duration", "3", "--set", std::string("solver.step_s=") + step, "--set",
                    "parts.Box.pose.position_m=[-0.1, 0, 1]", "--set", "expected.tolerance_m=0.001"});
    EXPECT_EQ(found.code, 0) << found.text;
    const double z = found.report.at("components").at("Box").at("position").at("z");
    EXPECT_GT(z, -1e-6) << step;
    EXPECT_LT(z, 0.0002) << step << ": within the contact margin";
  }
}

TEST_F(ReportedInputs, TheShippedScenariosHaveNoNotes) {
  for (const std::string& scenario :
       {kDrop, kLift, std::string("block_assembly.yaml"), std::string("contact/press_fit.yaml"),
        std::string("contact/stack_of_ten.yaml")}) {
    const Outcome found = run(scenario, {"--lod", "1", "--duration", "0.5"});
    EXPECT_NE(found.code, 1) << found.text;
    EXPECT_THAT(found.text, AllOf(Not(HasSubstr("in metres?")), Not(HasSubstr("millimetres")),
                                  Not(HasSubstr("starts inside"))));
  }
}

}  // namespace
}  // namespace takt::test
