#include "server/runtime/loop/run_loop.h"

#include <algorithm>
#include <utility>
#include <variant>

namespace takt {
namespace {

constexpr std::int64_t kLongestSleep_ns = 10'000'000;  // so that requests are heard at slow paces
constexpr std::int64_t kLongestStanding_ns =
    20'000'000;  // so that a long wait for commands is in the status at once
constexpr std::int64_t kLongestRest_ns = 100'000'000;

RunLoopOptions with_outbound(RunLoopOptions options) {
  if (!options.outbound) options.outbound = std::make_shared<OutboundQueue>();
  return options;
}

}  // namespace

RunLoop::RunLoop(Simulation& simulation, RunLoopOptions options)
    : options_(with_outbound(std::move(options))),
      output_(simulation, options_.outbound),
      control_(simulation, output_, options_, stop_),
      executor_(control_) {}

RunLoop::~RunLoop() {
  stop();
}

void RunLoop::start() {
  inbox_.open();
  thread_ = std::thread([this] { run(); });
}

void RunLoop::stop() {
  stop_.store(true);
  wakeup_.post();
  if (thread_.joinable()) thread_.join();
}

void RunLoop::run() {
  control_.begin();
  while (!stop_.load(std::memory_order_relaxed)) {
    if (inbox_.waiting()) {
      control_.saver.note_change();
      inbox_.serve_visit();
    }
    if (suspended_.load(std::memory_order_relaxed)) {
      stand(kLongestRest_ns);
      continue;
    }
    if (inbox_.waiting())
      for (const RequestInbox::Request& request : inbox_.take())
        executor_.execute(request.id, request.request);
    executor_.answer_query();
    control_.intake.collect();
    if (!control_.may_step()) {
      control_.expect_commands();
      control_.saver.save_if_due();
      const bool waits_for_commands = control_.context.plays() || control_.single_steps_left() > 0;
      stand(executor_.has_queries() ? 0 : waits_for_commands ? kLongestStanding_ns : kLongestRest_ns);
      continue;
    }
    if (wait_for_schedule()) control_.take_step();
  }
  LoopContext& loop = control_.context;
  if (loop.recorder != nullptr) loop.recorder->end_scenario(loop.simulation);
  control_.end_single_steps(
      {ControlResult::failed, "The remaining steps were not taken: the simulation has ended."});
  for (const RequestInbox::Request& request : inbox_.close()) executor_.refuse(request.id);
  executor_.refuse_queries();
  loop.state = SimulationState::quitting;
  control_.status.publish();
  if (quitting() && on_quit_) on_quit_();
}

void RunLoop::stand(std::int64_t longest_ns) {
  control_.publish_skipped_instant();
  output_.standing_at_boundary.store(true, std::memory_order_relaxed);
  control_.status.publish_if_due();
  if (longest_ns > 0)
    wakeup_.wait_until_ns(std::min(control_.status.due_ns(), monotonic_now_ns() + longest_ns),
                          control_.context.pace == Pace::lockstep);
}

bool RunLoop::wait_for_schedule() {
  output_.standing_at_boundary.store(false, std::memory_order_relaxed);
  LoopContext& loop = control_.context;
  if (loop.pace != Pace::realtime || !loop.plays()) return true;
  const Pacer::Result result = control_.pacer.wait(kLongestSleep_ns);
  if (result == Pacer::Result::not_due) {
    control_.publish_skipped_instant_if_read();
    control_.status.publish_if_due();
    return false;
  }
  if (result == Pacer::Result::schedule_reset) {
    loop.emit(events::ScheduleReset{static_cast<double>(control_.pacer.figures().lag_ns) * 1e-9});
  }
  control_.intake.collect();
  return true;
}

std::optional<Rejection> RunLoop::append(const Command& command, std::uint64_t sender,
                                         std::int64_t received_ns) {
  bool wake = false;
  auto rejection = control_.intake.buffer().append(command, sender, received_ns, &wake);
  if (wake) wakeup_.post();
  return rejection;
}

std::optional<Rejection> RunLoop::append(const Command& command, GoalPtr goal) {
  // Each goal is a sender of its own: none is stale beside another.
  constexpr std::uint64_t kGoals = std::uint64_t{1} << 62U;
  bool wake = false;
  const std::uint64_t sender = kGoals + goal->number;
  auto rejection =
      control_.intake.buffer().append(command, sender, monotonic_now_ns(), &wake, std::move(goal));
  if (wake) wakeup_.post();
  return rejection;
}

void RunLoop::submit(std::uint64_t id, requests::Any request) {
  if (inbox_.push({id, std::move(request)})) {
    wakeup_.post();
  } else {
    executor_.refuse(id);
  }
}

std::optional<SimulationState> RunLoop::suspend() {
  std::optional<SimulationState> state;
  (void)between_steps([&] {
    suspended_.store(true);
    state = control_.context.state;
  });
  return state;
}

void RunLoop::resume() {
  suspended_.store(false);
  wakeup_.post();
}

std::vector<requests::RegisterController> RunLoop::controllers() const {
  std::vector<requests::RegisterController> result;
  for (const ControllerRegistry::Controller& controller : control_.barrier.controllers().controllers()) {
    result.push_back({controller.name, controller.period_s, controller.timeout_s, {}});
    for (const int target : controller.targets)
      result.back().targets.emplace_back(target_name(cell(), target));
  }
  return result;
}

}  // namespace takt
