#include "client_lib/tools/takt_controller/session.h"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>

namespace takt::tool {
namespace {

/// Times are multiples of the step in binary arithmetic; this is far below any step and far above their
/// rounding.
constexpr double kTimeTolerance_s = 1e-9;
/// Practically without end: DDS announces the end of a server, and a cell may stay paused for any time.
constexpr Seconds kPatience{1.0e9};
/// How long the sample behind another is waited for; a server repeats its state more often.
constexpr Seconds kConfirmation{2.0};

/// A cell found again with at most this simulated time has started from its scenario. A cell with more has
/// resumed from a snapshot; a program cannot begin in the middle of that.
constexpr double kFresh_s = 2.0;

/// Commands one cell by one program.
class Session {
 public:
  explicit Session(const SessionOptions& options)
      : options_(options),
        cell_(options.client),
        info_(cell_.cell()),
        controller_(options.program, *info_, options.parameters),
        period_s_(controller_.period_s()) {}

  /// `again`: the cell was lost before. One that goes on in the middle is left alone until it is reset.
  int run(bool again) {
    std::vector<std::string> targets;
    for (const int robot : controller_.driven_robots()) targets.push_back(robot_name(robot));
    for (const int gripper : controller_.driven_grippers()) targets.push_back(gripper_name(gripper));
    for (const int device : controller_.driven_devices())
      targets.push_back(info_->devices.at(static_cast<std::size_t>(device)).name);
    cell_.register_controller(options_.name, Seconds{period_s_}, options_.client.timeout, targets);
    try {
      if (options_.pace) cell_.set_pace(*options_.pace);
      begin_at(cell_.state());
      if (again && cell_.state().time > kFresh_s) {
        next_boundary_ = std::numeric_limits<double>::infinity();
        std::printf("The cell goes on at %.3f s; %s begins when it is reset (takt reset).\n",
                    cell_.state().time, options_.program.c_str());
        std::fflush(stdout);
      } else if (options_.start &&
                 (!again || info_->scenario_generation <= 1)) {  // the client that loads a scenario plays it
        cell_.play();
      }
      while (one_boundary()) {
      }
    } catch (...) {
      leave();
      throw;
    }
    std::printf("%s has finished at %.3f s.\n", options_.program.c_str(), time_s_);
    report_speed();
    leave();
    return 0;
  }

 private:
  const std::string& robot_name(int i) const { return info_->robots.at(static_cast<std::size_t>(i)).name; }
  const std::string& gripper_name(int i) const {
    return info_->grippers.at(static_cast<std::size_t>(i)).name;
  }

  /// The next boundary is the first at or after this state.
  void begin_at(const State& state) {
    epoch_ = state.epoch;
    next_boundary_ = std::ceil((state.time - kTimeTolerance_s) / period_s_);
    sent_at_step_.reset();
    output_ = nullptr;
    exchanges_ = 0;
  }

  /// Waits for the next boundary and answers it, or answers the last one again. False when there is nothing
  /// more to do: then the boundary is left unanswered, and in lockstep the cell stands exactly there.
  bool one_boundary() {
    const double due_s = next_boundary_ * period_s_ - kTimeTolerance_s;
    std::uint64_t seen = newest_sample_;
    const bool last = finished_ && !options_.until_s;
    const auto state = cell_.wait_for(
        topics::state,
        [&](const State& s) {
          if (s.time >= due_s || s.epoch != epoch_ || s.cell != info_) return true;
          const bool is_new = s.sample_number > seen;
          seen = s.sample_number;
          // The cell repeats the instant that was answered: the commands may not have arrived.
          return is_new && sent_at_step_ == s.step;
        },
        last ? options_.client.timeout : kPatience);
    if (!state) return false;  // the program has finished and the cell is paused
    newest_sample_ = state->sample_number;
    if ((state->cell != info_ || state->epoch != epoch_) && !is_confirmed(*state)) return true;
    if (state->cell != info_)
      throw ClientError(
          ClientError::Kind::lost,
          "The server was started again, or loaded something else; the program does not go on in the "
          "middle.");
    if (state->epoch != epoch_) {
      std::printf("The cell was reset; %s starts again.\n", options_.program.c_str());
      std::fflush(stdout);
      controller_.restart();
      finished_ = false;
      begin_at(*state);
      return true;
    }
    if (state->time >= due_s) {
      if (finished_ && state->time >= options_.until_s.value_or(0.0) - kTimeTolerance_s) return false;
      compute(*state);
    }
    send();
    return true;
  }

