// takt-from-cad --robot: moves that cannot be made are left out, with a reason, and the cell runs without them.
#include <gmock/gmock.h>
#include <cstdlib>
#include <fstream>

#include "tests/cad/assemblies.h"
#include "tests/support/temporary_directory.h"

namespace takt::cad {
namespace {

using test::block;
using test::cut;
using test::fuse;
using test::moved_by;
using test::StepProduct;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

/// A slider on a rail with a T-slot, in a pocket of the base that lets both out together alone. Laid down, the slider touches
/// the rail alone, whose hierarchy number is smaller: at level 1 nothing holds it.
StepProduct slider_in_pocket() {
  const TopoDS_Shape head = fuse(block(30, 26, 14, 40, 8, 4), block(30, 20, 18, 40, 20, 4));
  StepProduct made("Pocket");
  made.use(made.root(), made.part("Base", cut(block(0, 0, 0, 100, 60, 30), block(30, 15, 10, 40, 30, 20))),
           "Base");
  made.use(made.root(), made.part("Rail", fuse(block(30, 15, 10, 40, 30, 4), head)), "Rail");
  made.use(made.root(), made.part("Slider", cut(block(30, 15, 14, 40, 30, 31), head)), "Slider");
  return made;
}

class RobotTrial : public testing::Test {
 protected:
  /// Runs takt-from-cad with --robot; what it says to the error output.
  std::string notes_of(StepProduct made) {
    made.write(directory_ / "product.step");
    const std::string command = std::string(TAKT_BIN_DIR "/takt-from-cad ") +
                                (directory_ / "product.step").string() + " --robot -o " + out().string() +
                                " > /dev/null 2> " + (directory_ / "said.txt").string();
    EXPECT_EQ(std::system(command.c_str()), 0);
    return text(directory_ / "said.txt");
  }
  std::filesystem::path out() const { return directory_ / "out"; }
  static std::string text(const std::filesystem::path& file) {
    std::ifstream in(file);
    return std::string((std::istreambuf_iterator<char>(in)), {});
  }

 private:
  test::TemporaryDirectory directory_;
};

constexpr const char* kReason =
    "The robot does not lift Rail, Slider: laid down, Slider would stand on other parts that leave with it, "
    "with no place for a post under it";

TEST_F(RobotTrial, AGroupWithoutFootingOnTheTrayIsLeftOutAndTheOthersStay) {
  StepProduct made = slider_in_pocket();
  made.use(made.root(), made.part("Block", test::box(15, 15, 10)), "Block", moved_by(5, 20, 30));
  EXPECT_THAT(notes_of(std::move(made)), ContainsRegex(kReason));
  EXPECT_THAT(text(out() / "Pocket_robot.yaml"), ContainsRegex(std::string("# Note: ") + kReason));
  EXPECT_THAT(text(out() / "Pocket_robot.lua"),
              testing::AllOf(HasSubstr("lift Block"), Not(HasSubstr("lift Slider"))));
  const std::string run =
      TAKT_BIN_DIR "/takt-run run " + (out() / "Pocket_robot.yaml").string() + " > /dev/null 2>&1";
  EXPECT_EQ(std::system(run.c_str()), 0);
}

TEST_F(RobotTrial, WithoutAMoveThatSucceedsNoFileOfTheRobotIsLeft) {
  const std::string notes = notes_of(slider_in_pocket());
  EXPECT_THAT(notes, ContainsRegex(kReason));
  EXPECT_THAT(notes, HasSubstr("the robot takes no part out of the product: there is no cell with a robot"));
  EXPECT_TRUE(std::filesystem::exists(out() / "Pocket.yaml"));
  for (const char* file : {"Pocket_robot.yaml", "Pocket_robot.lua", "gantry.urdf", "meshes/Tray.obj",
                           "meshes/gripper_jaw.obj", "meshes/gripper_body.obj"})
    EXPECT_FALSE(std::filesystem::exists(out() / file)) << file;
}

TEST_F(RobotTrial, TheProgramSaysWhichPartIsNotHeldAndWhereItIs) {
  StepProduct made("Stack");
  made.use(made.root(), made.part("Base", test::box(60, 60, 10)), "Base");
  made.use(made.root(), made.part("Block", test::box(20, 20, 10)), "Block", moved_by(20, 20, 10));
  EXPECT_THAT(notes_of(std::move(made)), Not(HasSubstr("does not")));
  // With a number above that of the base it falls at the start.
  const auto said = out() / "said.txt";
  const std::string run = TAKT_BIN_DIR "/takt-run run " + (out() / "Stack_robot.yaml").string() +
                          " --set parts.Block.hierarchy=9 > " + said.string() + " 2>&1";
  EXPECT_NE(std::system(run.c_str()), 0);
  EXPECT_THAT(text(said), ContainsRegex("the jaws do not hold Block; it is at .* m, held by [A-Za-z]+"));
}

}  // namespace
}  // namespace takt::cad
