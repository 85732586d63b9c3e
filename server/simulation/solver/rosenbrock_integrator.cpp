#include "server/simulation/solver/rosenbrock_integrator.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "plant_models/state_bytes.h"

namespace takt {

namespace {
constexpr double kInfinity = std::numeric_limits<double>::infinity();

constexpr double kFirstStep_s = 1e-4;
// PI control of the step's size (Gustafsson 1991) for an error estimate of order h^3.
constexpr double kSafety = 0.9, kProportional = 0.4 / 3.0, kIntegral = 0.7 / 3.0;
constexpr double kLeastFactor = 0.2, kMaxFactor = 4.0;
// Steps shortened for other reasons have tiny errors, which must not raise the expected error of the next
// step.
constexpr double kLeastError = 1e-2;
constexpr double kAfterNotFinite = 0.25;
// A change of mode is located to within this time, or after this many attempts.
constexpr double kLocated_s = 1e-5;
constexpr int kMaxLocating = 8;
constexpr int kMaxSwitchesAtOnce = 20;
// A whole communication step by two stages, instead of four, needs an error below one of these shares of the
// tolerance: by the difference from Euler's method, or by its change since the communication step before.
constexpr double kCalmError = 0.02, kCalmChange = 0.2;
// Communication steps that one matrix serves, that pass with a matrix of their own after a kept one was not enough, and
// by four stages after two were not.
constexpr int kKeptSteps = 20, kFreshSteps = 20, kBusySteps = 6;

// Times closer than this are one time (s, relative above 1 s).
double one_time(double t) {
  return 2e-14 * std::max(1.0, std::abs(t));
}

template <class Visit>
void for_each_active(const OdeSystem& system, const Visit& visit) {
  for (const OdeSystem::Range& range : system.active_states())
    for (std::size_t i = range.begin; i < range.end; ++i) visit(i);
}
}  // namespace

RosenbrockIntegrator::RosenbrockIntegrator(const SolverParameters& parameters, const OdeSystem& system,
                                           CalmSteps calm_steps)
    : trial_(system, parameters.tolerance, statistics_, Linearisation::tangent),
      calm_steps_(calm_steps),
      indicators_(static_cast<std::size_t>(system.indicator_count())),
      new_indicators_(indicators_),
      after_(-kInfinity),
      before_(kInfinity) {
  kept_segments_.reserve(system.segments().size());
}

void RosenbrockIntegrator::reset() {
  Integrator::reset();
  step_ = 0.0;
  last_error_ = 1.0;
  after_ = -kInfinity;
}

// The kept matrix is not saved: forget().
void RosenbrockIntegrator::save(StateWriter& out) const {
  out.put(step_), out.put(last_error_), out.put(after_), out.put(before_), out.put(restarted_);
  out.put_size(indicators_.size());
  out.put(std::span<const double>(indicators_));
}

void RosenbrockIntegrator::load(StateReader& in) {
  step_ = in.number(0.0, 1e6, "the solver's step");
  if (step_ != 0.0 && step_ < kSmallestStep_s) in.fail("the solver's step is below its smallest");
  last_error_ = in.number(kLeastError, 1e30, "the solver's last error");
  after_ = in.number(-kInfinity, kInfinity, "a corner's time");
  before_ = in.number(-kInfinity, kInfinity, "a corner's time");
  if (!(after_ <= before_)) in.fail("the corners' times are not in order");
  restarted_ = in.flag("'restarted'");
  in.expect_size(indicators_.size(), "the solver's indicators");
  for (double& indicator : indicators_) indicator = in.number(-kInfinity, kInfinity, "an indicator");
}

void RosenbrockIntegrator::next_size(double h, bool cut_short) {
  const double error = std::max(trial_.error(), 1e-9);
  const double factor = kSafety * std::pow(error, -kIntegral) * std::pow(last_error_, kProportional);
  const double proposed = h * std::clamp(factor, kLeastFactor, rejected_ ? 1.0 : kMaxFactor);
  // A step that ended for another reason does not lower the proposed size.
  step_ = std::max(cut_short ? std::max(step_, proposed) : proposed, kSmallestStep_s);
  last_error_ = std::max(trial_.error(), kLeastError);
}

void RosenbrockIntegrator::note_step(double h) {
  ++statistics_.steps;
  statistics_.largest_step_s = std::max(statistics_.largest_step_s, h);
  if (statistics_.smallest_step_s == 0.0 || h < statistics_.smallest_step_s) statistics_.smallest_step_s = h;
}

void RosenbrockIntegrator::switch_modes(OdeSystem& system, double t, std::span<double> x) {
  if (indicators_.empty()) return;
  trial_.limit_times(after_, before_);
  for (int i = 0; i < kMaxSwitchesAtOnce && system.switch_modes(trial_.clamped(t), x); ++i)
    ++statistics_.mode_switches;
  system.indicators(trial_.clamped(t), x, indicators_);
}

double RosenbrockIntegrator::mode_ends_at(OdeSystem& system, double t_end) {
  if (indicators_.empty()) return kInfinity;
  system.indicators(trial_.clamped(t_end), trial_.new_x(), new_indicators_);
  double first = kInfinity;
  for (std::size_t i = 0; i < indicators_.size(); ++i) {
    if (new_indicators_[i] >= 0.0) continue;
    // A negative initial value has no crossing: the mode was wrong from the beginning.
    first =
        std::min(first, indicators_[i] > 0.0 ? indicators_[i] / (indicators_[i] - new_indicators_[i]) : 1.0);
  }
  return first;
}

bool RosenbrockIntegrator::begin(OdeSystem& system, double t, double h, bool keeps_matrix,
                                 std::span<const double> x) {
  const bool evaluates_once = calm_steps_ == CalmSteps::two_stages && !keeps_matrix;
  if (evaluates_once ? trial_.begin_linearised(system, t, h, x) : trial_.begin(system, t, h, x)) {
    if (!evaluates_once && !keeps_matrix) trial_.linearise(system, t, x);
    return true;
  }
  failure_ = "the derivatives are not finite at t = " + std::to_string(t) + " s";
  return false;
}

bool RosenbrockIntegrator::same_models(const OdeSystem& system, double h) const {
  const auto awake = system.active_segments();
  return h == kept_h_ && std::equal(awake.begin(), awake.end(), kept_segments_.begin(), kept_segments_.end());
}

bool RosenbrockIntegrator::step_calmly(OdeSystem& system, double t, double h, bool kept,
                                       std::span<const double> x) {
  const Outcome outcome =
      kept ? trial_.two_stages_again(system, t, h, x) : trial_.two_stages(system, t, h, x);
  const bool finite = outcome != Outcome::not_finite;
  const bool follows = finite && remembers_ && same_models(system, h);
  calm_ = finite &&
          (trial_.error() <= kCalmError || (follows && trial_.error_by_change(system, x) <= kCalmChange)) &&
          mode_ends_at(system, t + h) > 1.0;
  if (calm_ || !kept) {
    remembers_ = finite;
    if (finite) trial_.remember();
    const auto awake = system.active_segments();
    kept_segments_.assign(awake.begin(), awake.end());
    kept_h_ = h;
  }
  if (calm_) {
    kept_steps_ = kept ? kept_steps_ - 1 : kKeptSteps;
    return true;
  }
  ++statistics_.rejected_steps;
  kept_steps_ = 0;
  if (kept)
    fresh_steps_ = kFreshSteps;
  else if (follows || !finite)  // the next step has this one to compare with, if it had none
    busy_steps_ = kBusySteps;
  return false;
}

bool RosenbrockIntegrator::find_step(OdeSystem& system, double t, double whole_s, double& h, bool& mode_ends,
                                     std::span<double> x) {
  trial_.limit_times(after_, before_);
  calm_ = false;
  const bool try_calmly = calm_steps_ == CalmSteps::two_stages && whole_s > 0.0 && busy_steps_ == 0;
  const bool kept = try_calmly && kept_steps_ > 0 && fresh_steps_ == 0 && same_models(system, whole_s);
  if (try_calmly && fresh_steps_ > 0) --fresh_steps_;
  if (!begin(system, t, h, kept, x)) return false;
  if (try_calmly) {
    mode_ends = false;
    if (step_calmly(system, t, whole_s, kept, x)) return true;
    if (kept) {
      if (!begin(system, t, h, false, x)) return false;
      if (step_calmly(system, t, whole_s, false, x)) return true;
    }
  }
  kept_steps_ = 0;
  if (whole_s > 0.0 && busy_steps_ > 0) --busy_steps_;
  int locating = 0;
  rejected_ = false;
  while (true) {
    const Outcome outcome = trial_.four_stages(system, t, h, x);
    const bool smallest = h <= kSmallestStep_s;
    if (outcome == Outcome::not_finite) {
      if (smallest) {
        failure_ = "no step succeeded, however small, at t = " + std::to_string(t) +
                   " s: derivatives are not finite, or the matrix has no inverse";
        return false;
      }
      ++statistics_.rejected_steps;
      rejected_ = true;
      step_ = h = std::max(kAfterNotFinite * h, kSmallestStep_s);
      continue;
    }
    if (outcome == Outcome::too_large && !smallest) {
      ++statistics_.rejected_steps;
      rejected_ = true;
      const double factor = kSafety * std::pow(trial_.error(), -1.0 / 3.0);
      step_ = h = std::max(h * std::clamp(factor, kLeastFactor, 0.9), kSmallestStep_s);
      continue;
    }
    if (outcome == Outcome::too_large) {
      ++statistics_.forced_steps;
      // Whatever its error, the step must not drive.
      trial_.set_linearisation(Linearisation::secant);
      const bool begun =
          begin(system, t, h, false, x) && trial_.four_stages(system, t, h, x) != Outcome::not_finite;
      trial_.set_linearisation(Linearisation::tangent);
      if (!begun) {
        failure_ = "no step succeeded, however small, at t = " + std::to_string(t) + " s";
        return false;
      }
    }
    const double share = mode_ends_at(system, t + h);
    mode_ends = share <= 1.0;
    const double late = (1.0 - share) * h;
    if (!mode_ends || late <= kLocated_s || smallest || ++locating > kMaxLocating) return true;
    h = std::max(share * h + 0.5 * kLocated_s, kSmallestStep_s);
  }
}

bool RosenbrockIntegrator::take_step(OdeSystem& system, double t, double h, std::span<double> x) {
  if (system.active_states().empty()) return true;
  const double end = t + h;
  if (step_ <= 0.0) step_ = std::min(kFirstStep_s, h);
  double now = t;
  if (after_ > t + one_time(t)) after_ = -kInfinity;  // the time was set back
  if (restarted_) {
    ++statistics_.restarts;
    switch_modes(system, now, x);
    last_error_ = 1.0;
    restarted_ = false;
  }
  while (true) {
    const double event = system.next_time_event(now + one_time(now));
    if (!(event > now)) {
      failure_ =
          "a plant model announced a next corner that is not after the present, t = " + std::to_string(now) +
          " s";
      return false;
    }
    before_ = std::nextafter(event, -kInfinity);
    const bool event_within = event <= end + one_time(end);
    const double stop = event_within ? std::min(event, end) : end;
    const double left = stop - now;
    if (left > one_time(stop)) {
      // Two equal steps rather than a large and a tiny one.
      double size = step_ >= left ? left : (2.0 * step_ > left ? 0.5 * left : step_);
      bool mode_ends = false;
      const bool whole = now == t && stop == end;
      if (now == t && (!whole || busy_steps_ > 0)) remembers_ = false;
      if (!find_step(system, now, whole ? h : 0.0, size, mode_ends, x)) return false;
      if (calm_) size = left;
      for_each_active(system, [&](std::size_t i) { x[i] = trial_.new_x()[i]; });
      note_step(size);
      if (!calm_) next_size(size, size < step_);
      now = size == left ? stop : now + size;
      if (mode_ends)
        switch_modes(system, now, x);
      else
        std::swap(indicators_, new_indicators_);
      if (stop - now > one_time(stop)) continue;
    }
    if (event_within) {
      after_ = event;
      before_ = kInfinity;
      ++statistics_.restarts;
      switch_modes(system, now, x);
      last_error_ = 1.0;
    }
    if (end - now <= one_time(end)) return true;
    now = stop;
  }
}

}  // namespace takt
