#include "server/dds/action_servers.h"

#include <algorithm>
#include <exception>
#include <utility>
#include <variant>

#include "idl/common/cdr.h"
#include "idl/common/utf8.h"
#include "server/dds/action_goals.h"
#include "server/runtime/requests/event_queue.h"

namespace takt {

/// An action of a robot or a gripper.
class ActionServers::Motion : public ActionExecutor {
 public:
  Motion(ActionServers& owner, ActionServer::Types types, const ActionInfo& info, int target)
      : owner_(owner), target_(target) {
    const CellDescription& known = cell();
    server_.emplace(*owner.participant_, info.name(known.cell, target_name(known, target)), std::move(types),
                    owner.numbers_, [&owner] { owner.host_.outbound().news.post(); });
  }

  ActionServer& server() { return *server_; }

  std::optional<std::string> begin(std::span<const std::uint8_t> request, std::uint64_t number) override {
    auto order = order_of(request, number);
    if (auto* rejection = std::get_if<Rejection>(&order)) return refuse(*rejection);
    auto& [command, goal] = std::get<ros::MotionOrder>(order);
    if (const auto rejection = owner_.loop_->append(command, goal)) return refuse(*rejection);
    return std::nullopt;
  }

  void cancel(std::uint64_t number) override {
    const auto [command, goal] = ros::cancellation_of(cell(), target_, number);
    // A full buffer: the goal goes on to its own end.
    (void)owner_.loop_->append(command, goal);
  }

  /// Whether the report is of a goal of this action.
  bool take(const GoalReport& report) {
    if (!server_->knows(report.number)) return false;
    if (report.end == GoalEnd::none) {
      server_->feedback(report.number, [&](const GoalId& id) { return feedback(id, report); });
    } else {
      const GoalState state = ros::state_of(report, server_->canceling(report.number));
      server_->end(report.number, state, result(state, report));
    }
    return true;
  }

  /// Goals end with the loop.
  void end_all() {
    for (const GoalTable::Goal& goal : std::vector<GoalTable::Goal>(server_->table().goals()))
      if (!is_end(goal.state)) {
        GoalReport report;
        report.number = goal.number;
        report.end = GoalEnd::reset;
        report.time_s = present().seconds();
        (void)take(report);
      }
  }

 protected:
  virtual Validated<ros::MotionOrder> order_of(std::span<const std::uint8_t> request,
                                               std::uint64_t number) = 0;
  virtual std::string feedback(const GoalId& id, const GoalReport& report) const = 0;
  virtual std::string result(GoalState state, const GoalReport& report) const = 0;

  const CellDescription& cell() const { return owner_.loop_->cell(); }
  SimTime present() const { return owner_.loop_->present(); }
  int target() const { return target_; }

 private:
  std::string refuse(const Rejection& rejection) {
    owner_.host_.outbound().events.post(
        events::CommandRejected{rejection.subject, rejection.code, rejection.message});
    return rejection.message;
  }

  ActionServers& owner_;
  const int target_;
  std::optional<ActionServer> server_;
};

template <typename Action>
class ActionServers::TypedMotion final : public ActionServers::Motion {
 public:
  TypedMotion(ActionServers& owner, int target)
      : Motion(owner, action_types<Action>(), Action::info, target) {}

 private:
  Validated<ros::MotionOrder> order_of(std::span<const std::uint8_t> request, std::uint64_t number) override {
    typename Action::SendGoalRequest message;
    if (!cdr::read(request, message))
      return Rejection{RejectionCode::malformed, std::string(target_name(cell(), target())),
                       "the goal is no goal"};
    return ros::order_of(cell(), target(), number, present(), std::move(message.goal));
  }
  std::string feedback(const GoalId& id, const GoalReport& report) const override {
    typename Action::FeedbackMessage message;
    message.goal_id.uuid = id;
    ros::fill(report, cell(), target(), message.feedback);
    std::string bytes;
    (void)cdr::write(message, bytes);
    return bytes;
  }
  std::string result(GoalState state, const GoalReport& report) const override {
    typename Action::GetResultResponse message;
    message.status = static_cast<std::int8_t>(state);
    ros::fill(report, cell(), target(), message.result);
    std::string bytes;
    (void)cdr::write(message, bytes);
    return bytes;
  }
};

/// SimulateSteps: the request `step` with progress. One goal at a time; a cancellation pauses the simulation, which ends
/// the steps.
class ActionServers::Steps final : public ActionExecutor {
 public:
  using Action = actions::SimulateSteps;

  Steps(CellHost& host, Participant& participant, std::uint64_t& numbers)
      : host_(host),
        server_(participant, Action::info.name(host.cell()), action_types<Action>(), numbers,
                [&host] { host.outbound().news.post(); }) {}

  ActionServer& server() { return server_; }

  std::optional<std::string> begin(std::span<const std::uint8_t> request, std::uint64_t number) override {
    Action::SendGoalRequest message;
    if (!cdr::read(request, message)) return "The goal is no goal.";
    if (message.goal.steps == 0) return "No steps are asked for; one at least is needed.";
    if (running_ != 0) return "Steps of an earlier goal are being taken; wait for their end, or cancel them.";
    running_ = number;
    steps_ = message.goal.steps;
    first_step_.reset();
    requests_.push_back(control_request(requests::Step{steps_}));
    requests_.back().id = kFirstId + number;
    return std::nullopt;
  }

