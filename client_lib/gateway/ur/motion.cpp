#include "client_lib/gateway/ur/motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace takt::ur {
namespace {

// Defaults of URScript's movej and movel.
constexpr double kJointAcceleration = 1.4, kJointSpeed = 1.05;
constexpr double kToolAcceleration = 1.2, kToolSpeed = 0.25;
/// Of speedj and speedl in external control programs, rad/s^2.
constexpr double kSpeedAcceleration = 40.0;
/// What a robot's own joints can do where a duration asks for more.
constexpr double kMostJointAcceleration = 15.0;
constexpr double kMostToolSpeed = 3.0, kMostToolAcceleration = 15.0;
constexpr double kSlowestTurn_rad_per_s = 1.05;  ///< of the tool's orientation, per m/s of the default speed
// Of the external control program: deceleration at the end of a trajectory.
constexpr double kSplineDeceleration = 15.0, kSplineSpeed = 6.283185;
constexpr double kRest = 1e-6;
constexpr int kSamples = 40;           ///< of a path, for its speed
constexpr double kSpeedReserve = 0.9;  ///< between two samples a joint may be faster

double largest(const Vector6& values) {
  double most = 0.0;
  for (const double value : values) most = std::max(most, std::abs(value));
  return most;
}

/// The fastest motion in the limits of `wanted`, or in those of the machine where the duration asks for more.
MotionProfile profile_for(const ProfileLimits& wanted, const ProfileLimits& machine, double duration_s,
                          double period_s) {
  if (duration_s > 0.0) {
    if (const auto lasting = MotionProfile::lasting(duration_s, machine, period_s)) return *lasting;
    return MotionProfile::fastest(machine, period_s);
  }
  return MotionProfile::fastest(
      {std::min(wanted.speed, machine.speed), std::min(wanted.acceleration, machine.acceleration)}, period_s);
}

}  // namespace

Pose pose_of(const Vector6& values) {
  const Vec3 turn(values[3], values[4], values[5]);
  const double angle = turn.norm();
  Pose X;
  X.p = Vec3(values[0], values[1], values[2]);
  if (angle > 0.0) X.R = Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
  return X;
}

Vector6 vector_of(const Pose& X) {
  const Vec3 turn = rotation_vector(X.R);
  return {X.p.x(), X.p.y(), X.p.z(), turn.x(), turn.y(), turn.z()};
}

Motion::Motion(const ArmModel& arm, double cycle_s) : arm_(arm), cycle_s_(cycle_s) {}

void Motion::reset(const Vector6& q) {
  q_ = q;
  qd_ = qdd_ = {};
  mode_ = Mode::stop;
  path_ = std::monostate{};
}

void Motion::relocate(const Vector6& q) {
  q_ = servo_q_ = q;
  qd_ = qdd_ = {};
  servo_fresh_ = servo_begun_ = false;
  path_ = std::monostate{};
  if (mode_ == Mode::path) mode_ = Mode::stop;
}

JointArray Motion::joints(const Vector6& q) const {
  JointArray values{};
  std::copy(q.begin(), q.end(), values.begin());
  return values;
}

Pose Motion::tool_pose(const Vector6& q) const {
  ArmPoses poses;
  forward_kinematics(arm_, q.data(), poses);
  return poses.X_RF * X_FT_;
}

Vector6 Motion::tool_speed(const Vector6& q, const Vector6& qd) const {
  ArmPoses poses;
  forward_kinematics(arm_, q.data(), poses);
  const Twist flange = flange_twist(arm_, poses, qd.data());
  const Vec3 v = flange.at(poses.X_RF.R * X_FT_.p);
  return {v.x(), v.y(), v.z(), flange.w.x(), flange.w.y(), flange.w.z()};
}

std::optional<Vector6> Motion::inverse_kinematics(const Pose& X_RT, const Vector6& near) const {
  const IkSolution solution = solve_ik(arm_, X_RT * X_FT_.inverse(), joints(near));
  if (!solution.found) return std::nullopt;
  Vector6 q;
  std::copy_n(solution.q.begin(), q.size(), q.begin());
  return q;
}

bool Motion::within_limits(const Vector6& q) const {
  for (std::size_t i = 0; i < q.size(); ++i)
    if (!(q.at(i) >= arm_.joints[i].lower && q.at(i) <= arm_.joints[i].upper)) return false;
  return true;
}

bool Motion::at_rest() const {
  return largest(qd_) < kRest;
}

double Motion::spline_time_s() const {
  const auto* run = std::get_if<SplineRun>(&path_);
  return run == nullptr ? 0.0 : run->traveled_s;
}

