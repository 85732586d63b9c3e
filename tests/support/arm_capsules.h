#pragma once
// Capsules about a UR10e's tubes and the block scenario's gripper: the clearance of two arms, computed
// independently of the simulation's own geometry.
#include <algorithm>
#include <vector>

#include "plant_models/robot/arm_kinematics.h"
#include "plant_models/spatial.h"

namespace takt::test {

/// A segment in the world and a generous radius (m).
struct Capsule {
  Vec3 a, b;
  double radius;
};

/// Number of capsules of an arm that are not pads; the two pads, which reach down to the parts, come last.
inline constexpr std::size_t kCapsulesBeforePads = 7;

/// The arm with base frame X_WR at these joint positions.
inline std::vector<Capsule> arm_capsules(const ArmModel& arm, const Pose& X_WR, const JointArray& q) {
  ArmPoses poses;
  forward_kinematics(arm, q.data(), poses);
  const auto link = [&](std::size_t i, const Vec3& p) -> Vec3 { return X_WR * (poses.link[i] * p); };
  const auto flange = [&](const Vec3& p) -> Vec3 { return X_WR * (poses.X_RF * p); };
  return {{link(0, Vec3::Zero()), link(1, {0.0, 0.0, 0.17}), 0.09},
          {link(1, {0.0, 0.0, 0.17}), link(1, {-0.6127, 0.0, 0.17}), 0.09},
          {link(2, {0.0, 0.0, 0.05}), link(2, {-0.57155, 0.0, 0.05}), 0.07},
          {link(2, {-0.57155, 0.0, 0.05}), link(3, Vec3::Zero()), 0.06},
          {link(3, Vec3::Zero()), link(4, Vec3::Zero()), 0.06},
          {link(4, Vec3::Zero()), flange(Vec3::Zero()), 0.06},
          {flange({0.0, -0.05, 0.04}), flange({0.0, 0.05, 0.04}), 0.06},
          {flange({0.0, -0.08, 0.08}), flange({0.0, -0.08, 0.20}), 0.025},
          {flange({0.0, 0.08, 0.08}), flange({0.0, 0.08, 0.20}), 0.025}};
}

/// Between two capsules, negative when they overlap. Golden sections would do; sampling one segment and
/// projecting onto the other is plainer.
inline double distance(const Capsule& s, const Capsule& t) {
  double least = 1e9;
  for (int i = 0; i <= 20; ++i) {
    const Vec3 p = s.a + (s.b - s.a) * (i / 20.0);
    const Vec3 d = t.b - t.a;
    const double along = std::clamp((p - t.a).dot(d) / d.squaredNorm(), 0.0, 1.0);
    least = std::min(least, (p - t.a - along * d).norm());
  }
  return least - s.radius - t.radius;
}

/// Least distance of two arms.
inline double distance(const std::vector<Capsule>& first, const std::vector<Capsule>& second) {
  double least = 1e9;
  for (const Capsule& s : first) {
    for (const Capsule& t : second) least = std::min(least, distance(s, t));
  }
  return least;
}

}  // namespace takt::test
