#include "server/simulation/rosenbrock_integrator.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "plant_models/state_bytes.h"
#include "server/simulation/rosenbrock_tableau.h"

namespace takt {

namespace {
constexpr RosenbrockForm kMethod = transformed(RosenbrockTableau{});
constexpr double kInfinity = std::numeric_limits<double>::infinity();

constexpr double kFirstStep_s = 1e-4;
// PI control of the step's size (Gustafsson 1991) for an error estimate of order h^3.
constexpr double kSafety = 0.9, kProportional = 0.4 / 3.0, kIntegral = 0.7 / 3.0;
constexpr double kLeastFactor = 0.2, kMostFactor = 4.0;
// Steps that something else keeps short have tiny errors, which must not make the next one suspicious.
constexpr double kLeastError = 1e-2;
constexpr double kAfterNotFinite = 0.25;
// A change of mode is found to within this time, or after so many attempts.
constexpr double kLocated_s = 1e-5;
constexpr int kMostLocating = 8;
constexpr int kMostSwitchesAtOnce = 20;

// Times closer than this are one time (s, relative above 1 s).
double one_time(double t) {
  return 2e-14 * std::max(1.0, std::abs(t));
}

template <class Visit>
void for_each_active(const OdeSystem& system, const Visit& visit) {
  for (const OdeSystem::Range& range : system.active_states())
    for (std::size_t i = range.begin; i < range.end; ++i) visit(i);
}

bool finite(const OdeSystem& system, std::span<const double> values) {
  bool good = true;
  for_each_active(system, [&](std::size_t i) { good = good && std::isfinite(values[i]); });
  return good;
}
}  // namespace

RosenbrockIntegrator::RosenbrockIntegrator(const SolverParameters& parameters, const OdeSystem& system)
    : linear_(system),
      tolerance_(parameters.tolerance),
      scales_(static_cast<std::size_t>(system.state_count())),
      indicators_(static_cast<std::size_t>(system.indicator_count())),
      new_indicators_(indicators_),
      after_(-kInfinity),
      before_(kInfinity) {
  system.state_scales(scales_);
  for (auto* values : {&f0_, &rate_, &work_, &new_x_, &error_, &u_[0], &u_[1], &u_[2], &u_[3]})
    values->resize(scales_.size());
}

void RosenbrockIntegrator::reset() {
  Integrator::reset();
  step_ = 0.0;
  last_error_ = 1.0;
  after_ = -kInfinity;
}

// Jacobian, stages and the matrix are made anew in every step.
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

double RosenbrockIntegrator::clamped(double t) const {
  return std::clamp(t, after_, before_);
}

bool RosenbrockIntegrator::linearise(OdeSystem& system, double t, std::span<const double> x) {
  system.derivatives(clamped(t), x, f0_);
  ++statistics_.evaluations;
  if (!finite(system, f0_)) return false;
  linear_.linearise(system, clamped(t), x, Linearisation::secant);
  system.time_derivative(clamped(t), x, rate_);
  ++statistics_.jacobians;
  return true;
}

RosenbrockIntegrator::Outcome RosenbrockIntegrator::try_step(OdeSystem& system, double t, double h,
                                                             std::span<const double> x) {
  ++statistics_.factorisations;
  if (!linear_.factorise(1.0 / (kMethod.gamma * h), 1.0)) {
    ++statistics_.newton_failures;
    return Outcome::not_finite;
  }
  for (std::size_t stage = 0; stage < RosenbrockForm::kStages; ++stage) {
    std::vector<double>& u = u_[stage];
    if (stage == 0) {
      for_each_active(system, [&](std::size_t i) { u[i] = f0_[i]; });
    } else {
      for_each_active(system, [&](std::size_t i) { work_[i] = x[i]; });
      for (std::size_t j = 0; j < stage; ++j) {
        const double a = kMethod.a[stage][j];
        for_each_active(system, [&](std::size_t i) { work_[i] += a * u_[j][i]; });
      }
      system.derivatives(clamped(t + kMethod.alpha[stage] * h), work_, u);
      ++statistics_.evaluations;
      for (std::size_t j = 0; j < stage; ++j) {
        const double c = kMethod.c[stage][j] / h;
        for_each_active(system, [&](std::size_t i) { u[i] += c * u_[j][i]; });
      }
    }
    const double share = h * kMethod.gammas[stage];
    for_each_active(system, [&](std::size_t i) { u[i] += share * rate_[i]; });
    linear_.solve(u, share);
    if (!finite(system, u)) return Outcome::not_finite;
  }
  for_each_active(system, [&](std::size_t i) {
    double change = 0.0, error = 0.0;
    for (std::size_t stage = 0; stage < RosenbrockForm::kStages; ++stage) {
      change += kMethod.m[stage] * u_[stage][i];
      error += kMethod.e[stage] * u_[stage][i];
    }
    new_x_[i] = x[i] + change;
    error_[i] = error;
  });
  new_error_ = error_of(system, x);
  if (!std::isfinite(new_error_)) return Outcome::not_finite;
  return new_error_ <= 1.0 ? Outcome::good : Outcome::too_large;
}

// The worst model counts: how many others there are in the cell must not loosen the tolerance.
double RosenbrockIntegrator::error_of(const OdeSystem& system, std::span<const double> x) const {
  double worst = 0.0;
  for (const std::size_t s : system.active_segments()) {
    const OdeSystem::Segment& segment = system.segments()[s];
    if (segment.count == 0) continue;
    double sum = 0.0;
    for (std::size_t i = segment.begin; i < segment.begin + segment.count; ++i) {
      const double size = std::max(std::abs(x[i]), std::abs(new_x_[i])) + scales_[i];
      const double e = error_[i] / (tolerance_ * size);
      sum += e * e;
    }
    const double mean = sum / static_cast<double>(segment.count);
    if (!(mean <= worst)) worst = mean;
  }
  return std::sqrt(worst);
}

void RosenbrockIntegrator::next_size(double h, bool cut_short) {
  const double factor =
      kSafety * std::pow(std::max(new_error_, 1e-9), -kIntegral) * std::pow(last_error_, kProportional);
  const double proposed = h * std::clamp(factor, kLeastFactor, rejected_ ? 1.0 : kMostFactor);
  // A step that something else ended tells nothing against the size that was meant.
  step_ = std::max(cut_short ? std::max(step_, proposed) : proposed, kSmallestStep_s);
  last_error_ = std::max(new_error_, kLeastError);
}

void RosenbrockIntegrator::note_step(double h) {
  ++statistics_.steps;
  statistics_.largest_step_s = std::max(statistics_.largest_step_s, h);
  if (statistics_.smallest_step_s == 0.0 || h < statistics_.smallest_step_s) statistics_.smallest_step_s = h;
}

void RosenbrockIntegrator::switch_modes(OdeSystem& system, double t, std::span<double> x) {
  if (indicators_.empty()) return;
  for (int i = 0; i < kMostSwitchesAtOnce && system.switch_modes(clamped(t), x); ++i)
    ++statistics_.mode_switches;
  system.indicators(clamped(t), x, indicators_);
}

double RosenbrockIntegrator::mode_ends_at(OdeSystem& system, double t_end) {
  if (indicators_.empty()) return kInfinity;
  system.indicators(clamped(t_end), new_x_, new_indicators_);
  double first = kInfinity;
  for (std::size_t i = 0; i < indicators_.size(); ++i) {
    if (new_indicators_[i] >= 0.0) continue;
    // One that was negative before has no crossing: the mode was wrong from the beginning.
    first =
        std::min(first, indicators_[i] > 0.0 ? indicators_[i] / (indicators_[i] - new_indicators_[i]) : 1.0);
  }
  return first;
}

bool RosenbrockIntegrator::find_step(OdeSystem& system, double t, double& h, bool& mode_ends,
                                     std::span<double> x) {
  if (!linearise(system, t, x)) {
    failure_ = "the derivatives are not finite at t = " + std::to_string(t) + " s";
    return false;
  }
  int locating = 0;
  rejected_ = false;
  while (true) {
    const Outcome outcome = try_step(system, t, h, x);
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
      const double factor = kSafety * std::pow(new_error_, -1.0 / 3.0);
      step_ = h = std::max(h * std::clamp(factor, kLeastFactor, 0.9), kSmallestStep_s);
      continue;
    }
    if (outcome == Outcome::too_large) ++statistics_.forced_steps;
    const double share = mode_ends_at(system, t + h);
    mode_ends = share <= 1.0;
    const double late = (1.0 - share) * h;
    if (!mode_ends || late <= kLocated_s || smallest || ++locating > kMostLocating) return true;
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
          "a plant model told a next known corner that is not after the present, t = " + std::to_string(now) +
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
      if (!find_step(system, now, size, mode_ends, x)) return false;
      for_each_active(system, [&](std::size_t i) { x[i] = new_x_[i]; });
      note_step(size);
      next_size(size, size < step_);
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