  void cancel(std::uint64_t number) override {
    if (number != running_) return;
    requests_.push_back(control_request(requests::SetState{SimulationState::paused}));
    requests_.back().id = kFirstId;  // its reply is not waited for
  }

  /// To be submitted without a lock.
  std::vector<ControlRequest> take_requests() { return std::exchange(requests_, {}); }

  void take(const ControlReply& reply) {
    if (running_ == 0 || reply.id != kFirstId + running_) return;
    Action::GetResultResponse response;
    const bool done = reply.result == ControlResult::ok;
    const GoalState state = done                          ? GoalState::succeeded
                            : server_.canceling(running_) ? GoalState::canceled
                                                          : GoalState::aborted;
    response.status = static_cast<std::int8_t>(state);
    response.result.result.result = static_cast<std::uint8_t>(reply.result);
    response.result.result.error_message = done ? std::string() : utf8_sanitize(reply.message, 1000);
    std::string bytes;
    (void)cdr::write(response, bytes);
    if (done) progress(steps_);
    server_.end(std::exchange(running_, 0), state, std::move(bytes));
  }

  void write(std::uint64_t step) {
    if (running_ == 0) {
      newest_step_ = step;
      return;
    }
    if (!first_step_) first_step_ = newest_step_;
    if (step <= std::exchange(newest_step_, step)) return;
    const std::uint64_t done = step - std::min(*first_step_, step);
    if (done > 0 && done < steps_) progress(done);
  }

 private:
  void progress(std::uint64_t done) {
    server_.feedback(running_, [&](const GoalId& id) {
      Action::FeedbackMessage message;
      message.goal_id.uuid = id;
      message.feedback = {done, steps_ - done};
      std::string bytes;
      (void)cdr::write(message, bytes);
      return bytes;
    });
  }

  CellHost& host_;
  ActionServer server_;
  std::uint64_t running_ = 0;  ///< number of the goal; 0: none
  std::uint64_t steps_ = 0, newest_step_ = 0;
  std::optional<std::uint64_t> first_step_;
  std::vector<ControlRequest> requests_;
};

ActionServers::ActionServers(CellHost& host) : host_(host) {}
ActionServers::~ActionServers() = default;

void ActionServers::serve(Participant& participant) {
  participant_ = &participant;
  auto steps = std::make_unique<Steps>(host_, participant, numbers_);
  const std::lock_guard lock(mutex_);
  steps_ = std::move(steps);
}

template <typename Action>
void ActionServers::add(int target) {
  motions_.push_back(std::make_unique<TypedMotion<Action>>(*this, target));
}

void ActionServers::open(RunLoop& loop) {
  const std::lock_guard lock(mutex_);
  loop_ = &loop;
  const CellDescription& cell = loop.cell();
  const auto robots = static_cast<int>(cell.robots.size());
  for (int robot = 0; robot < robots; ++robot) add<actions::FollowJointTrajectory>(robot);
  for (int gripper = 0; gripper < static_cast<int>(cell.grippers.size()); ++gripper) {
    add<actions::GripperCmd>(robots + gripper);
    add<actions::ParallelGripperCmd>(robots + gripper);
  }
}

void ActionServers::close() {
  std::vector<std::unique_ptr<Motion>> closed;
  {
    const std::lock_guard lock(mutex_);
    if (loop_ != nullptr) {
      take_reports();
      for (auto& motion : motions_) motion->end_all();
    }
    closed.swap(motions_);
    for (auto& motion : closed) motion->server().remove();
    loop_ = nullptr;
  }
}

void ActionServers::take_reports() {
  GoalReport report;
  while (loop_->output().goals.pop(report)) {
    for (auto& motion : motions_)
      if (motion->take(report)) break;
  }
}

void ActionServers::take_replies(std::span<const ControlReply> replies) {
  const std::lock_guard lock(mutex_);
  if (!steps_) return;
  for (const ControlReply& reply : replies) steps_->take(reply);
}

bool ActionServers::replies_wait() {
  const std::lock_guard lock(mutex_);
  const auto wait = [](const auto& action) { return action->server().replies_wait(); };
  return (steps_ && wait(steps_)) || std::any_of(motions_.begin(), motions_.end(), wait);
}

void ActionServers::write(std::uint64_t step) {
  std::vector<ControlRequest> requests;
  {
    const std::lock_guard lock(mutex_);
    if (!steps_) return;
    const std::int64_t present_ns = loop_ != nullptr ? std::max<std::int64_t>(loop_->present().ns, 0) : 0;
    if (loop_ != nullptr) {
      take_reports();
      for (auto& motion : motions_) motion->server().serve(*motion, present_ns);
    }
    steps_->server().serve(*steps_, present_ns);
    steps_->write(step);
    requests = steps_->take_requests();
  }
  // The host may wait for close() with its own locks held.
  for (const ControlRequest& request : requests) host_.submit(request);
}

}  // namespace takt
