#include "server/runtime/loop/goal_monitor.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "server/simulation/model/cell_description.h"

namespace takt {
namespace {

constexpr double kRounding_s = 1e-9;
constexpr std::size_t kMaxLate = 4096;

struct Excess {
  int joint = -1;
  bool of_velocity = false;
  double value = 0.0, limit = 0.0;
};

/// The first joint beyond its tolerance.
std::optional<Excess> find_excess(const GoalReport& report, const JointTolerances& tolerances,
                                  std::size_t joints) {
  for (std::size_t j = 0; j < joints; ++j) {
    const double q = std::abs(report.desired_position[j] - report.position[j]);
    if (tolerances.position[j] > 0.0 && !(q <= tolerances.position[j]))
      return Excess{static_cast<int>(j), false, q, tolerances.position[j]};
    const double v = std::abs(report.desired_velocity[j] - report.velocity[j]);
    if (tolerances.velocity[j] > 0.0 && !(v <= tolerances.velocity[j]))
      return Excess{static_cast<int>(j), true, v, tolerances.velocity[j]};
  }
  return std::nullopt;
}

void note(GoalReport& report, const Excess& excess) {
  report.joint = excess.joint;
  report.of_velocity = excess.of_velocity;
  report.value = excess.value;
  report.limit = excess.limit;
}

}  // namespace

GoalMonitor::GoalMonitor(const Simulation& simulation, SpscRing<GoalReport>& reports)
    : simulation_(simulation),
      cell_(simulation.description()),
      reports_(reports),
      slots_(cell_.robots.size() + cell_.grippers.size()),
      machines_(simulation.make_snapshot()) {
  late_.reserve(kMaxLate);
}

bool GoalMonitor::active() const {
  return std::any_of(slots_.begin(), slots_.end(), [](const Slot& slot) { return slot.goal != nullptr; });
}

void GoalMonitor::apply(std::span<const Command> batch, std::span<const GoalPtr> goals) {
  bool read = false;
  const double t = simulation_.time_s();
  for (std::size_t i = 0; i < batch.size(); ++i) {
    const auto target = static_cast<std::size_t>(target_of(cell_, batch[i]));
    if (target >= slots_.size()) continue;
    Slot& slot = slots_[target];
    const GoalPtr& goal = goals[i];
    if (!slot.goal && !goal) continue;
    if (!std::exchange(read, true)) simulation_.read_machines(machines_);
    if (slot.goal) end(slot, report_of(slot, t), goal ? GoalEnd::preempted : GoalEnd::replaced);
    if (goal) start(slot, goal, t);
  }
}

void GoalMonitor::start(Slot& slot, const GoalPtr& goal, double t) {
  slot = {};
  slot.goal = goal;
  const bool at_once = !goal->stamp.given() || goal->stamp == SimTime::from_seconds(t);
  slot.start_s = at_once ? t : goal->stamp.seconds();
  slot.feedback_s = t;
  if (slot.start_s <= t + kRounding_s) begin(slot, t);
}

void GoalMonitor::begin(Slot& slot, double t) {
  slot.begun = true;
  slot.feedback_s = t;
  GoalReport report = report_of(slot, t);
  slot.begin.t = t - slot.start_s;
  slot.begin.q = report.position;
  slot.begin.qd = report.velocity;
  report.begins = true;
  fill_desired(slot, slot.begin.t, report);
  push(report);
  slot.feedback_s = t + kFeedback_s;
}

GoalReport GoalMonitor::report_of(const Slot& slot, double t) const {
  GoalReport report;
  report.number = slot.goal->number;
  report.time_s = t;
  const auto target = static_cast<std::size_t>(slot.goal->target);
  if (target < cell_.robots.size()) {
    report.path_time_s = t - slot.start_s;
    report.position = machines_.robots[target].position;
    report.velocity = machines_.robots[target].velocity;
  } else {
    const GripperSample& sample = machines_.grippers[target - cell_.robots.size()];
    report.width_m = sample.width_m;
    report.force_N = sample.force_N;
    report.part = sample.part;
  }
  return report;
}

/// The path as ReferenceMotion follows it; the way to its first point begins where the robot was.
void GoalMonitor::fill_desired(const Slot& slot, double path_time_s, GoalReport& report) const {
  if (!slot.goal->path) return;
  const JointPath& path = *slot.goal->path;
  const JointPathPoint& last = path.points.back();
  const std::size_t n = cell_.robots[static_cast<std::size_t>(slot.goal->target)].arm.joints.size();
  if (path_time_s >= last.t - kRounding_s) {
    report.desired_position = last.q;
    return;
  }
  std::size_t next = slot.next;
  while (next + 1 < path.points.size() && path.points[next].t <= path_time_s + kRounding_s) ++next;
  const JointPathPoint& from = next == 0 ? slot.begin : path.points[next - 1];
  const JointPathPoint& to = path.points[next];
  const double duration_s = to.t - from.t;
  const double u = duration_s > 0.0 ? std::clamp((path_time_s - from.t) / duration_s, 0.0, 1.0) : 1.0;
  for (std::size_t j = 0; j < n; ++j) {
    const PathPiece piece = path_piece(path.order, from, to, j);
    const PathPiece velocity = piece.derivative();
    report.desired_position[j] = piece.position(u);
    report.desired_velocity[j] = piece.velocity(u);
    report.desired_acceleration[j] = velocity.velocity(u);
  }
}

void GoalMonitor::stepped(const std::function<void(int target)>& stop) {
  push_late();
  if (!active()) return;
  simulation_.read_machines(machines_);
  const double t = simulation_.time_s();
  for (std::size_t target = 0; target < slots_.size(); ++target) {
    Slot& slot = slots_[target];
    if (!slot.goal) continue;
    if (target < cell_.robots.size())
      watch_robot(slot, target, t, stop);
    else
      watch_gripper(slot, target - cell_.robots.size(), t);
  }
}

void GoalMonitor::watch_robot(Slot& slot, std::size_t robot, double t, const std::function<void(int)>& stop) {
  for (const MotionNotice& notice : simulation_.events().motion_notices) {
    if (notice.robot != static_cast<int>(robot)) continue;
    if (notice.kind == MotionNotice::Kind::motion_refused)
      return end(slot, report_of(slot, t), GoalEnd::replaced);
    GoalReport report = report_of(slot, t);
    report.joint = notice.joint;
    report.of_velocity = notice.velocity;
    report.value = notice.value;
    report.limit = notice.value > notice.upper ? notice.upper : notice.lower;
    const bool refused = notice.kind == MotionNotice::Kind::trajectory_refused;
    if (!refused && notice.kind != MotionNotice::Kind::trajectory_past) continue;
    end(slot, report, refused ? GoalEnd::refused : GoalEnd::past);
    return stop(static_cast<int>(robot));  // the motion of a goal before it would continue
  }
  if (!slot.begun) {
    if (slot.start_s > t + kRounding_s) return;
    return begin(slot, t);
  }
  GoalReport report = report_of(slot, t);
  const JointPath& path = *slot.goal->path;
  const double path_time_s = t - slot.start_s;
  while (slot.next + 1 < path.points.size() && path.points[slot.next].t <= path_time_s + kRounding_s)
    ++slot.next;
  fill_desired(slot, path_time_s, report);
  const std::size_t joints = cell_.robots[robot].arm.joints.size();
  const double over_s = path_time_s - path.points.back().t;
  if (over_s < -kRounding_s) {
    if (const auto excess = find_excess(report, slot.goal->path_tolerance, joints)) {
      note(report, *excess);
      end(slot, report, GoalEnd::path_tolerance);
      return stop(static_cast<int>(robot));
    }
  } else if (const auto excess = find_excess(report, slot.goal->goal_tolerance, joints)) {
    const double allowed_s = slot.goal->goal_time_tolerance_s;
    if (allowed_s > 0.0 && over_s > allowed_s + kRounding_s) {
      note(report, *excess);
      return end(slot, report, GoalEnd::goal_tolerance);
    }
  } else {
    return end(slot, report, GoalEnd::reached);
  }
  if (t < slot.feedback_s - kRounding_s) return;
  slot.feedback_s += kFeedback_s;
  push(report);
}

void GoalMonitor::watch_gripper(Slot& slot, std::size_t gripper, double t) {
  const GripperSample& sample = machines_.grippers[gripper];
  const GoalReport report = report_of(slot, t);
  if (std::abs(sample.width_m - slot.goal->width_m) < slot.goal->width_tolerance_m)
    return end(slot, report, GoalEnd::reached);
  if (sample.moving || t - slot.start_s < kJawsBegin_s) {
    slot.stands_since_s = -1.0;
  } else if (slot.stands_since_s < 0.0) {
    slot.stands_since_s = t;
  }
  if (slot.stands_since_s >= 0.0 && t - slot.stands_since_s >= slot.goal->stall_timeout_s - kRounding_s)
    return end(slot, report, GoalEnd::stalled);
  if (t < slot.feedback_s - kRounding_s) return;
  slot.feedback_s += kFeedback_s;
  push(report);
}

void GoalMonitor::end(Slot& slot, GoalReport report, GoalEnd end) {
  report.end = end;
  slot = {};
  push(report);
}

void GoalMonitor::drop(const MotionGoal& goal, GoalEnd end) {
  GoalReport report;
  report.number = goal.number;
  report.end = goal.kind == MotionGoal::Kind::cancel ? GoalEnd::cancelled : end;
  report.time_s = simulation_.time_s();
  push(report);
}

void GoalMonitor::cancel(int target) {
  Slot& slot = slots_[static_cast<std::size_t>(target)];
  simulation_.read_machines(machines_);
  end(slot, report_of(slot, simulation_.time_s()), GoalEnd::cancelled);
}

void GoalMonitor::restart() {
  for (Slot& slot : slots_)
    if (slot.goal) drop(*slot.goal, GoalEnd::reset), slot = {};
}

/// Feedback that finds no room is lost; an end waits.
void GoalMonitor::push(const GoalReport& report) {
  news_ = true;
  if (late_.empty() && reports_.push(report)) return;
  if (report.end != GoalEnd::none && late_.size() < kMaxLate) late_.push_back(report);
}

void GoalMonitor::push_late() {
  std::size_t sent = 0;
  while (sent < late_.size() && reports_.push(late_[sent])) ++sent;
  late_.erase(late_.begin(), late_.begin() + static_cast<std::ptrdiff_t>(sent));
}

}  // namespace takt
