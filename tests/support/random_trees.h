#pragma once
// Trees of random bodies on random joints, and random motions of them.
#include <random>

#include "plant_models/mechanics/multibody_tree.h"

namespace takt::test {

class TreeMaker {
 public:
  explicit TreeMaker(unsigned seed) : random_(seed) {}

  double number(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  int integer(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
  Vec3 vector(double size) { return {number(-size, size), number(-size, size), number(-size, size)}; }
  Mat3 rotation() {
    const Vec3 axis = vector(1.0);
    return Eigen::AngleAxisd(number(-3.0, 3.0), axis.normalized()).toRotationMatrix();
  }
  Pose pose(double size) { return {rotation(), vector(size)}; }

  /// Several point masses: physical for any values.
  BodyInertia body() {
    BodyInertia sum;
    for (int i = 0; i < 5; ++i)
      sum = combined(sum, {number(0.1, 2.0), Vec3::Zero(), Mat3::Zero()}, {Mat3::Identity(), vector(0.3)});
    return sum;
  }

  /// Revolute and prismatic joints about any axis, on any link before.
  TreeModel tree(int joints, bool branched = true) {
    TreeModel tree;
    tree.gravity_R = vector(10.0);
    for (int i = 0; i < joints; ++i) {
      TreeJoint joint;
      joint.joint.name = "j" + std::to_string(i + 1);
      joint.joint.type = integer(0, 3) == 0 ? JointType::prismatic : JointType::revolute;
      joint.joint.X_PJ = pose(0.5);
      joint.joint.axis = vector(1.0).normalized();
      joint.parent = branched ? integer(-1, i - 1) : i - 1;
      joint.inertia = body();
      tree.joints.push_back(joint);
    }
    return tree;
  }

  JointArray joints(double size) {
    JointArray result{};
    for (double& x : result) x = number(-size, size);
    return result;
  }
  Wrench wrench() { return {vector(100.0), vector(30.0)}; }

 private:
  std::mt19937 random_;
};

}  // namespace takt::test
