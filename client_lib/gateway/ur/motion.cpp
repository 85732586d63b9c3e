#include "client_lib/gateway/ur/motion.h"

#include <algorithm>
#include <cmath>

namespace takt::ur {
namespace {

// Of the external control program: deceleration at the end of a trajectory.
constexpr double kSplineDeceleration = 15.0, kSplineSpeed = 6.283185;
constexpr double kRest = 1e-6;
/// Joints may need this share of their speed limit.
constexpr double kSpeedTolerance = 1.001;

}  // namespace

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

void Motion::follow(const Vector6& q, const Vector6& qd) {
  stop();
  q_ = q;
  qd_ = qd;
  qdd_ = {};
}

Pose Motion::tool_pose(const Vector6& q) const {
  return ur::tool_pose(arm_, X_FT_, q);
}

Vector6 Motion::tool_speed(const Vector6& q, const Vector6& qd) const {
  ArmPoses poses;
  forward_kinematics(arm_, q.data(), poses);
  const Twist flange = flange_twist(arm_, poses, qd.data());
  const Vec3 v = flange.at(poses.X_RF.R * X_FT_.p);
  return {v.x(), v.y(), v.z(), flange.w.x(), flange.w.y(), flange.w.z()};
}

std::optional<Vector6> Motion::inverse_kinematics(const Pose& X_RT, const Vector6& near) const {
  const IkSolution solution = solve_ik(arm_, X_RT * X_FT_.inverse(), joint_array(near));
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

void Motion::servo_with_lag(const Vector6& q, double lookahead_s) {
  const double part = 1.0 - std::exp(-cycle_s_ / lookahead_s);
  Vector6 next = q_;
  for (std::size_t i = 0; i < next.size(); ++i) next.at(i) += part * (q.at(i) - next.at(i));
  servo(next);
}

void Motion::speed(const Vector6& qd, double acceleration) {
  path_ = std::monostate{};
  mode_ = Mode::speed;
  commanded_speed_ = qd;
  speed_acceleration_ = acceleration;
  has_speed_ = false;
}

void Motion::tool_speed_command(const Vector6& twist, std::optional<double> acceleration) {
  path_ = std::monostate{};
  if (mode_ != Mode::tool_speed) ramped_twist_ = tool_speed(q_, qd_);
  mode_ = Mode::tool_speed;
  commanded_speed_ = twist;
  tool_acceleration_ = acceleration;
  has_speed_ = false;
}

Vector6 Motion::next_twist() {
  if (!tool_acceleration_) return ramped_twist_ = commanded_speed_;
  // Turns are accelerated at the same number, in rad/s^2; both parts reach their speed together.
  Vector6 change;
  for (std::size_t i = 0; i < change.size(); ++i) change.at(i) = commanded_speed_.at(i) - ramped_twist_.at(i);
  const double most = std::max(std::hypot(change[0], change[1], change[2]),
                               std::hypot(change[3], change[4], change[5])),
               step = *tool_acceleration_ * cycle_s_, part = most > step ? step / most : 1.0;
  for (std::size_t i = 0; i < change.size(); ++i) ramped_twist_.at(i) += part * change.at(i);
  return ramped_twist_;
}

bool Motion::begin(const Move& move) {
  std::optional<MovePath> path = MovePath::of(arm_, X_FT_, q_, move);
  if (!path) return false;
  Run run{std::move(*path), MotionProfile::fastest({1.0, 1.0}, cycle_s_)};
  run.profile = run.path.rest_to_rest(cycle_s_);
  if (move.options.blend_radius_m > 0.0)
    run.profile = RampProfile::lasting(move.options.duration_s, {0.0, 0.0}, {1.0, 0.0}, run.path.limits());
  path_ = std::move(run);
  mode_ = Mode::path;
  ++moves_;
  return true;
}

void Motion::move_joints(const Vector6& to, const MoveOptions& options) {
  begin({.kind = Move::Kind::joints, .q = to, .options = options});
}

bool Motion::move_line(const Pose& X_RT, const MoveOptions& options) {
  return begin({.kind = Move::Kind::line, .X_RT = X_RT, .options = options});
}

bool Motion::move_arc(const Pose& X_RT_via, const Pose& X_RT, const MoveOptions& options) {
  return begin({.kind = Move::Kind::arc, .X_RT = X_RT, .X_RT_via = X_RT_via, .options = options});
}

double Motion::Run::duration_s() const {
  return std::visit([](const auto& law) { return law.duration_s(); }, profile);
}

MotionProfile::Sample Motion::Run::at_time() const {
  return std::visit([this](const auto& law) { return law.at_time(t); }, profile);
}

const Vector6& Motion::end() const {
  const auto* run = std::get_if<Run>(&path_);
  return run == nullptr ? q_ : run->path.end();
}

bool Motion::takes_successor() const {
  const auto* run = std::get_if<Run>(&path_);
  return run != nullptr && !run->has_asked && run->path.options().blend_radius_m > 0.0;
}

Motion::BlendOutcome Motion::blend_into(const Move& next) {
  auto* run = std::get_if<Run>(&path_);
  if (run == nullptr) return BlendOutcome::impossible;
  run->has_asked = true;
  Vector6 corner = run->path.end();
  if (!run->path.joints_at(1.0, corner)) return BlendOutcome::impossible;
  std::optional<MovePath> after = MovePath::of(arm_, X_FT_, corner, next);
  if (!after) return BlendOutcome::impossible;
  const double radius = run->path.options().blend_radius_m, next_radius = next.options.blend_radius_m;
  const auto before_part = run->path.part_within(radius, true),
             after_part = after->part_within(radius, false);
  const auto next_part =
      next_radius > 0.0 ? after->part_within(next_radius, true) : std::optional<double>(0.0);
  if (!before_part || !after_part || *before_part >= 1.0 - run->first_s() ||
      *after_part >= 1.0 - next_part.value_or(0.0))
    return BlendOutcome::overlapping;
  Blend blend{run->path, std::move(*after), *before_part, *after_part};
  const double least_s = blend.shortest_duration_s();
  if (least_s == 0.0) return BlendOutcome::impossible;
  // A move with a duration goes through its blends at its mean speed.
  const auto top_speed = [](const MovePath& path) {
    const double duration_s = path.options().duration_s;
    return duration_s > 0.0 ? std::min(1.0 / duration_s, path.limits().speed) : path.limits().speed;
  };
  // The next move must be able to end at rest, or at the speed of a blend of its own.
  const double room = 1.0 - blend.part_after - next_part.value_or(0.0);
  const double speed_after = std::min(
      top_speed(blend.after), RampProfile::reachable_speed(0.0, room, blend.after.limits().acceleration));
  blend.duration_s = std::max(
      {least_s, 2.0 * blend.part_after / speed_after, 2.0 * blend.part_before / top_speed(run->path)});
  if (!lead(*run, blend)) return BlendOutcome::impossible;
  run->out = std::move(blend);
  return BlendOutcome::blended;
}

bool Motion::lead(Run& run, Blend& blend) {
  auto& law = std::get<RampProfile>(run.profile);
  const ProfileLimits& limits = run.path.limits();
  const double s = 1.0 - blend.part_before;
  if (run.t > 0.0) {
    blend.duration_s = std::max(blend.duration_s, 2.0 * blend.part_before / law.top_speed());
    return law.end_at({s, blend.speed_before()}, run.t);
  }
  const RampProfile::End from = law.from();
  blend.duration_s = std::max(
      blend.duration_s,
      2.0 * blend.part_before / RampProfile::reachable_speed(from.speed, s - from.s, limits.acceleration));
  const RampProfile::End to{s, blend.speed_before()};
  // A duration is that between the middles of the blends.
  const double duration_s =
      run.path.options().duration_s - 0.5 * blend.duration_s - (run.in ? 0.5 * run.in->duration_s : 0.0);
  law = RampProfile::lasting(duration_s, from, to, limits);
  return true;
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
      ramp_to(wanted, speed_acceleration_);
      has_speed_ = largest(qdd_) < kRest;
      return true;
    }
    case Mode::tool_speed: {
      const Vector6 twist = next_twist();
      ArmPoses poses;
      forward_kinematics(arm_, q_.data(), poses);
      Twist flange;
      flange.w = Vec3(twist[3], twist[4], twist[5]);
      flange.v = Vec3(twist[0], twist[1], twist[2]);
      flange.v = flange.at(-(poses.X_RF.R * X_FT_.p));
      JointArray qd{};
      bool feasible = joint_velocities(arm_, poses, flange, qd);
      for (std::size_t i = 0; i < q_.size(); ++i)
        feasible =
            feasible && std::abs(speed_scaling * qd.at(i)) <= kSpeedTolerance * arm_.joints[i].max_velocity;
      if (!feasible) {
        stop(kSplineDeceleration);
        return false;
      }
      Vector6 wanted;
      for (std::size_t i = 0; i < wanted.size(); ++i) wanted.at(i) = speed_scaling * qd.at(i);
      ramp_to(wanted, kSpeedAcceleration);
      has_speed_ = true;
      for (std::size_t i = 0; i < twist.size(); ++i)
        has_speed_ = has_speed_ && std::abs(twist.at(i) - commanded_speed_.at(i)) < kRest;
      return true;
    }
    case Mode::path:
      return advance_path(speed_scaling);
  }
  return true;
}

