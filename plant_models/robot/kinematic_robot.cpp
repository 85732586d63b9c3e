#include "plant_models/robot/kinematic_robot.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace takt {

KinematicRobot::KinematicRobot(const KinematicRobotParameters& parameters) : parameters_(parameters) {
  reset();
}

void KinematicRobot::reset() {
  segment_ = {};
  segment_.q0 = segment_.q1 = parameters_.q_initial;
  has_previous_ = false;
  rest_time_ = 0.0;
  ++revision_;
}

void KinematicRobot::joint_state(double t, double* q, double* qd) const {
  const int n = parameters_.arm.joint_count();
  const double T = segment_.duration;
  const double s = t - segment_.t0;
  if (t >= rest_time_) {  // faded out: exactly constant, so that a robot at rest is bit-for-bit at rest
    for (int i = 0; i < n; ++i) {
      const auto k = static_cast<size_t>(i);
      q[i] = segment_.q1[k] + 0.5 * T * segment_.v1[k];
      qd[i] = 0.0;
    }
  } else if (s <= T) {  // cubic Hermite
    const double u = s / T;
    const double h00 = (1.0 + 2.0 * u) * (1.0 - u) * (1.0 - u), h10 = u * (1.0 - u) * (1.0 - u);
    const double h01 = u * u * (3.0 - 2.0 * u), h11 = u * u * (u - 1.0);
    const double d00 = 6.0 * u * (u - 1.0), d10 = (1.0 - u) * (1.0 - 3.0 * u), d11 = u * (3.0 * u - 2.0);
    for (int i = 0; i < n; ++i) {
      const auto k = static_cast<size_t>(i);
      q[i] = h00 * segment_.q0[k] + h01 * segment_.q1[k] + T * (h10 * segment_.v0[k] + h11 * segment_.v1[k]);
      qd[i] = d00 * (segment_.q0[k] - segment_.q1[k]) / T + d10 * segment_.v0[k] + d11 * segment_.v1[k];
    }
  } else {  // no new set-point: the velocity fades linearly to zero within one more period
    const double r = s - T;
    for (int i = 0; i < n; ++i) {
      const auto k = static_cast<size_t>(i);
      q[i] = segment_.q1[k] + segment_.v1[k] * (r - 0.5 * r * r / T);
      qd[i] = segment_.v1[k] * (1.0 - r / T);
    }
  }
}

void KinematicRobot::set_point(double t, double period_s, const double* position, const double* velocity) {
  const int n = parameters_.arm.joint_count();
  Segment next;
  next.t0 = t;
  next.duration = period_s;
  joint_state(t, next.q0.data(), next.v0.data());
  // Successive set-points of one stream give the velocity where none was sent; after a pause there is no
  // stream.
  const bool stream = has_previous_ && t - previous_set_point_time_ <= 1.5 * period_s;
  bool moves = false;
  double stretched = period_s;
  for (int i = 0; i < n; ++i) {
    const auto k = static_cast<size_t>(i);
    next.q1[k] = position[i];
    next.v1[k] = velocity != nullptr ? velocity[i]
                                     : (stream ? (position[i] - previous_set_point_[k]) / period_s : 0.0);
    const double limit = parameters_.arm.joints[k].max_velocity;
    const double distance = std::abs(next.q1[k] - next.q0[k]);
    // A cubic from rest to rest peaks at 1.5 times its mean velocity. The small allowance keeps an
    // interpolated stream at exactly rated velocity from being mistaken for a jump.
    if (distance > limit * period_s * 1.05) stretched = std::max(stretched, 1.5 * distance / limit);
    moves = moves || next.q1[k] != next.q0[k] || next.v0[k] != 0.0 || next.v1[k] != 0.0;
  }
  if (stretched > period_s) {
    next.duration = stretched;
    next.v1.fill(0.0);
  }
  previous_set_point_ = next.q1;
  previous_set_point_time_ = t;
  has_previous_ = true;
  if (!moves && at_rest(t)) return;  // the standing set-point repeated: nothing changes, not even a rounding
  segment_ = next;
  bool coasts = false;
  for (const double v : next.v1) coasts = coasts || v != 0.0;
  rest_time_ = t + next.duration * (coasts ? 2.0 : 1.0);
  ++revision_;
}

void KinematicRobot::write_motion(double t, const double*, CellMotion& motion) const {
  ArmMotion& arm = motion.arms[static_cast<size_t>(parameters_.robot)];
  JointArray q{}, qd{};
  joint_state(t, q.data(), qd.data());
  // What stands still, or is asked again for the same time, has the same motion: bit for bit, so that a zero
  // and a minus zero are not the same.
  if (arm.complete && std::memcmp(q.data(), arm.q.data(), sizeof(q)) == 0 &&
      std::memcmp(qd.data(), arm.qd.data(), sizeof(qd)) == 0)
    return;
  arm.q = q;
  arm.qd = qd;
  arm.complete = true;
  forward_kinematics(parameters_.arm, arm.q.data(), arm.poses);
  const Twist V_RF = flange_twist(parameters_.arm, arm.poses, arm.qd.data());
  arm.X_WF = parameters_.X_WR * arm.poses.X_RF;
  arm.V_WF = {parameters_.X_WR.R * V_RF.v, parameters_.X_WR.R * V_RF.w};
}

}  // namespace takt
