#include "client_lib/lockstep_controller.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "idl/common/lockstep.h"
#include "idl/common/text.h"

namespace takt {
namespace {

/// Far below any step and far above the rounding of times.
constexpr double kTimeTolerance_s = 1e-9;
/// Answers ahead that leave together: the cell begins with them while the program goes on.
constexpr std::size_t kTogether = 16;

using SteadyClock = std::chrono::steady_clock;
}  // namespace

LockstepController::LockstepController(Client& cell, LockstepOptions options)
    : cell_(cell), options_(std::move(options)) {
  if (!(options_.period_s > 0.0 && std::isfinite(options_.period_s)))
    throw ClientError(ClientError::Kind::invalid, "The period of a controller must be above 0 s.");
  // In lockstep the cell cannot pass the first boundary before this controller is there.
  if (options_.start) cell_.set_pace(Pace::lockstep);
  cell_.register_controller(options_.name, Seconds{options_.period_s}, options_.timeout, options_.targets);
  registered_ = true;
  try {
    state_ = cell_.state();
    for (const std::string& target : options_.targets) {
      if (state_.cell->find_robot(target) >= 0) {
        const auto& positions = state_.robot(target).position;
        commands_[target] = Joints{positions, std::vector<double>(positions.size(), 0.0)};
      } else if (state_.cell->find_device(target) >= 0) {
        commands_[target] = Signals{};
      } else {
        const int index = state_.cell->find_gripper(target);
        const auto& info = state_.cell->grippers.at(static_cast<std::size_t>(index));
        commands_[target] =
            Grip{GripperAction::width, std::clamp(state_.gripper(target).width, 0.0, info.max_width),
                 info.max_force};
      }
    }
    boundary_ = static_cast<std::uint64_t>(std::ceil((state_.time - kTimeTolerance_s) / options_.period_s));
    if (options_.start) cell_.play();
    wait_for_boundary();
  } catch (...) {
    close();
    throw;
  }
}

LockstepController::~LockstepController() {
  close();
}

/// A controller that is registered and silent would hold up the cell.
void LockstepController::close() {
  if (!registered_) return;
  registered_ = false;
  try {
    if (cell_.connected()) cell_.unregister_controller(options_.name);
  } catch (const ClientError&) {
    // The server is gone or does not answer: then nothing is held up.
  }
}

LockstepController::Command& LockstepController::standing(const std::string& target) {
  const auto found = commands_.find(target);
  if (found != commands_.end()) return found->second;
  const std::string known = join(commands_, ", ", [](const auto& command) { return command.first; });
  throw ClientError(ClientError::Kind::not_found,
                    "This controller does not command '" + target + "'; its targets are " + known + ".");
}

void LockstepController::move(const std::string& robot, const std::vector<double>& positions,
                              const std::vector<double>& velocities, const std::vector<double>& efforts) {
  auto* joints = std::get_if<Joints>(&standing(robot));
  if (joints == nullptr) throw ClientError(ClientError::Kind::invalid, "'" + robot + "' is no robot.");
  *joints = {positions, velocities.empty() ? std::vector<double>(positions.size(), 0.0) : velocities,
             efforts};
}

void LockstepController::apply_torques(const std::string& robot, const std::vector<double>& torques) {
  auto* joints = std::get_if<Joints>(&standing(robot));
  if (joints == nullptr) throw ClientError(ClientError::Kind::invalid, "'" + robot + "' is no robot.");
  *joints = {{}, {}, torques};
}

void LockstepController::grip(const std::string& gripper, GripperAction action, double width_m,
                              double max_force_N) {
  auto* grip = std::get_if<Grip>(&standing(gripper));
  if (grip == nullptr) throw ClientError(ClientError::Kind::invalid, "'" + gripper + "' is no gripper.");
  *grip = {action, width_m, max_force_N};
}

void LockstepController::set_signals(const std::string& device,
                                     const std::map<std::string, double>& signals) {
  auto* standing_signals = std::get_if<Signals>(&standing(device));
  if (standing_signals == nullptr)
    throw ClientError(ClientError::Kind::invalid, "'" + device + "' is no device.");
  for (const auto& [name, value] : signals) (*standing_signals)[name] = value;
}

void LockstepController::answer() {
  answers_.push_back({time_s_, commands_});
  ++unsent_;
  ++boundary_;
  for (auto& [target, command] : commands_)
    if (auto* joints = std::get_if<Joints>(&command))
      std::fill(joints->velocities.begin(), joints->velocities.end(), 0.0);
}

const State& LockstepController::advance() {
  if (!answered_) {  // else the wait for the next boundary was given up
    answer();
    answered_ = true;
  }
  wait_for_boundary();
  return state_;
}

void LockstepController::advance_ahead() {
  if (answered_ || answers_.size() + 1 >= kMostLookahead) {
    advance();
    return;
  }
  answer();
  time_s_ = time_of(boundary_);
  if (unsent_ >= kTogether) send_ahead();
}

void LockstepController::send_ahead() {
  if (unsent_ == 0) return;
  cell_.send_together([this] {
    for (std::size_t i = answers_.size() - std::exchange(unsent_, 0); i < answers_.size(); ++i) {
      const double stamp_s = answers_[i].time_s;
      for (const auto& [target, command] : answers_[i].commands) {
        const auto* joints = std::get_if<Joints>(&command);
        if (joints != nullptr && joints->positions.empty())
          cell_.send_joint_torques(target, joints->efforts, stamp_s);
        else if (joints != nullptr)
          cell_.send_joint_command(target, joints->positions, joints->velocities, stamp_s, joints->efforts);
        else if (const auto* grip = std::get_if<Grip>(&command))
          cell_.set_gripper(target, grip->action, grip->width_m, grip->max_force_N, stamp_s);
        else if (const auto* signals = std::get_if<Signals>(&command))
          cell_.set_signals(target, *signals, stamp_s);
      }
    }
  });
}

/// As the server counts it.
double LockstepController::time_of(std::uint64_t boundary) const {
  const double step_s = state_.cell->step_size;
  return static_cast<double>(period_boundary_step(boundary, options_.period_s, step_s)) * step_s;
}

void LockstepController::wait_for_boundary() {
  const auto begin = SteadyClock::now();
  double due_s = time_of(boundary_) - kTimeTolerance_s;
  const auto exchanged = [&](const State& s) { return s.cell != state_.cell || s.epoch != state_.epoch; };
  std::uint64_t seen = state_.sample_number, seen_step = state_.step;
  for (;;) {
    send_ahead();
    const Seconds left = options_.timeout - (SteadyClock::now() - begin);
    const auto next = cell_.wait_for(
        topics::state,
        [&](const State& s) {
          if (s.time >= due_s || exchanged(s) || s.time < state_.time) return true;
          const bool repeated = s.step == seen_step && s.sample_number > seen && !answers_.empty();
          seen = std::max(seen, s.sample_number);
          seen_step = s.step;
          return repeated;
        },
        left);
    if (next && exchanged(*next)) {
      // A single sample may be forged; the one behind it decides.
      const auto confirmed = cell_.wait_for(
          topics::state, [&](const State& s) { return s.sample_number > next->sample_number; }, Seconds{2.0});
      if (confirmed && !exchanged(*confirmed)) continue;
      throw ClientError(ClientError::Kind::lost,
                        std::string("The cell ") +
                            (next->cell != state_.cell ? "has another scenario" : "was reset") +
                            "; start its controllers again.");
    }
    if (next && next->time < state_.time) {  // the time that was answered was not the cell's
      state_ = *next;
      answers_.clear();
      boundary_ = static_cast<std::uint64_t>(std::ceil((state_.time - kTimeTolerance_s) / options_.period_s));
      due_s = time_of(boundary_) - kTimeTolerance_s;
      if (state_.time < due_s) continue;
    }
    if (next && next->time >= due_s) {
      state_ = *next;
      time_s_ = state_.time;
      answers_.clear();
      unsent_ = 0;
      answered_ = false;
      // At another pace than lockstep boundaries may have passed meanwhile.
      boundary_ = std::max(boundary_,
                           static_cast<std::uint64_t>((state_.time + kTimeTolerance_s) / options_.period_s));
      return;
    }
    if (SteadyClock::now() - begin >= options_.timeout) give_up();
    if (!next) continue;
    // An instant that was answered has come once more: the commands may not have arrived.
    std::erase_if(answers_, [&](const Answer& sent) { return sent.time_s < next->time - kTimeTolerance_s; });
    unsent_ = answers_.size();
  }
}

void LockstepController::give_up() const {
  const Status status = cell_.status();
  std::string sentence = "The cell did not come to " + number_text(time_of(boundary_)) +
                         " s of simulated time within " + number_text(options_.timeout.count()) +
                         " s: it stands at " + number_text(status.time) + " s and is " +
                         std::string(to_string(status.state));
  for (std::size_t i = 0; i < status.waiting_for.size(); ++i)
    sentence += (i == 0 ? ", waiting for " : " and ") + status.waiting_for[i];
  if (!status.fault.empty()) sentence += ", with the fault: " + status.fault;
  throw ClientError(ClientError::Kind::timeout, sentence + ".");
}

}  // namespace takt