void Motion::stop(double deceleration) {
  mode_ = Mode::stop;
  deceleration_ = deceleration;
  path_ = std::monostate{};
}

void Motion::begin_servo() {
  path_ = std::monostate{};
  mode_ = Mode::servo;
  servo_q_ = q_;
  servo_fresh_ = servo_begun_ = false;
}

void Motion::servo(const Vector6& q) {
  servo_q_ = q;
  servo_fresh_ = servo_begun_ = true;
}

void Motion::speed(const Vector6& qd) {
  path_ = std::monostate{};
  mode_ = Mode::speed;
  commanded_speed_ = qd;
}

void Motion::tool_speed_command(const Vector6& twist) {
  path_ = std::monostate{};
  mode_ = Mode::tool_speed;
  commanded_speed_ = twist;
}

void Motion::move_joints(const Vector6& to, const MoveOptions& options) {
  double way = 0.0;
  ProfileLimits machine{1e9, 1e9};
  for (std::size_t i = 0; i < to.size(); ++i) {
    const double part = std::abs(to.at(i) - q_.at(i));
    way = std::max(way, part);
    if (part == 0.0) continue;
    machine.speed = std::min(machine.speed, arm_.joints[i].max_velocity / part);
    machine.acceleration = std::min(machine.acceleration, kMostJointAcceleration / part);
  }
  const double least = std::max(way, 1e-9);
  const ProfileLimits wanted{
      (options.speed > 0.0 ? options.speed : kJointSpeed) / least,
      (options.acceleration > 0.0 ? options.acceleration : kJointAcceleration) / least};
  path_ = JointLine{q_, to, profile_for(wanted, machine, options.duration_s, cycle_s_)};
  mode_ = Mode::path;
}

bool Motion::start_tool_path(ToolPath path, double length_m, double angle_rad, const MoveOptions& options) {
  const double speed = options.speed > 0.0 ? options.speed : kToolSpeed;
  const double acceleration = options.acceleration > 0.0 ? options.acceleration : kToolAcceleration;
  // The orientation turns within the same limits, as the rim of a tool of some 0.25 m would move.
  constexpr double kRadius_m = kToolSpeed / kSlowestTurn_rad_per_s;
  const double way = std::max({length_m, kRadius_m * angle_rad, 1e-9});
  ProfileLimits machine{kMostToolSpeed / way, kMostToolAcceleration / way};
  // Where a joint has the longest way for a part of the path, it bounds the speed.
  JointArray q = joints(q_);
  for (int sample = 1; sample <= kSamples; ++sample) {
    const IkSolution next =
        solve_ik_from(arm_, path.at(sample / static_cast<double>(kSamples)) * X_FT_.inverse(), q);
    if (!next.found) break;  // the motion ends there
    for (std::size_t i = 0; i < q_.size(); ++i) {
      const double rate = std::max(1e-9, kSamples * std::abs(next.q.at(i) - q.at(i)));
      machine.speed = std::min(machine.speed, kSpeedReserve * arm_.joints[i].max_velocity / rate);
      machine.acceleration = std::min(machine.acceleration, kMostJointAcceleration / rate);
    }
    q = next.q;
  }
  path.profile = profile_for({speed / way, acceleration / way}, machine, options.duration_s, cycle_s_);
  path_ = path;
  mode_ = Mode::path;
  return true;
}

bool Motion::move_line(const Pose& X_RT, const MoveOptions& options) {
  if (!inverse_kinematics(X_RT, q_)) return false;
  const Pose start = tool_pose(q_);
  const Vec3 turn = rotation_vector(X_RT.R * start.R.transpose());
  ToolPath path{
      start, turn, X_RT.p, Vec3::Zero(), Vec3::UnitZ(), 0.0, MotionProfile::fastest({1.0, 1.0}, cycle_s_)};
  return start_tool_path(path, (X_RT.p - start.p).norm(), turn.norm(), options);
}

