#include "client_lib/gateway/ur/dh.h"

#include <cmath>
#include <numbers>

namespace takt::ur {
namespace {

constexpr double kParallel = 1e-9;  ///< sine of the angle between two axes

struct Axis {
  Vec3 point, direction;
};

Pose dh_transform(double theta, double d, double a, double alpha) {
  const Mat3 Rz = Eigen::AngleAxisd(theta, Vec3::UnitZ()).toRotationMatrix();
  const Mat3 Rx = Eigen::AngleAxisd(alpha, Vec3::UnitX()).toRotationMatrix();
  return {Rz * Rx, Vec3(0.0, 0.0, d) + Rz * Vec3(a, 0.0, 0.0)};
}

/// Angle from `from` to `to` about the unit vector `axis`, to which both are perpendicular.
double angle_about(const Vec3& axis, const Vec3& from, const Vec3& to) {
  return std::atan2(axis.dot(from.cross(to)), from.dot(to));
}

}  // namespace

DhArm dh_parameters(const ArmModel& arm) {
  const JointArray zero{};
  ArmPoses poses;
  forward_kinematics(arm, zero.data(), poses);
  std::array<Axis, 6> axes;
  for (std::size_t i = 0; i < 6; ++i)
    axes.at(i) = {poses.link.at(i).p, poses.link.at(i).R * arm.joints[i].axis.normalized()};

  DhArm result;
  // Frame 0: z along the first axis, origin where the base is nearest to it, x as the base's where that is possible.
  Pose frame;
  {
    const Vec3 z = axes[0].direction;
    Vec3 x = Vec3::UnitX() - z * z.x();
    if (x.norm() < 0.1) x = Vec3::UnitY() - z * z.y();
    x.normalize();
    frame.R.col(0) = x;
    frame.R.col(1) = z.cross(x);
    frame.R.col(2) = z;
    frame.p = axes[0].point - z * z.dot(axes[0].point);
  }
  result.X_R0 = frame;
  for (std::size_t i = 0; i < 5; ++i) {
    const Vec3 z = frame.R.col(2), x = frame.R.col(0);
    const Axis& next = axes.at(i + 1);
    const Vec3 cross = z.cross(next.direction), between = next.point - frame.p;
    double d = 0.0;
    Vec3 foot;  // where the common normal meets the next axis
    Vec3 normal;
    if (cross.norm() < kParallel) {
      normal = between - z * z.dot(between);
      foot = frame.p + normal;
    } else {
      // Feet of the common normal: frame.p + d z and next.point + t direction.
      const double c = z.dot(next.direction), s2 = cross.squaredNorm();
      d = (between.dot(z) - c * between.dot(next.direction)) / s2;
      const double t = (c * between.dot(z) - between.dot(next.direction)) / s2;
      foot = next.point + t * next.direction;
      normal = foot - (frame.p + d * z);
      if (normal.norm() < kParallel) normal = cross.normalized() * 0.0;
    }
    double a = normal.norm();
    Vec3 new_x =
        a > kParallel ? Vec3(normal / a) : Vec3(cross.norm() < kParallel ? x : Vec3(cross.normalized()));
    if (a <= kParallel) a = 0.0;
    double theta = angle_about(z, x, new_x);
    if (std::abs(theta) > 0.5 * std::numbers::pi + 1e-9) {
      new_x = -new_x;
      a = -a;
      theta = angle_about(z, x, new_x);
    }
    const double alpha = angle_about(new_x, z, next.direction);
    result.parameters.theta.at(i) = theta;
    result.parameters.d.at(i) = d;
    result.parameters.a.at(i) = a;
    result.parameters.alpha.at(i) = alpha;
    frame = frame * dh_transform(theta, d, a, alpha);
  }
  // Frame 6 where the flange is nearest to the last axis.
  result.parameters.d[5] = (poses.X_RF.p - frame.p).dot(Vec3(frame.R.col(2)));
  frame = frame * dh_transform(0.0, result.parameters.d[5], 0.0, 0.0);
  result.X_6F = frame.inverse() * poses.X_RF;
  return result;
}

}  // namespace takt::ur
