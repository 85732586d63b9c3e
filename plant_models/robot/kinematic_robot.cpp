#include "plant_models/robot/kinematic_robot.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>
#include <stdexcept>
#include <string>

#include "plant_models/state_bytes.h"

namespace takt {

KinematicRobot::KinematicRobot(const KinematicRobotParameters& parameters) : parameters_(parameters) {
  reset();
}

void KinematicRobot::reset() {
  segment_ = {};
  segment_.q0 = segment_.q1 = parameters_.q_initial;
  has_previous_ = false;
  feed_forward_ = {};
  torque_mode_ = false;
  rest_time_ = 0.0;
  on_trajectory_ = !trajectory_.empty();
  if (on_trajectory_) {
    rest_time_ = trajectory_.back().t;
    segment_.q0 = segment_.q1 = trajectory_.back().q;
  }
  ++revision_;
}

void KinematicRobot::set_feed_forward(const double* torques) {
  feed_forward_ = {};
  if (torques != nullptr) std::copy_n(torques, parameters_.arm.joints.size(), feed_forward_.begin());
}

void KinematicRobot::follow(double t, double period_s, const double* q, const double* qd) {
  const auto n = parameters_.arm.joints.size();
  Segment next;
  next.t0 = t;
  next.duration = period_s;
  bool moves = false;
  for (size_t k = 0; k < n; ++k) {
    next.q0[k] = q[k];
    next.v0[k] = next.v1[k] = qd[k];
    next.q1[k] = q[k] + period_s * qd[k];
    moves = moves || qd[k] != 0.0;
  }
  segment_ = next;
  on_trajectory_ = has_previous_ = false;
  torque_mode_ = true;
  rest_time_ = moves ? t + 2.0 * period_s : t;
  ++revision_;
}

void KinematicRobot::continue_from(double t, const double* q, const double* qd) {
  // Long enough to close the gap that a drive leaves behind its reference without a jerk.
  constexpr double kShortest = 0.02;
  const bool within = !on_trajectory_ && t < segment_.t0 + segment_.duration;
  const double end = within ? segment_.t0 + segment_.duration : rest_time_;
  Segment next;
  next.t0 = t;
  next.duration = std::max(end - t, kShortest);
  for (size_t k = 0; k < static_cast<size_t>(parameters_.arm.joint_count()); ++k) {
    next.q0[k] = q[k];
    next.v0[k] = qd[k];
    next.q1[k] = segment_.q1[k];
    if (within)
      next.v1[k] = segment_.v1[k];
    else if (!on_trajectory_)
      next.q1[k] += 0.5 * segment_.duration * segment_.v1[k];
  }
  if (torque_mode_) {  // without a target: evenly to rest
    constexpr double kBraking = 0.1;
    next.duration = kBraking;
    for (size_t k = 0; k < next.q1.size(); ++k) next.q1[k] = next.q0[k] + 0.5 * kBraking * next.v0[k];
    next.v1.fill(0.0);
    set_feed_forward(nullptr);
  }
  on_trajectory_ = torque_mode_ = false;
  segment_ = next;
  bool coasts = false;
  for (const double v : next.v1) coasts = coasts || v != 0.0;
  rest_time_ = t + next.duration * (coasts ? 2.0 : 1.0);
  ++revision_;
}

void KinematicRobot::set_trajectory(std::vector<TrajectoryKnot> knots) {
  for (size_t i = 1; i < knots.size(); ++i) {
    if (!(knots[i].t > knots[i - 1].t))
      throw std::invalid_argument("trajectory: time " + std::to_string(knots[i].t) + " s of knot " +
                                  std::to_string(i + 1) + " is not after " + std::to_string(knots[i - 1].t) +
                                  " s, the time of the knot before");
  }
  for (int i = 0; !knots.empty() && i < parameters_.arm.joint_count(); ++i) {
    if (const double v = knots.back().qd[static_cast<size_t>(i)]; v != 0.0)
      throw std::invalid_argument("trajectory: joint " + std::to_string(i + 1) + " still moves with " +
                                  std::to_string(v) + " at the last knot");
  }
  trajectory_ = std::move(knots);
  reset();
}

double KinematicRobot::next_time_event(double t) const {
  if (on_trajectory_) {
    for (const TrajectoryKnot& knot : trajectory_) {
      if (knot.t > t) return knot.t;
    }
  }
  return PlantModel::next_time_event(t);
}

void KinematicRobot::joint_acceleration(double t, double* qdd) const {
  // The last stage of a step that ends with the segment must not see the fading that the next set-point will
  // replace; t and the segment's end differ by rounding.
  constexpr double kRounding = 1e-9;  // s
  const int n = parameters_.arm.joint_count();
  const double T = segment_.duration;
  const double s = t - segment_.t0;
  if (on_trajectory_) {
    evaluate(trajectory_, n, t, nullptr, nullptr, qdd);
    return;
  }
  for (int i = 0; i < n; ++i) {
    const auto k = static_cast<size_t>(i);
    if (t >= rest_time_) {
      qdd[i] = 0.0;
    } else if (s <= T + kRounding) {
      const double u = s / T;
      qdd[i] = ((12.0 * u - 6.0) * (segment_.q0[k] - segment_.q1[k]) / T + (6.0 * u - 4.0) * segment_.v0[k] +
                (6.0 * u - 2.0) * segment_.v1[k]) /
               T;
    } else {
      qdd[i] = -segment_.v1[k] / T;
    }
  }
}

void KinematicRobot::joint_state(double t, double* q, double* qd) const {
  const int n = parameters_.arm.joint_count();
  const double T = segment_.duration;
  const double s = t - segment_.t0;
  if (on_trajectory_) {
    evaluate(trajectory_, n, t, q, qd, nullptr);
  } else if (t >=
             rest_time_) {  // faded out: exactly constant, so that a robot at rest is bit-for-bit at rest
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
  // Without a sent velocity it follows from successive set-points of one stream; after a pause there is no
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
  torque_mode_ = false;
  previous_set_point_ = next.q1;
  previous_set_point_time_ = t;
  has_previous_ = true;
  if (!moves && at_rest(t) && !on_trajectory_) return;  // a repeated set-point changes no bit
  segment_ = next;
  on_trajectory_ = false;
  bool coasts = false;
  for (const double v : next.v1) coasts = coasts || v != 0.0;
  rest_time_ = t + next.duration * (coasts ? 2.0 : 1.0);
  ++revision_;
}

void KinematicRobot::save(StateWriter& out) const {
  out.put(segment_.t0), out.put(segment_.duration);
  for (const JointArray* values :
       {&segment_.q0, &segment_.v0, &segment_.q1, &segment_.v1, &previous_set_point_, &feed_forward_})
    out.put(std::span<const double>(*values));
  out.put(on_trajectory_), out.put(has_previous_), out.put(torque_mode_);
  out.put(previous_set_point_time_), out.put(rest_time_);
}

void KinematicRobot::load(StateReader& in) {
  segment_.t0 = in.number("the time of a set-point");
  segment_.duration = in.number(1e-9, 1e9, "the period of a set-point");
  for (JointArray* values : {&segment_.q0, &segment_.v0, &segment_.q1, &segment_.v1, &previous_set_point_})
    in.numbers(*values, "a set-point");
  in.numbers(feed_forward_, "a feed-forward");
  on_trajectory_ = in.flag("'on a trajectory'");
  if (on_trajectory_ && trajectory_.empty()) in.fail("it follows a trajectory, but the robot has none");
  has_previous_ = in.flag("'has a set-point'");
  torque_mode_ = in.flag("'is in torque mode'");
  previous_set_point_time_ = in.number("the time of the last set-point");
  rest_time_ = in.number("the time of rest");
  ++revision_;
}

void KinematicRobot::write_motion(double t, const double*, CellMotion& motion) const {
  ArmMotion& arm = motion.arms[static_cast<size_t>(parameters_.robot)];
  JointArray q{}, qd{};
  joint_state(t, q.data(), qd.data());
  const bool rides = parameters_.mount >= 0;
  const BaseMotion base =
      rides ? motion.base_on(parameters_.mount, parameters_.X_MR) : BaseMotion{parameters_.X_WR, {}, {}};
  // The cached motion is valid if the bits of q agree, including the sign of a zero.
  if (arm.complete && std::memcmp(q.data(), arm.q.data(), sizeof(q)) == 0 &&
      std::memcmp(qd.data(), arm.qd.data(), sizeof(qd)) == 0 && (!rides || base == arm.base))
    return;
  arm.q = q;
  arm.qd = qd;
  arm.base = base;
  arm.complete = true;
  forward_kinematics(parameters_.arm, arm.q.data(), arm.poses);
  const Twist V_RF = flange_twist(parameters_.arm, arm.poses, arm.qd.data());
  arm.X_WF = base.X_WR * arm.poses.X_RF;
  arm.V_WF = {base.X_WR.R * V_RF.v, base.X_WR.R * V_RF.w};
  if (!rides) return;
  arm.V_WF.v += base.V_WR.at(arm.X_WF.p - base.X_WR.p);
  arm.V_WF.w += base.V_WR.w;
}

}  // namespace takt