bool Motion::move_arc(const Pose& X_RT_via, const Pose& X_RT, const MoveOptions& options) {
  if (!inverse_kinematics(X_RT, q_) || !inverse_kinematics(X_RT_via, q_)) return false;
  const Pose start = tool_pose(q_);
  const Vec3 a = X_RT_via.p - start.p, b = X_RT.p - start.p, normal = a.cross(b);
  if (normal.norm() < 1e-9) return false;
  // Centre of the circle through the three points.
  const Vec3 center = start.p + (b.squaredNorm() * normal.cross(a) + a.squaredNorm() * b.cross(normal)) /
                                    (2.0 * normal.squaredNorm());
  const Vec3 axis = normal.normalized(), from = start.p - center;
  const auto angle_to = [&](const Vec3& point) {
    const Vec3 r = point - center;
    const double angle = std::atan2(axis.dot(from.cross(r)), from.dot(r));
    return angle < 0.0 ? angle + 2.0 * std::numbers::pi : angle;
  };
  const Vec3 turn = rotation_vector(X_RT.R * start.R.transpose());
  ToolPath path{
      start, turn, X_RT.p, center, axis, angle_to(X_RT.p), MotionProfile::fastest({1.0, 1.0}, cycle_s_)};
  return start_tool_path(path, path.angle * from.norm(), turn.norm(), options);
}

Pose Motion::ToolPath::at(double s) const {
  Pose X;
  const double turned = turn.norm();
  X.R = turned > 0.0 ? Mat3(Eigen::AngleAxisd(s * turned, turn / turned).toRotationMatrix() * start.R)
                     : start.R;
  if (angle == 0.0)
    X.p = start.p + s * (to - start.p);
  else
    X.p = center + Eigen::AngleAxisd(s * angle, axis) * (start.p - center);
  return X;
}

void Motion::run_spline(const Spline& spline) {
  path_ = SplineRun{spline};
  mode_ = Mode::path;
}

void Motion::go_to(const Vector6& q, const Vector6* qd) {
  for (std::size_t i = 0; i < q.size(); ++i) {
    const double velocity = qd != nullptr ? qd->at(i) : (q.at(i) - q_.at(i)) / cycle_s_;
    qdd_.at(i) = (velocity - qd_.at(i)) / cycle_s_;
    qd_.at(i) = velocity;
    q_.at(i) = q.at(i);
  }
}

void Motion::ramp_to(const Vector6& qd, double acceleration) {
  // All joints together, so that the direction of the motion changes evenly.
  Vector6 change;
  for (std::size_t i = 0; i < qd.size(); ++i) change.at(i) = qd.at(i) - qd_.at(i);
  const double most = largest(change),
               part = most > acceleration * cycle_s_ ? acceleration * cycle_s_ / most : 1.0;
  Vector6 next_qd, next_q;
  for (std::size_t i = 0; i < qd.size(); ++i) {
    const JointModel& joint = arm_.joints[i];
    next_qd.at(i) = std::clamp(qd_.at(i) + part * change.at(i), -joint.max_velocity, joint.max_velocity);
    next_q.at(i) = q_.at(i) + 0.5 * cycle_s_ * (qd_.at(i) + next_qd.at(i));
    if (next_q.at(i) < joint.lower || next_q.at(i) > joint.upper) {
      next_q.at(i) = std::clamp(next_q.at(i), joint.lower, joint.upper);
      next_qd.at(i) = 0.0;
    }
  }
  go_to(next_q, &next_qd);
}

bool Motion::advance(double speed_scaling) {
  switch (mode_) {
    case Mode::stop:
      if (at_rest()) {
        qd_ = qdd_ = {};
      } else {
        ramp_to({}, deceleration_);
      }
      return true;
    case Mode::servo: {
      if (!servo_fresh_ && servo_begun_)
        for (std::size_t i = 0; i < q_.size(); ++i) servo_q_.at(i) += qd_.at(i) * cycle_s_;
      servo_fresh_ = false;
      Vector6 next;
      for (std::size_t i = 0; i < q_.size(); ++i) {
        const JointModel& joint = arm_.joints[i];
        const double most = joint.max_velocity * cycle_s_;
        next.at(i) = std::clamp(q_.at(i) + std::clamp(servo_q_.at(i) - q_.at(i), -most, most), joint.lower,
                                joint.upper);
      }
      go_to(next);
      return true;
    }
    case Mode::speed: {
      Vector6 wanted = commanded_speed_;
      for (double& value : wanted) value *= speed_scaling;
      ramp_to(wanted, kSpeedAcceleration);
      return true;
    }
    case Mode::tool_speed: {
      ArmPoses poses;
      forward_kinematics(arm_, q_.data(), poses);
      Twist flange;
      flange.w = Vec3(commanded_speed_[3], commanded_speed_[4], commanded_speed_[5]);
      flange.v = Vec3(commanded_speed_[0], commanded_speed_[1], commanded_speed_[2]);
      flange.v = flange.at(-(poses.X_RF.R * X_FT_.p));
      JointArray qd{};
      if (!joint_velocities(arm_, poses, flange, qd)) {
        stop();
        return false;
      }
      Vector6 wanted;
      for (std::size_t i = 0; i < wanted.size(); ++i) wanted.at(i) = speed_scaling * qd.at(i);
      ramp_to(wanted, kSpeedAcceleration);
      return true;
    }
    case Mode::path:
      return advance_path(speed_scaling);
  }
  return true;
}