  /// A single sample of another scenario or epoch may be forged; the one behind it decides.
  bool is_confirmed(const State& state) {
    const auto next = cell_.wait_for(
        topics::state, [&](const State& s) { return s.sample_number > state.sample_number; }, kConfirmation);
    return !next || next->cell != info_ || next->epoch != epoch_;
  }

  /// Calls the program once for each boundary up to this state. In lockstep there is exactly one; at other
  /// paces there may be several after a delay, and the commands of the last one count.
  void compute(const State& state) {
    while (next_boundary_ * period_s_ - kTimeTolerance_s <= state.time) {
      output_ = &controller_.update(state);
      finished_ = output_->finished;
      next_boundary_ += 1.0;
    }
    time_s_ = state.time;
    sent_at_step_ = state.step;
    last_answer_ = Clock::now();
    if (++exchanges_ > 1) return;
    first_answer_ = last_answer_;
    first_time_s_ = state.time;
  }

  /// From the first answer on, so that neither discovery nor a pause ahead of the program counts.
  void report_speed() const {
    const double simulated_s = time_s_ - first_time_s_;
    const double wall_s = std::chrono::duration<double>(last_answer_ - first_answer_).count();
    if (exchanges_ < 2 || wall_s <= 0.0) return;
    std::printf("%.3f s simulated in %.3f s, real-time factor %.1f: %llu exchanges, %.0f us each.\n",
                simulated_s, wall_s, simulated_s / wall_s, static_cast<unsigned long long>(exchanges_),
                1e6 * wall_s / static_cast<double>(exchanges_ - 1));
  }

  void send() {
    if (output_ != nullptr) cell_.send_together([this] { send_commands(); });
  }
  void send_commands() {
    const auto used = [](const JointArray& values, std::size_t count) {
      return std::vector<double>(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(count));
    };
    for (const auto& joints : output_->joints) {
      const std::size_t count = info_->robots.at(static_cast<std::size_t>(joints.robot)).joints.size();
      cell_.send_joint_command(robot_name(joints.robot), used(joints.position, count),
                               used(joints.velocity, count), time_s_);
    }
    for (const auto& gripper : output_->grippers)
      cell_.set_gripper(gripper_name(gripper.gripper), gripper.verb, gripper.width_m, gripper.max_force_N,
                        time_s_);
    for (const auto& set_point : output_->devices) {
      const auto& device = info_->devices.at(static_cast<std::size_t>(set_point.device));
      std::map<std::string, double> signals;
      for (std::size_t i = 0; i < set_point.signals.size(); ++i)
        signals[device.signals.at(static_cast<std::size_t>(set_point.signals[i])).name] = set_point.values[i];
      cell_.set_signals(device.name, signals, time_s_);
    }
  }

  /// A controller that is registered and silent would hold up a cell in lockstep.
  void leave() {
    try {
      if (cell_.connected()) cell_.unregister_controller(options_.name);
    } catch (const ClientError& error) {
      std::fprintf(stderr, "takt-controller: %s\n", error.what());
    }
  }

  const SessionOptions& options_;
  Client cell_;
  std::shared_ptr<const CellInfo> info_;
  controller::Controller controller_;
  double period_s_;
  std::uint32_t epoch_ = 0;
  double next_boundary_ = 0.0;  ///< a whole number
  std::optional<std::uint64_t> sent_at_step_;
  std::uint64_t newest_sample_ = 0;
  const controller::Output* output_ = nullptr;
  double time_s_ = 0.0;  ///< of the state answered last
  using Clock = std::chrono::steady_clock;
  std::uint64_t exchanges_ = 0;  ///< states answered since the last reset
  Clock::time_point first_answer_, last_answer_;
  double first_time_s_ = 0.0;  ///< of the first of them
  bool finished_ = false;
};

}  // namespace

int run_session(const SessionOptions& options) {
  std::optional<Session> session(std::in_place, options);
  for (bool again = false;; again = true) {
    try {
      return session->run(again);
    } catch (const ClientError& error) {
      if (error.kind() != ClientError::Kind::lost || options.until_s) throw;
      std::printf("%s %s waits for it and starts again.\n", error.what(), options.program.c_str());
      std::fflush(stdout);
    }
    for (session.reset(); !session;) {
      try {
        session.emplace(options);
      } catch (const ClientError& error) {
        if (error.kind() != ClientError::Kind::not_found) throw;
      }
    }
  }
}

}  // namespace takt::tool
