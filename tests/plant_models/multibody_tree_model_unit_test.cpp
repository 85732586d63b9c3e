// Refusals of the equations of motion: models of trees and couplings of joints.
#include <gmock/gmock.h>

#include <cmath>
#include <functional>

#include "plant_models/mechanics/joint_coupling.h"
#include "plant_models/mechanics/multibody_tree.h"

namespace takt {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// Error of a MultibodyTree for a model with one fault.
std::string tree_error(const std::function<void(TreeModel&)>& change) {
  TreeModel model;
  for (int i = 0; i < 2; ++i) {
    TreeJoint joint;
    joint.joint.name = i == 0 ? "first" : "second";
    joint.parent = i - 1;
    joint.inertia = {1.0, Vec3(0.1, 0.0, 0.0), 0.01 * Mat3::Identity()};
    model.joints.push_back(joint);
  }
  change(model);
  try {
    const MultibodyTree tree(model);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "no error";
}

TEST(MultibodyTreeModel, RefusesWhatIsNotPhysical) {
  const auto second = [](TreeModel& model) -> TreeJoint& { return model.joints[1]; };
  EXPECT_EQ(tree_error([](TreeModel&) {}), "no error");
  EXPECT_THAT(tree_error([&](TreeModel& m) { second(m).parent = 1; }),
              AllOf(HasSubstr("joint 'second' (number 2)"), HasSubstr("parent")));
  EXPECT_THAT(tree_error([&](TreeModel& m) { second(m).inertia.mass_kg = -1.0; }),
              AllOf(HasSubstr("'second'"), HasSubstr("mass is -1 kg")));
  EXPECT_THAT(tree_error([&](TreeModel& m) { second(m).inertia.I_BBcm_B(0, 0) = -1.0; }),
              HasSubstr("none may be negative"));
  EXPECT_THAT(tree_error([&](TreeModel& m) { second(m).inertia.I_BBcm_B(0, 1) = 0.005; }),
              HasSubstr("not symmetric"));
  EXPECT_THAT(tree_error([&](TreeModel& m) { second(m).inertia.I_BBcm_B(2, 2) = std::nan(""); }),
              HasSubstr("tensor is not finite"));
  EXPECT_THAT(tree_error([&](TreeModel& m) { second(m).inertia.p_BBcm_B.x() = std::nan(""); }),
              HasSubstr("centre of mass is not finite"));
  EXPECT_THAT(tree_error([&](TreeModel& m) {
                second(m).joint.axis = {0.0, 0.0, 2.0};
              }),
              HasSubstr("not a unit vector"));
  EXPECT_THAT(tree_error([&](TreeModel& m) { second(m).armature = -0.1; }), HasSubstr("its drive is -0.1"));
  EXPECT_THAT(tree_error([&](TreeModel& m) { second(m).inertia = {}; }),
              AllOf(HasSubstr("'second'"), HasSubstr("nothing resists its motion")));
  EXPECT_THAT(tree_error([&](TreeModel& m) {
                second(m).inertia = {};
                second(m).armature = 0.1;
              }),
              "no error");
  EXPECT_THAT(tree_error([](TreeModel& m) { m.gravity_R.x() = std::nan(""); }), HasSubstr("gravity"));
  EXPECT_THAT(tree_error([](TreeModel& m) { m.joints.resize(kMaxJoints + 1, m.joints[0]); }),
              HasSubstr("17 moving joints; at most 16"));
}

TEST(JointCouplingModel, RefusesRingsAndUnknownJoints) {
  const auto error = [](const std::vector<MimicJoint>& mimics) -> std::string {
    try {
      const JointCoupling coupling(3, mimics);
    } catch (const std::invalid_argument& thrown) {
      return thrown.what();
    }
    return "no error";
  };
  EXPECT_EQ(error({{2, 1, 1.0, 0.0}, {1, 0, 1.0, 0.0}}), "no error");
  EXPECT_THAT(error({{2, 3, 1.0, 0.0}}), HasSubstr("joint number 3 follows number 4"));
  EXPECT_THAT(error({{2, 1, 1.0, 0.0}, {2, 0, 1.0, 0.0}}), HasSubstr("follows two joints"));
  EXPECT_THAT(error({{2, 1, 1.0, 0.0}, {1, 2, 1.0, 0.0}}), HasSubstr("ring"));
  EXPECT_THAT(error({{2, 1, std::nan(""), 0.0}}), HasSubstr("finite"));
}

}  // namespace
}  // namespace takt
