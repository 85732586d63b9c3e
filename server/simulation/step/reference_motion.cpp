#include "server/simulation/step/reference_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "plant_models/state_bytes.h"
#include "server/simulation/model/cell_description.h"

namespace takt {

namespace {

constexpr double kRounding_s = 1e-9;

/// Position, velocity and torques of the path at time t after its start. The way to its first point begins at
/// `begin`. At a point the velocity is that of the next piece.
JointPathPoint evaluate(const JointPath& path, const JointPathPoint& begin, std::size_t next, double t,
                        std::size_t n) {
  const JointPathPoint& last = path.points.back();
  JointPathPoint at;
  at.t = t;
  if (t >= last.t - kRounding_s) {
    at.q = last.q;
    at.feed_forward = last.feed_forward;
    return at;
  }
  const JointPathPoint& from = next == 0 ? begin : path.points[next - 1];
  const JointPathPoint& to = path.points[next];
  const double u = std::clamp((t - from.t) / (to.t - from.t), 0.0, 1.0);
  for (std::size_t j = 0; j < n; ++j) {
    const PathPiece piece = path_piece(path.order, from, to, j);
    at.q[j] = piece.position(u);
    at.qd[j] = piece.velocity(u);
    at.feed_forward[j] = (1.0 - u) * from.feed_forward[j] + u * to.feed_forward[j];
  }
  return at;
}

/// First point later than t.
std::size_t point_after(const JointPath& path, std::size_t from, double t) {
  while (from < path.points.size() && path.points[from].t <= t + kRounding_s) ++from;
  return from;
}

}  // namespace

ReferenceMotion::ReferenceMotion(const CellDescription& cell, std::size_t robot, KinematicRobot& kinematics,
                                 std::vector<MotionNotice>& notices)
    : description_(cell.robots[robot]),
      step_s_(cell.step_s),
      robot_(robot),
      kinematics_(kinematics),
      notices_(notices) {}

void ReferenceMotion::reset() {
  state_ = {};
}

void ReferenceMotion::note(MotionNotice notice, double t, std::uint64_t step) {
  notice.time_s = t;
  notice.step = step;
  notice.robot = static_cast<int>(robot_);
  notices_.push_back(notice);
}

double ReferenceMotion::trajectory_end_s() const {
  const Following& last = state_.later.path ? state_.later : state_.now;
  return last.path ? last.start_s + last.path->points.back().t : -1.0;
}

void ReferenceMotion::drop(double t, std::uint64_t step) {
  if (state_.now.path) note({.kind = MotionNotice::Kind::trajectory_replaced}, t, step);
  state_.now = {};
  state_.brakes = false;
}

void ReferenceMotion::begin_stream(const JointCommand& command, double t, std::uint64_t step) {
  drop(t, step);
  state_.later = {};
  state_.streams = true;
  state_.newest_s = t;
  state_.period_s = command.period_s > 0.0 ? command.period_s : description_.command_period_s;
}

void ReferenceMotion::apply_torques(const JointCommand& command, double t, std::uint64_t step,
                                    const double* q, const double* qd) {
  if (state_.at_a_limit && state_.brakes) return;
  begin_stream(command, t, step);
  state_.at_a_limit = false;
  state_.torques = command.effort;
  follow(t, q, qd);
}

void ReferenceMotion::follow(double t, const double* q, const double* qd) {
  kinematics_.follow(t, step_s_, q, qd);
}

void ReferenceMotion::add_torques(const JointArray& weight) {
  JointArray torques = weight;
  for (std::size_t j = 0; j < description_.arm.joints.size(); ++j) torques[j] += state_.torques[j];
  kinematics_.set_feed_forward(torques.data());
}

bool ReferenceMotion::torques_leave_limits(double t, std::uint64_t step) {
  JointArray q{}, v{};
  kinematics_.joint_state(t, q.data(), v.data());
  for (std::size_t j = 0; j < description_.arm.joints.size(); ++j) {
    const JointModel& joint = description_.arm.joints[j];
    const bool too_fast = std::abs(v[j]) > joint.max_velocity;
    JointArray next = q, alone{};
    next[j] += step_s_ * v[j];
    alone[j] = v[j];
    if (!too_fast && !(room_time(next, alone) < braking_time(alone))) continue;
    MotionNotice notice{.kind = MotionNotice::Kind::torques_ended};
    notice.joint = static_cast<int>(j);
    notice.velocity = too_fast;
    notice.value = too_fast ? v[j] : q[j];
    notice.lower = too_fast ? -joint.max_velocity : joint.lower;
    notice.upper = too_fast ? joint.max_velocity : joint.upper;
    note(notice, t, step);
    return true;
  }
  return false;
}

void ReferenceMotion::apply(const JointCommand& command, double t, std::uint64_t step) {
  begin_stream(command, t, step);
  kinematics_.set_point(t, state_.period_s, command.position.data(),
                        command.has_velocity ? command.velocity.data() : nullptr);
  kinematics_.set_feed_forward(command.has_effort ? command.effort.data() : nullptr);
}

void ReferenceMotion::apply(const TrajectoryCommand& command, double t, std::uint64_t step) {
  State& r = state_;
  if (command.path->points.empty()) {
    drop(t, step);
    r.later = {};
    r.streams = false;
    brake_from(t);
    return;
  }
  Following following;
  following.path = command.path;
  // Compares with rounding: the nearest nanosecond may differ from the intended instant.
  const bool at_once = !command.stamp.given() || command.stamp == SimTime::from_seconds(t);
  following.start_s = at_once ? t : command.stamp.seconds();
  const double end = following.start_s + command.path->points.back().t;
  if (end < t - kRounding_s) {
    note({.kind = MotionNotice::Kind::trajectory_past, .value = end}, t, step);
    return;
  }
  if (following.start_s > t + kRounding_s) {
    r.later = std::move(following);  // the present motion continues until its start
    r.streams = false;
    return;
  }
  if (!take_over(following, t, step)) return;
  drop(t, step);
  r.later = {};
  r.now = std::move(following);
  r.streams = false;
}

bool ReferenceMotion::take_over(Following& following, double t, std::uint64_t step) {
  const JointPath& path = *following.path;
  JointPathPoint& begin = following.begin;
  begin.t = t - following.start_s;
  kinematics_.joint_state(t, begin.q.data(), begin.qd.data());
  if (path.order == PathOrder::quintic) kinematics_.joint_acceleration(t, begin.qdd.data());
  if (path.has_feed_forward) begin.feed_forward = kinematics_.feed_forward();
  following.next = point_after(path, 0, begin.t);
  const ArmModel& arm = description_.arm;
  MotionNotice refusal{.kind = MotionNotice::Kind::trajectory_refused};
  const auto refuse = [&](std::size_t joint, double value, double lower, double upper, bool velocity) {
    refusal.joint = static_cast<int>(joint);
    refusal.value = value;
    refusal.lower = lower;
    refusal.upper = upper;
    refusal.velocity = velocity;
    note(refusal, t, step);
    return false;
  };
  if (following.next > 0) {
    // The path has begun already: the robot must be where it leads along, as far as one step can take it.
    const JointArray q = evaluate(path, begin, following.next, begin.t, arm.joints.size()).q;
    for (std::size_t j = 0; j < arm.joints.size(); ++j) {
      const double room = arm.joints[j].max_velocity * step_s_ + kRounding_s;
      if (std::abs(begin.q[j] - q[j]) > room) return refuse(j, begin.q[j], q[j] - room, q[j] + room, false);
    }
    return true;
  }
  for (std::size_t j = 0; j < arm.joints.size(); ++j) {
    const JointModel& joint = arm.joints[j];
    const PathPiece piece = path_piece(path.order, begin, path.points.front(), j);
    const double room = 1e-9 * (1.0 + joint.upper - joint.lower);
    const double position = value_outside(piece, joint.lower - room, joint.upper + room);
    if (!std::isnan(position)) return refuse(j, position, joint.lower, joint.upper, false);
    const double limit = joint.max_velocity;
    const double velocity = value_outside(piece.derivative(), -limit * (1.0 + 1e-9), limit * (1.0 + 1e-9));
    if (!std::isnan(velocity)) return refuse(j, velocity, -limit, limit, true);
  }
  return true;
}

void ReferenceMotion::stop(double t, std::uint64_t step) {
  State& r = state_;
  const bool commanded = r.now.path || r.later.path || r.streams || kinematics_.torque_mode();
  if (r.brakes && !commanded) return;
  JointArray q{}, v{};
  kinematics_.joint_state(t, q.data(), v.data());
  const bool moves = std::any_of(v.begin(), v.end(), [](double value) { return value != 0.0; });
  if (!moves && !commanded) return;
  if (r.now.path || r.later.path) note({.kind = MotionNotice::Kind::motion_refused}, t, step);
  drop(t, step);
  r.later = {};
  r.streams = false;
  brake_from(t);
  // A set-point of this step must not move a robot at rest.
  if (!r.brakes) kinematics_.set_point(t, step_s_, r.q.data(), JointArray{}.data());
}

void ReferenceMotion::advance(double t, std::uint64_t step, bool watch, double override) {
  State& r = state_;
  if (r.later.path && r.later.start_s <= t + kRounding_s) {
    if (take_over(r.later, t, step)) {
      drop(t, step);
      std::swap(r.now, r.later);
    }
    r.later = {};
  }
  if (r.now.path) {
    move_along(t, step, override);
    return;
  }
  const CommandDeadline& limit = description_.command_deadline;
  if (watch && r.streams && limit.deadline_s > 0.0) {
    const double silence_s = t - r.newest_s;
    const bool stops = limit.action == SafeAction::stop;
    bool ends = silence_s >= limit.deadline_s - kRounding_s;
    if (stops && !ends && !kinematics_.torque_mode() && silence_s >= r.period_s - kRounding_s)
      ends = !goes_on(t);
    if (ends) {
      note({.kind = MotionNotice::Kind::deadline_missed, .value = silence_s}, t, step);
      r.streams = false;
      kinematics_.set_feed_forward(nullptr);
      if (stops || kinematics_.torque_mode()) brake_from(t);
    }
  }
  if (kinematics_.torque_mode() && !r.brakes && torques_leave_limits(t, step)) {
    r.streams = false;
    r.at_a_limit = true;
    brake_from(t);
  }
  if (r.brakes) continue_braking(t);
}

void ReferenceMotion::move_along(double t, std::uint64_t step, double override) {
  State& r = state_;
  const double h = step_s_;
  if (override != 1.0) r.now.start_s += (1.0 - override) * h;
  const double then = t + h - r.now.start_s;
  r.now.next = point_after(*r.now.path, r.now.next, then);
  JointPathPoint at = evaluate(*r.now.path, r.now.begin, r.now.next, then, description_.arm.joints.size());
  if (override != 1.0)
    for (double& velocity : at.qd) velocity *= override;
  kinematics_.set_point(t, h, at.q.data(), at.qd.data());
  kinematics_.set_feed_forward(at.feed_forward.data());
  if (then < r.now.path->points.back().t - kRounding_s) return;
  note({.kind = MotionNotice::Kind::trajectory_done}, t + h, step + 1);
  r.now = {};
}

bool ReferenceMotion::goes_on(double t) {
  const std::size_t n = description_.arm.joints.size();
  const double h = step_s_;
  JointArray q{}, v{};
  kinematics_.joint_state(t, q.data(), v.data());
  const bool moves = std::any_of(v.begin(), v.end(), [](double value) { return value != 0.0; });
  if (!moves) return true;
  for (std::size_t j = 0; j < n; ++j) q[j] += h * v[j];
  if (room_time(q, v) < braking_time(v)) return false;  // the next step would be too late
  kinematics_.set_point(t, h, q.data(), v.data());
  return true;
}

double ReferenceMotion::braking_time(const JointArray& v) const {
  double longest = 0.0;
  for (std::size_t j = 0; j < description_.arm.joints.size(); ++j) {
    const double a = description_.command_deadline.max_acceleration[j];
    // Default: from the largest velocity to zero in 0.1 s.
    const double most = a > 0.0 ? a : 10.0 * description_.arm.joints[j].max_velocity;
    longest = std::max(longest, std::abs(v[j]) / most);
  }
  return longest;
}

double ReferenceMotion::room_time(const JointArray& q, const JointArray& v) const {
  const ArmModel& arm = description_.arm;
  double shortest = std::numeric_limits<double>::infinity();
  for (std::size_t j = 0; j < arm.joints.size(); ++j) {
    if (v[j] == 0.0) continue;
    const double room = v[j] > 0.0 ? arm.joints[j].upper - q[j] : q[j] - arm.joints[j].lower;
    shortest = std::min(shortest, 2.0 * std::max(room, 0.0) / std::abs(v[j]));
  }
  return shortest;
}

void ReferenceMotion::brake_from(double t) {
  State& r = state_;
  kinematics_.set_feed_forward(nullptr);
  kinematics_.joint_state(t, r.q.data(), r.v.data());
  // All joints stop together, so that the robot stays on its path; harder where a limit is too near.
  r.brake_begin_s = t;
  r.brake_duration_s = std::min(braking_time(r.v), room_time(r.q, r.v));
  r.brakes = r.brake_duration_s > 0.0;
  // The set-points of braking end torque mode; at rest this one does.
  if (!r.brakes && kinematics_.torque_mode())
    kinematics_.set_point(t, step_s_, r.q.data(), JointArray{}.data());
}

void ReferenceMotion::continue_braking(double t) {
  State& r = state_;
  const double h = step_s_;
  const double T = r.brake_duration_s;
  const double s = std::min(t + h - r.brake_begin_s, T);
  JointArray q{}, v{};
  for (std::size_t j = 0; j < description_.arm.joints.size(); ++j) {
    q[j] = r.q[j] + r.v[j] * (s - 0.5 * s * s / T);
    v[j] = r.v[j] * (1.0 - s / T);
  }
  kinematics_.set_point(t, h, q.data(), v.data());
  if (s >= T) r.brakes = false;
}

void ReferenceMotion::save(StateWriter& out) const {
  const auto put = [&](const Following& following) {
    out.put(following.path != nullptr);
    if (!following.path) return;
    const auto put_point = [&](const JointPathPoint& point) {
      out.put(point.t);
      for (const JointArray* values : {&point.q, &point.qd, &point.qdd, &point.feed_forward})
        out.put(std::span<const double>(*values));
    };
    out.put(following.path->order), out.put(following.path->has_feed_forward);
    out.put(following.start_s);
    put_point(following.begin);
    out.put_size(following.next), out.put_size(following.path->points.size());
    for (const JointPathPoint& point : following.path->points) put_point(point);
  };
  const State& r = state_;
  put(r.now), put(r.later);
  out.put(r.streams), out.put(r.newest_s), out.put(r.period_s);
  out.put(std::span<const double>(r.torques)), out.put(r.at_a_limit);
  out.put(r.brakes), out.put(r.brake_begin_s), out.put(r.brake_duration_s);
  out.put(std::span<const double>(r.q)), out.put(std::span<const double>(r.v));
}

void ReferenceMotion::load(StateReader& in) {
  const auto get = [&](Following& following) {
    if (!in.flag("'follows a trajectory'")) return;
    const auto get_point = [&](JointPathPoint& point) {
      point.t = in.number(-kLongestTime_s, kLongestTime_s, "the time of a trajectory's point");
      for (JointArray* values : {&point.q, &point.qd, &point.qdd, &point.feed_forward})
        in.numbers(*values, "a trajectory's point");
    };
    auto path = std::make_shared<JointPath>();
    const int order = in.integer(1, 5, "the order of a trajectory");
    if (order % 2 == 0) in.fail("the order of a trajectory is " + std::to_string(order));
    path->order = static_cast<PathOrder>(order);
    path->has_feed_forward = in.flag("'a trajectory has torques'");
    following.start_s = in.number(-kLongestTime_s, kLongestTime_s, "the start of a trajectory");
    get_point(following.begin);
    const std::size_t next = in.size(kMaxTrajectoryPoints, "points passed");
    path->points.resize(in.size(kMaxTrajectoryPoints, "points of a trajectory"));
    if (path->points.empty() || next > path->points.size()) in.fail("a trajectory has too few points");
    following.next = next;
    double before = -1.0;
    for (JointPathPoint& point : path->points) {
      get_point(point);
      if (!(point.t > before)) in.fail("the times of a trajectory do not ascend");
      before = point.t;
    }
    if (next == 0 && !(path->points.front().t > following.begin.t))
      in.fail("a trajectory begins after its first point");
    following.path = std::move(path);
  };
  State& r = state_ = {};
  get(r.now), get(r.later);
  r.streams = in.flag("'gets set-points'");
  r.newest_s = in.number("the time of a set-point");
  r.period_s = in.number("the period of a set-point");
  in.numbers(r.torques, "a torque");
  r.at_a_limit = in.flag("'brakes at a limit'");
  r.brakes = in.flag("'brakes'");
  r.brake_begin_s = in.number("the time of braking");
  r.brake_duration_s = in.number(r.brakes ? 1e-12 : 0.0, kLongestTime_s, "the duration of braking");
  in.numbers(r.q, "a position"), in.numbers(r.v, "a velocity");
}

}  // namespace takt
