#include "server/runtime/loop/lockstep_barrier.h"

#include <algorithm>
#include <cmath>

#include "idl/common/lockstep.h"

namespace takt {
namespace {

constexpr std::int64_t kLateAfter_ns = 1'000'000'000;  // a wait of this length is reported in an event

}  // namespace

LockstepBarrier::LockstepBarrier(LoopContext& loop)
    : loop_(loop), controllers_(target_count(loop.cell()), loop.cell().step_s) {}

std::optional<std::uint64_t> LockstepBarrier::boundary_ahead(const ReceivedCommand& received) const {
  const auto* controller = controllers_.owner(received.target);
  const SimTime stamp = stamp_of(received.command);
  // The stamp of a goal is its start.
  if (controller == nullptr || !stamp.given() || received.goal != nullptr) return std::nullopt;
  const double periods = stamp.seconds() / controller->period_s;
  const auto next = static_cast<double>(controller->boundary);
  if (!(periods > next && periods < next + kMostLookahead + 1.0)) return std::nullopt;
  const double step_s = loop_.cell().step_s;
  // The stamp is the time of the boundary's step, up to one step behind k * period.
  for (std::uint64_t k = std::max(controller->boundary + 1, static_cast<std::uint64_t>(periods) - 1);
       k < controller->boundary + kMostLookahead && static_cast<double>(k) <= periods + 1.0; ++k) {
    const auto step = period_boundary_step(k, controller->period_s, step_s);
    if (step > controller->boundary_step &&
        SimTime::from_seconds(static_cast<double>(step) * step_s) == stamp)
      return k;
  }
  return std::nullopt;
}

bool LockstepBarrier::admits(const ReceivedCommand& received, bool known_sender, bool may_repeat) {
  // A goal has no boundary in mind: it takes the place of the command at the next one of its target, or takes effect at
  // once where no controller has the target.
  if (received.goal != nullptr) return true;
  const auto* controller = controllers_.owner(received.target);
  const double step_s = loop_.cell().step_s;
  SimTime stamp = stamp_of(received.command);
  RejectionCode code = RejectionCode::invalid_request;
  double boundary_s = -1.0;
  if (controller == nullptr) {
    // In single steps the client that steps decides on the commands in between; a running lockstep must not
    // depend on arrival times.
    if (!loop_.plays()) return true;
    // An answer to a state that was sent twice, behind the request by which its controller left.
    if (known_sender && stamp.given() && stamp < SimTime::from_seconds(loop_.simulation.time_s()))
      return false;
  } else {
    boundary_s = static_cast<double>(controller->boundary_step) * step_s;
    const auto boundary = SimTime::from_seconds(boundary_s);
    // A zero stamp is both "unset" on the wire and the boundary at t = 0.
    if (!stamp.given() && boundary.ns == 0) stamp = boundary;
    // Until its end a trajectory serves as the command for every boundary.
    if (stamp == boundary && !covered_by_trajectory(received.target, boundary_s)) return true;
    if (stamp == boundary) stamp = {};
    // Answers to a state that was sent twice; from a controller that looks ahead there are several.
    const std::uint64_t answers = known_sender ? kMostLookahead : 1;
    for (std::uint64_t back = 1; back <= std::min(answers, controller->boundary); ++back) {
      const auto crossed = period_boundary_step(controller->boundary - back, controller->period_s, step_s);
      if (stamp == SimTime::from_seconds(static_cast<double>(crossed) * step_s)) return false;
    }
    if (stamp.given()) code = stamp < boundary ? RejectionCode::stale : RejectionCode::out_of_range;
  }
  if (may_repeat) return false;
  if (controller == nullptr)
    loop_.emit(loop_.record_of(events::CommandWithoutController{received.target, code}, received.sender));
  else
    loop_.emit(loop_.record_of(
        events::CommandBesideBoundary{received.target, code, stamp.given(), stamp.seconds(), boundary_s},
        received.sender));
  ++refused_;
  return false;
}

bool LockstepBarrier::refuses_beside_trajectory(const ReceivedCommand& received) {
  const double time_s = loop_.simulation.time_s();
  if (!covered_by_trajectory(received.target, time_s)) return false;
  loop_.emit(loop_.record_of(
      events::CommandBesideBoundary{received.target, RejectionCode::invalid_request, false, -1.0, time_s},
      received.sender));
  ++refused_;
  return true;
}

LockstepBarrier::Verdict LockstepBarrier::check(const std::function<bool(int)>& has_command,
                                                bool single_step) {
  Verdict verdict;
  if (controllers_.controllers().empty()) {
    if (!single_step) name("(no controller is registered)");
    verdict.open = single_step;
    return verdict;
  }
  const std::uint64_t step = loop_.simulation.step_index();
  for (auto& controller : controllers_.controllers()) {
    if (controller.boundary_step != step) continue;
    const auto missing = std::find_if(controller.targets.begin(), controller.targets.end(), [&](int target) {
      return !has_command(target) && !covered_by_trajectory(target, loop_.simulation.time_s());
    });
    if (missing == controller.targets.end()) continue;
    name(controller.name);
    if (auto timeout = wait_for(controller, *missing, verdict)) {
      if (verdict.timeout) loop_.emit(*verdict.timeout);
      verdict.timeout = timeout;
    }
  }
  verdict.open = waiting_count_ == 0;
  return verdict;
}

void LockstepBarrier::missing(const std::function<bool(int)>& has_command, std::vector<int>& out) const {
  out.clear();
  for (const auto& controller : controllers_.controllers()) {
    if (controller.boundary_step != loop_.simulation.step_index()) continue;
    for (const int target : controller.targets)
      if (!has_command(target) && !covered_by_trajectory(target, loop_.simulation.time_s()))
        out.push_back(target);
  }
}

bool LockstepBarrier::is_waited_for(const std::function<bool(int)>& has_command) const {
  return std::ranges::any_of(controllers_.controllers(), [&](const auto& controller) {
    return controller.boundary_step == loop_.simulation.step_index() &&
           !std::ranges::all_of(controller.targets, has_command);
  });
}

bool LockstepBarrier::covered_by_trajectory(int target, double time_s) const {
  const auto robot = static_cast<std::size_t>(target);
  if (robot >= loop_.cell().robots.size()) return false;
  return loop_.simulation.trajectory_end_s(robot) > time_s + 0.5 * loop_.cell().step_s;
}

std::optional<events::OfLoop> LockstepBarrier::wait_for(ControllerRegistry::Controller& controller,
                                                        int missing_target, Verdict& verdict) {
  const std::int64_t now = monotonic_now_ns();
  if (wait_began_ns_ == 0) {
    wait_began_ns_ = now;
    for (auto& each : controllers_.controllers()) each.late_reported = false;
    wait_in_status_ = false;
  }
  const std::int64_t waited = now - wait_began_ns_;
  if (waited >= kWaitInStatus_ns && !wait_in_status_) wait_in_status_ = verdict.news_for_status = true;
  const FixedString<128> name(controller.name);
  const double boundary_s = loop_.simulation.time_s();
  if (static_cast<double>(waited) >= controller.timeout_s * 1e9)
    return events::ControllerTimeout{name, missing_target, boundary_s, controller.timeout_s};
  if (waited >= kLateAfter_ns && !controller.late_reported) {
    controller.late_reported = true;
    loop_.emit(events::ControllerLate{name, missing_target, boundary_s, static_cast<double>(waited) * 1e-9});
  }
  return std::nullopt;
}

void LockstepBarrier::crossed(std::uint64_t step) {
  for (auto& controller : controllers_.controllers()) {
    // Out of lockstep the loop does not wait at boundaries, but keeps them up to date for a change to
    // lockstep.
    while (controller.boundary_step <= step) controllers_.advance(controller);
  }
  stop_waiting();
}

}  // namespace takt