bool Motion::advance_path(double speed_scaling) {
  if (auto* run = std::get_if<Run>(&path_)) return advance_run(*run, speed_scaling);
  if (auto* run = std::get_if<SplineRun>(&path_)) return advance_spline(*run, speed_scaling);
  stop();
  return true;
}

bool Motion::advance_run(Run& run, double speed_scaling) {
  run.t += cycle_s_ * speed_scaling;
  if (run.out && run.t >= run.duration_s()) {
    // Into the blend.
    Blend blend = std::move(*run.out);
    const RampProfile::End from{blend.part_after, blend.speed_after()}, to{1.0, 0.0};
    RampProfile law = RampProfile::lasting(blend.after.options().duration_s - 0.5 * blend.duration_s, from,
                                           to, blend.after.limits());
    const double t = run.t - run.duration_s() - blend.duration_s;
    MovePath after = blend.after;
    run = Run{std::move(after), law, t, std::move(blend)};
    ++moves_;
  }
  const bool blends = run.t < 0.0, ended = !run.out && run.t >= run.duration_s();
  const MotionProfile::Sample at = run.at_time();
  Vector6 next = q_;
  bool feasible =
      blends ? run.in->joints_at(1.0 + run.t / run.in->duration_s, next) : run.path.joints_at(at.s, next);
  if (run.path.in_joint_space() && !blends) {
    Vector6 qd = run.path.way();
    for (double& speed : qd) speed *= at.speed * speed_scaling;
    go_to(next, &qd);
  } else {
    for (std::size_t i = 0; i < next.size(); ++i)
      feasible = feasible &&
                 std::abs(next.at(i) - q_.at(i)) <= kSpeedTolerance * arm_.joints[i].max_velocity * cycle_s_;
    if (!feasible) {
      stop(kSplineDeceleration);
      return false;
    }
    go_to(next);
    if (ended) qd_ = {};
  }
  if (ended) stop();
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
