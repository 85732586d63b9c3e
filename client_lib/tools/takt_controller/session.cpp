#include "client_lib/tools/takt_controller/session.h"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <deque>
#include <exception>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>

#include "client_lib/tools/takt_controller/program_reporter.h"

namespace takt::tool {
namespace {

/// Times are multiples of the step in binary arithmetic; this is far below any step and far above their
/// rounding.
constexpr double kTimeTolerance_s = 1e-9;
/// Practically without end: DDS announces the end of a server, and a cell may stay paused for any time.
constexpr Seconds kPatience{1.0e9};
/// Periods ahead whose commands leave together: the cell begins with them while the program goes on.
constexpr std::size_t kTogether = 16;

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
        reporter_(cell_, controller_, *info_, options.name),
        period_s_(controller_.period_s()) {}

  /// `again`: the cell was lost before. One that goes on in the middle is left alone until it is reset.
  int run(bool again) {
    std::vector<std::string> targets;
    for (const int robot : controller_.driven_robots()) targets.push_back(robot_name(robot));
    for (const int gripper : controller_.driven_grippers()) targets.push_back(gripper_name(gripper));
    for (const int device : controller_.driven_devices())
      targets.push_back(info_->devices.at(static_cast<std::size_t>(device)).name);
    cell_.register_controller(options_.name, Seconds{period_s_}, options_.client.timeout, targets);
    if (const std::string refusal = reporter_.begin(options_.program); !refusal.empty())
      std::fprintf(stderr, "takt-controller: note: viewers do not see the program: %s\n", refusal.c_str());
    try {
      if (options_.pace) cell_.set_pace(*options_.pace, cell_.status().pace_factor);
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
      reporter_.send();
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
    answers_.clear();
    unsent_ = 0;
    foreseen_ = seen_ = state;
    exchanges_ = waits_ = 0;
  }

  static bool is_at(const State& state, double time_s) { return state.time >= time_s - kTimeTolerance_s; }
  /// As the server counts it.
  double time_of(double boundary) const {
    if (!std::isfinite(boundary)) return boundary;
    const auto step = period_boundary_step(static_cast<std::uint64_t>(boundary), period_s_, info_->step_size);
    return static_cast<double>(step) * info_->step_size;
  }

  /// Answers the next boundary. False when there is nothing more to do: then the boundary is left unanswered, and in
  /// lockstep the cell stands exactly there.
  bool one_boundary() {
    const double due_s = time_of(next_boundary_);
    const bool done = finished_ && (!options_.until_s || due_s >= *options_.until_s - kTimeTolerance_s);
    const auto passed = [&] { return seen_.time > due_s + kTimeTolerance_s; };
    if (!done && !passed() && may_look_ahead()) {
      compute_ahead(due_s);
      return true;
    }
    send();
    if (!wait_for(due_s, finished_ && !options_.until_s ? options_.client.timeout : kPatience)) return false;
    if (restarted()) return true;
    if (finished_ && seen_.time >= options_.until_s.value_or(0.0) - kTimeTolerance_s) return false;
    if (passed() || !may_look_ahead()) compute();
    return true;
  }

  /// A program may wait long; what has not been reported of it is reported meanwhile.
  template <typename Condition>
  std::optional<State> next_state(Condition condition, Seconds patience) {
    if (reporter_.is_behind() && patience > ProgramReporter::kPeriod) {
      if (auto state = cell_.wait_for(topics::state, condition, ProgramReporter::kPeriod)) return state;
      reporter_.send();
    }
    return cell_.wait_for(topics::state, condition, patience);
  }

  /// Waits until the cell has come to this time. Meanwhile it answers again the instants that the cell repeats: the
  /// commands may not have arrived. False: not within the patience. Throws when the cell is another one. Returns too when it
  /// was reset; see restarted().
  bool wait_for(double due_s, Seconds patience) {
    ++waits_;
    for (;;) {
      std::uint64_t newest = seen_.sample_number;
      const auto state = next_state(
          [&](const State& s) {
            if (is_at(s, due_s) || s.epoch != epoch_ || s.cell != info_) return true;
            const bool repeated = s.sample_number > newest && s.step == seen_.step && !answers_.empty();
            newest = s.sample_number;
            if (s.step != seen_.step) seen_ = s;
            return repeated;
          },
          patience);
      if (!state) return false;
      if ((state->cell != info_ || state->epoch != epoch_) && !is_confirmed(*state)) continue;
      if (state->cell != info_)
        throw ClientError(
            ClientError::Kind::lost,
            "The server was started again, or loaded something else; the program does not go on in the "
            "middle.");
      seen_ = *state;
      std::erase_if(answers_,
                    [&](const Answer& answer) { return state->time > answer.time_s + kTimeTolerance_s; });
      if (state->epoch != epoch_ || is_at(*state, due_s)) return true;
      unsent_ = answers_.size();
      send();
    }
  }

  /// Begins again after a reset of the cell.
  bool restarted() {
    if (seen_.epoch == epoch_) return false;
    std::printf("The cell was reset; %s starts again.\n", options_.program.c_str());
    std::fflush(stdout);
    controller_.restart();
    finished_ = false;
    begin_at(State(seen_));
    return true;
  }

  /// A single sample of another scenario or epoch may be forged; the one behind it decides.
  bool is_confirmed(const State& state) {
    const auto next = cell_.wait_for(
        topics::state, [&](const State& s) { return s.sample_number > state.sample_number; }, kConfirmation);
    return !next || next->cell != info_ || next->epoch != epoch_;
  }

  /// At another pace the state of a boundary cannot be foretold from its number, and the cell does not wait. A cell that was
  /// taken out of lockstep executes what it has been sent, each command at its boundary.
  bool may_look_ahead() {
    if (answers_.empty()) in_lockstep_ = options_.lookahead > 0 && cell_.status().pace == Pace::lockstep;
    return in_lockstep_ && answers_.size() <= options_.lookahead;
  }

  /// The state of a boundary that the cell may not have come to: it is waited for when the program looks at it.
  class FutureState final : public controller::StateSource {
   public:
    FutureState(Session& session, double time_s) : session_(session), time_s_(time_s) {
      session_.foreseen_.time = time_s;
    }
    const takt_msgs::msg::CellState& read(controller::StatePart part, std::size_t) override {
      if (part == controller::StatePart::time || looked_) return session_.foreseen_;
      session_.look(time_s_);
      looked_ = true;
      return session_.foreseen_;
    }

   private:
    Session& session_;
    double time_s_;
    bool looked_ = false;
  };

  void look(double time_s) {
    if (exchanges_ == 0 || !is_at(seen_, time_s)) {
      try {
        send();
        (void)wait_for(time_s, kPatience);
        if (seen_.epoch != epoch_) throw std::runtime_error("the cell was reset");
      } catch (...) {
        // The program is left by an error of its own.
        broke_off_ = std::current_exception();
        throw;
      }
    }
    foreseen_ = seen_;
  }

  void compute_ahead(double time_s) {
    broke_off_ = nullptr;
    FutureState state(*this, time_s);
    std::exception_ptr fault;
    try {
      answer(controller_.update(state), time_s);
    } catch (...) {
      fault = std::current_exception();
    }
    if (broke_off_ != nullptr) {
      if (!restarted()) std::rethrow_exception(broke_off_);
    } else if (fault != nullptr) {
      stand_at(time_s);
      std::rethrow_exception(fault);
    } else {
      for (next_boundary_ += 1.0; time_of(next_boundary_) <= time_s + kTimeTolerance_s;
           next_boundary_ += 1.0) {
      }
    }
  }

  /// Leaves the cell where the program failed, so far as it is there.
  void stand_at(double time_s) {
    try {
      send();
      (void)wait_for(time_s, options_.client.timeout);
    } catch (const ClientError& error) {
      std::fprintf(stderr, "takt-controller: %s\n", error.what());
    }
  }

  /// Calls the program once for each boundary up to the newest state. In lockstep there is exactly one; at other paces there
  /// may be several after a delay, and the commands of the last one count.
  void compute() {
    const controller::Output* output = nullptr;
    for (; is_at(seen_, time_of(next_boundary_)); next_boundary_ += 1.0) output = &controller_.update(seen_);
    if (output != nullptr) answer(*output, seen_.time);
  }

  void answer(const controller::Output& output, double time_s) {
    finished_ = output.finished;
    reporter_.note(epoch_, time_s, finished_);
    answers_.push_back({time_s, output});
    if (++unsent_ >= kTogether) send();
    time_s_ = time_s;
    last_answer_ = Clock::now();
    if (++exchanges_ > 1) return;
    first_answer_ = last_answer_;
    first_time_s_ = time_s;
  }

  /// From the first answer on, so that neither discovery nor a pause ahead of the program counts.
  void report_speed() const {
    const double simulated_s = time_s_ - first_time_s_;
    const double wall_s = std::chrono::duration<double>(last_answer_ - first_answer_).count();
    if (exchanges_ < 2 || wall_s <= 0.0) return;
    std::printf(
        "%.3f s simulated in %.3f s, real-time factor %.1f: %llu periods, %.0f us each; %llu instants were "
        "waited "
        "for.\n",
        simulated_s, wall_s, simulated_s / wall_s, static_cast<unsigned long long>(exchanges_),
        1e6 * wall_s / static_cast<double>(exchanges_ - 1), static_cast<unsigned long long>(waits_));
  }

  void send() {
    if (unsent_ == 0) return;
    cell_.send_together([this] {
      for (std::size_t i = answers_.size() - std::exchange(unsent_, 0); i < answers_.size(); ++i)
        send_commands(answers_[i].output, answers_[i].time_s);
    });
  }
  void send_commands(const controller::Output& output, double time_s) {
    const auto used = [](const JointArray& values, std::size_t count) {
      return std::vector<double>(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(count));
    };
    for (const auto& joints : output.joints) {
      const std::size_t count = info_->robots.at(static_cast<std::size_t>(joints.robot)).joints.size();
      cell_.send_joint_command(robot_name(joints.robot), used(joints.position, count),
                               used(joints.velocity, count), time_s);
    }
    for (const auto& gripper : output.grippers)
      cell_.set_gripper(gripper_name(gripper.gripper), gripper.verb, gripper.width_m, gripper.max_force_N,
                        time_s);
    for (const auto& set_point : output.devices) {
      const auto& device = info_->devices.at(static_cast<std::size_t>(set_point.device));
      std::map<std::string, double> signals;
      for (std::size_t i = 0; i < set_point.signals.size(); ++i)
        signals[device.signals.at(static_cast<std::size_t>(set_point.signals[i])).name] = set_point.values[i];
      cell_.set_signals(device.name, signals, time_s);
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
  ProgramReporter reporter_;
  double period_s_;
  std::uint32_t epoch_ = 0;
  double next_boundary_ = 0.0;  ///< a whole number
  struct Answer {
    double time_s;  ///< of its boundary
    controller::Output output;
  };
  std::deque<Answer> answers_;          ///< to boundaries that the cell is not known to have crossed
  std::size_t unsent_ = 0;              ///< of the last answers
  State seen_;                          ///< the newest state looked at
  takt_msgs::msg::CellState foreseen_;  ///< what the program sees; its time at least is that of the boundary
  std::exception_ptr broke_off_;        ///< what ended the program's look at the cell
  bool in_lockstep_ = false;
  double time_s_ = 0.0;  ///< of the boundary answered last
  using Clock = std::chrono::steady_clock;
  std::uint64_t exchanges_ = 0;  ///< boundaries answered since the last reset
  std::uint64_t waits_ = 0;      ///< of them with a wait for the cell
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
