#include "client_lib/gateway/ur/path.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "client_lib/gateway/ur/ramp_profile.h"

namespace takt::ur {
namespace {

// Defaults of URScript's movej and movel.
constexpr double kJointAcceleration = 1.4, kJointSpeed = 1.05;
constexpr double kToolAcceleration = 1.2, kToolSpeed = 0.25;
/// What a robot's own joints can do where a duration asks for more.
constexpr double kMostJointAcceleration = 15.0;
constexpr double kMostToolSpeed = 3.0, kMostToolAcceleration = 15.0;
constexpr double kSlowestTurn_rad_per_s = 1.05;  ///< of the tool's orientation, per m/s of the default speed
/// The orientation turns within the same limits, as the rim of a tool of some 0.25 m would move.
constexpr double kRim_m = kToolSpeed / kSlowestTurn_rad_per_s;
constexpr int kSamples = 40;           ///< of a path, for its speed
constexpr double kSpeedReserve = 0.9;  ///< between two samples a joint may be faster
constexpr double kShortest = 1e-9;

/// The acceleration of the fastest profile within `machine`, slowed down evenly to `duration_s`.
double acceleration_of(const ProfileLimits& machine, double duration_s) {
  const double top = std::min(machine.speed, std::sqrt(machine.acceleration / kRampPeak));
  const double ramp_s = kRampPeak * top / machine.acceleration, shortest_s = 1.0 / top + ramp_s;
  const double slower = std::max(1.0, duration_s / shortest_s);
  return machine.acceleration / (slower * slower);
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

JointArray joint_array(const Vector6& q) {
  JointArray values{};
  std::copy(q.begin(), q.end(), values.begin());
  return values;
}

double largest(const Vector6& values) {
  double most = 0.0;
  for (const double value : values) most = std::max(most, std::abs(value));
  return most;
}

Pose tool_pose(const ArmModel& arm, const Pose& X_FT, const Vector6& q) {
  ArmPoses poses;
  forward_kinematics(arm, q.data(), poses);
  return poses.X_RF * X_FT;
}

std::optional<MovePath> MovePath::of(const ArmModel& arm, const Pose& X_FT, const Vector6& from,
                                     const Move& move) {
  MovePath path;
  path.arm_ = &arm;
  path.X_FT_ = X_FT;
  path.kind_ = move.kind;
  path.from_ = from;
  path.options_ = move.options;
  if (move.kind == Move::Kind::joints) {
    path.to_ = move.q;
    path.limit_joints();
    return path;
  }
  const auto reachable = [&](const Pose& X_RT) {
    return solve_ik(arm, X_RT * X_FT.inverse(), joint_array(from)).found;
  };
  if (!reachable(move.X_RT)) return std::nullopt;
  path.start_ = path.tool_pose(from);
  path.turn_ = rotation_vector(move.X_RT.R * path.start_.R.transpose());
  path.end_p_ = move.X_RT.p;
  double length = (move.X_RT.p - path.start_.p).norm();
  if (move.kind == Move::Kind::arc) {
    if (!reachable(move.X_RT_via)) return std::nullopt;
    const Vec3 a = move.X_RT_via.p - path.start_.p, b = move.X_RT.p - path.start_.p, normal = a.cross(b);
    if (normal.norm() < 1e-9) return std::nullopt;
    // Centre of the circle through the three points.
    path.center_ = path.start_.p + (b.squaredNorm() * normal.cross(a) + a.squaredNorm() * b.cross(normal)) /
                                       (2.0 * normal.squaredNorm());
    path.axis_ = normal.normalized();
    const Vec3 first = path.start_.p - path.center_, r = move.X_RT.p - path.center_;
    path.angle_ = std::atan2(path.axis_.dot(first.cross(r)), first.dot(r));
    if (path.angle_ < 0.0) path.angle_ += 2.0 * std::numbers::pi;
    length = path.angle_ * first.norm();
  }
  path.limit_tool(length);
  return path;
}

Vector6 MovePath::way() const {
  Vector6 way;
  for (std::size_t i = 0; i < way.size(); ++i) way.at(i) = to_.at(i) - from_.at(i);
  return way;
}

void MovePath::limit(double speed, double acceleration) {
  if (options_.duration_s > 0.0)
    limits_ = {machine_.speed, acceleration_of(machine_, options_.duration_s)};
  else
    limits_ = {std::min((options_.speed > 0.0 ? options_.speed : speed) / length_, machine_.speed),
               std::min((options_.acceleration > 0.0 ? options_.acceleration : acceleration) / length_,
                        machine_.acceleration)};
}

void MovePath::limit_joints() {
  machine_ = {1e9, 1e9};
  const Vector6 change = way();
  for (std::size_t i = 0; i < change.size(); ++i) {
    const double part = std::abs(change.at(i));
    if (part == 0.0) continue;
    machine_.speed = std::min(machine_.speed, arm_->joints[i].max_velocity / part);
    machine_.acceleration = std::min(machine_.acceleration, kMostJointAcceleration / part);
  }
  length_ = std::max(largest(change), kShortest);
  limit(kJointSpeed, kJointAcceleration);
}

void MovePath::limit_tool(double length_m) {
  length_ = std::max({length_m, kRim_m * turn_.norm(), kShortest});
  machine_ = {kMostToolSpeed / length_, kMostToolAcceleration / length_};
  // Where a joint has the longest way for a part of the path, it bounds the speed.
  Vector6 q = from_;
  for (int sample = 1; sample <= kSamples; ++sample) {
    Vector6 next = q;
    if (!joints_at(sample / static_cast<double>(kSamples), next)) break;  // the motion ends there
    for (std::size_t i = 0; i < q.size(); ++i) {
      const double rate = std::max(1e-9, kSamples * std::abs(next.at(i) - q.at(i)));
      machine_.speed = std::min(machine_.speed, kSpeedReserve * arm_->joints[i].max_velocity / rate);
      machine_.acceleration = std::min(machine_.acceleration, kMostJointAcceleration / rate);
    }
    q = next;
  }
  to_ = q;
  limit(kToolSpeed, kToolAcceleration);
}

MotionProfile MovePath::rest_to_rest(double cycle_s) const {
  if (options_.duration_s > 0.0) {
    if (const auto lasting = MotionProfile::lasting(options_.duration_s, machine_, cycle_s)) return *lasting;
    return MotionProfile::fastest(machine_, cycle_s);
  }
  return MotionProfile::fastest(limits_, cycle_s);
}

Pose MovePath::line_at(double s) const {
  Pose X;
  const double turned = turn_.norm();
  X.R = turned > 0.0 ? Mat3(Eigen::AngleAxisd(s * turned, turn_ / turned).toRotationMatrix() * start_.R)
                     : start_.R;
  if (kind_ == Move::Kind::line)
    X.p = start_.p + s * (end_p_ - start_.p);
  else
    X.p = center_ + Eigen::AngleAxisd(s * angle_, axis_) * (start_.p - center_);
  return X;
}

Pose MovePath::tool_at(double s) const {
  if (!in_joint_space()) return line_at(s);
  Vector6 q;
  joints_at(s, q);
  return tool_pose(q);
}

bool MovePath::joints_for(const Pose& X_RT, Vector6& q) const {
  const IkSolution solution = solve_ik_from(*arm_, X_RT * X_FT_.inverse(), joint_array(q));
  std::copy_n(solution.q.begin(), q.size(), q.begin());
  return solution.found;
}

bool MovePath::joints_at(double s, Vector6& q) const {
  if (!in_joint_space()) return joints_for(line_at(s), q);
  for (std::size_t i = 0; i < q.size(); ++i)
    q.at(i) = s == 1.0 ? to_.at(i) : from_.at(i) + s * (to_.at(i) - from_.at(i));
  return true;
}

std::optional<double> MovePath::part_within(double radius_m, bool at_end) const {
  const Vec3 point = tool_at(at_end ? 1.0 : 0.0).p;
  const auto distance = [&](double part) { return (tool_at(at_end ? 1.0 - part : part).p - point).norm(); };
  // The first sample outside, then the place between it and the one before.
  for (int sample = 1; sample <= kSamples; ++sample) {
    double outside = sample / static_cast<double>(kSamples);
    if (distance(outside) <= radius_m) continue;
    double inside = (sample - 1) / static_cast<double>(kSamples);
    for (int i = 0; i < 40; ++i) {
      const double middle = 0.5 * (inside + outside);
      (distance(middle) <= radius_m ? inside : outside) = middle;
    }
    return inside;
  }
  return std::nullopt;
}

bool Blend::joints_at(double u, Vector6& q) const {
  const auto ramp = [](double part) { return part * part * part * (2.0 - part); };
  const double s = 1.0 - part_before * ramp(1.0 - u), t = part_after * ramp(u);
  if (before.in_joint_space() || after.in_joint_space()) {
    Vector6 first = q, second = q;
    if (!before.joints_at(s, first) || !after.joints_at(t, second)) return false;
    for (std::size_t i = 0; i < q.size(); ++i) q.at(i) = first.at(i) + second.at(i) - after.start().at(i);
    return true;
  }
  const Pose X_RP = after.tool_at(0.0), first = before.tool_at(s), second = after.tool_at(t);
  return after.joints_for({second.R * X_RP.R.transpose() * first.R, first.p + second.p - X_RP.p}, q);
}

double Blend::shortest_duration_s() const {
  const ArmModel& arm = before.arm();
  const bool tool_moves = !before.in_joint_space() || !after.in_joint_space();
  double joint_acceleration = kSpeedReserve * kMostJointAcceleration, tool_acceleration = 1e9;
  for (const MovePath* path : {&before, &after}) {
    double& most = path->in_joint_space() ? joint_acceleration : tool_acceleration;
    most = std::min(most, path->acceleration());
  }
  // Rates per duration of 1 s: speeds fall with the duration, accelerations with its square.
  double shortest = 0.0;
  Vector6 q, rate{};
  if (!before.joints_at(1.0 - part_before, q = before.end())) return 0.0;
  Pose X = before.tool_at(1.0 - part_before);
  Vec3 v, w;
  for (int sample = 1; sample <= kSamples; ++sample) {
    Vector6 next = q;
    if (!joints_at(sample / static_cast<double>(kSamples), next)) return 0.0;
    for (std::size_t i = 0; i < q.size(); ++i) {
      const double speed = kSamples * (next.at(i) - q.at(i));
      shortest = std::max(shortest, std::abs(speed) / (kSpeedReserve * arm.joints[i].max_velocity));
      if (sample > 1)
        shortest =
            std::max(shortest, std::sqrt(kSamples * std::abs(speed - rate.at(i)) / joint_acceleration));
      rate.at(i) = speed;
    }
    if (tool_moves) {
      const Pose X_next = before.tool_pose(next);
      const Vec3 v_next = kSamples * (X_next.p - X.p),
                 w_next = kSamples * rotation_vector(X_next.R * X.R.transpose());
      if (sample > 1)
        shortest = std::max({shortest, std::sqrt(kSamples * (v_next - v).norm() / tool_acceleration),
                             std::sqrt(kSamples * kRim_m * (w_next - w).norm() / tool_acceleration)});
      v = v_next;
      w = w_next;
      X = X_next;
    }
    q = next;
  }
  return shortest;
}

}  // namespace takt::ur