bool Motion::advance_path(double speed_scaling) {
  if (auto* line = std::get_if<JointLine>(&path_)) {
    line->t += cycle_s_ * speed_scaling;
    const MotionProfile::Sample at = line->profile.at_time(line->t);
    Vector6 q, qd;
    for (std::size_t i = 0; i < q.size(); ++i) {
      const double way = line->to.at(i) - line->from.at(i);
      q.at(i) = at.s == 1.0 ? line->to.at(i) : line->from.at(i) + at.s * way;
      qd.at(i) = at.speed * way * speed_scaling;
    }
    const bool ended = line->t >= line->profile.duration_s();
    go_to(q, &qd);
    if (ended) stop();
    return true;
  }
  if (auto* tool = std::get_if<ToolPath>(&path_)) return advance_tool_path(*tool, cycle_s_ * speed_scaling);
  if (auto* run = std::get_if<SplineRun>(&path_)) return advance_spline(*run, speed_scaling);
  stop();
  return true;
}

bool Motion::advance_tool_path(ToolPath& path, double dt) {
  path.t += dt;
  const MotionProfile::Sample at = path.profile.at_time(path.t);
  const IkSolution solution = solve_ik_from(arm_, path.at(at.s) * X_FT_.inverse(), joints(q_));
  Vector6 next;
  std::copy_n(solution.q.begin(), next.size(), next.begin());
  bool feasible = solution.found;
  for (std::size_t i = 0; i < next.size(); ++i)
    feasible = feasible && std::abs(next.at(i) - q_.at(i)) <= 1.001 * arm_.joints[i].max_velocity * cycle_s_;
  if (!feasible) {
    stop(kSplineDeceleration);
    return false;
  }
  const bool ended = path.t >= path.profile.duration_s();
  go_to(next);
  if (ended) {
    qd_ = {};
    stop();
  }
  return true;
}

bool Motion::advance_spline(SplineRun& run, double speed_scaling) {
  // The external control program's jointSplineRun().
  const double T = run.spline.duration_s, dt = cycle_s_;
  const auto speeds = [&](double t) {
    Vector6 qd{};
    for (std::size_t i = 0; i < qd.size(); ++i)
      for (std::size_t k = 5; k >= 1; --k)
        qd.at(i) = qd.at(i) * t + static_cast<double>(k) * run.spline.coefficients.at(k).at(i);
    return qd;
  };
  const double left = T - run.traveled_s;
  double step = dt;
  bool ended = false;
  const double deceleration_s = kSplineSpeed / kSplineDeceleration;
  if (left > dt || (run.slowing && left >= 1e-5)) {
    if (run.spline.last && left <= deceleration_s && !run.slowing && left > dt) {
      const double allowed = kSplineSpeed - (deceleration_s - (left - dt)) * kSplineDeceleration;
      run.slowing = largest(speeds(run.traveled_s + dt)) > allowed;
      if (run.slowing) run.slowing_s = left + dt;
    }
    if (run.slowing) {
      run.factor = left / run.slowing_s;
      step = dt * run.factor;
    }
    run.traveled_s = std::min(T, run.traveled_s + step * speed_scaling);
  } else {
    run.traveled_s = T;
    if (run.slowing) run.factor = 0.0;
    ended = true;
  }
  Vector6 q{}, qd = speeds(run.traveled_s);
  for (std::size_t i = 0; i < q.size(); ++i) {
    for (std::size_t k = 6; k-- > 0;)
      q.at(i) = q.at(i) * run.traveled_s + run.spline.coefficients.at(k).at(i);
    qd.at(i) *= run.factor * speed_scaling;
    const JointModel& joint = arm_.joints[i];
    q.at(i) = std::clamp(q.at(i), joint.lower, joint.upper);
    qd.at(i) = std::clamp(qd.at(i), -joint.max_velocity, joint.max_velocity);
  }
  go_to(q, &qd);
  if (ended) {
    mode_ = run.spline.last ? Mode::stop : Mode::speed;  // until the next segment begins, the robot goes on
    deceleration_ = 4.0;
    commanded_speed_ = qd_;
    path_ = std::monostate{};
  }
  return true;
}

}  // namespace takt::ur
