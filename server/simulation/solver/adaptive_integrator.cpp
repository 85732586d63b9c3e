#include "server/simulation/solver/adaptive_integrator.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

namespace takt {

namespace {
// Times closer than this are one time (s, relative above 1 s): a hundred times the rounding of t.
double one_time(double t) {
  return 2e-14 * std::max(1.0, std::abs(t));
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kMaxSteps = 50'000;       // per communication step
constexpr int kMaxAttempts = 40;        // restarts after a failure, per communication step
constexpr int kMaxAttemptsHere = 5;     // without any step between
constexpr int kMaxEvents = 2'000;       // per communication step
constexpr int kMaxEventsHere = 30;      // at one time
constexpr int kMaxSwitchesAtOnce = 20;  // until the modes agree with the state

bool all_finite(std::span<const double> values) {
  return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
}

std::string seconds(double t) {
  return std::to_string(t) + " s";
}
}  // namespace

AdaptiveProblem::AdaptiveProblem(const OdeSystem& system, double tolerance, SystemMatrix matrix)
    : tolerance_(tolerance),
      earliest_(-kInfinity),
      latest_(kInfinity),
      indicator_count_(system.indicator_count()),
      scales_(system, 1.0, kInfinity),
      work_(scales_.count()),
      f_([this](double t, const double* x, double* xdot) { return derivatives(t, x, xdot); }) {
  if (is_coupled(matrix, system))
    coupled_ = std::make_unique<VelocitySystem>(system);
  else
    jacobian_ = std::make_unique<SystemJacobian>(system);
}

void AdaptiveProblem::error_weights(const double* x, double* weights) const {
  for (std::size_t i = 0; i < scales_.count(); ++i)
    weights[i] = 1.0 / (tolerance_ * scales_.allowed(i, std::abs(x[i])));
}

double AdaptiveProblem::error_norm(const double* errors, const double* weights) const {
  double worst = 0.0;
  for (const OdeSystem::Segment& segment : system_->segments()) {
    if (segment.count == 0) continue;
    double sum = 0.0;
    for (std::size_t i = segment.begin; i < segment.begin + segment.count; ++i) {
      const double e = errors[i] * weights[i];
      sum += e * e;
    }
    const double mean = sum / static_cast<double>(segment.count);
    if (!(mean <= worst)) worst = mean;  // NaN too
  }
  return std::sqrt(worst);
}

void AdaptiveProblem::find_groups(double t, const double* x) {
  if (jacobian_) jacobian_->find_groups(*system_, t, x, f_);
}

bool AdaptiveProblem::derivatives(double t, const double* x, double* xdot) {
  ++evaluations;
  const std::size_t n = scales_.count();
  try {
    system_->derivatives(std::clamp(t, earliest_, latest_), {x, n}, {xdot, n});
  } catch (const std::exception& error) {
    thrown_ = error.what();
    return false;
  }
  return all_finite({xdot, n});
}

bool AdaptiveProblem::indicators(double t, const double* x, double* g) {
  const std::span<double> values(g, static_cast<std::size_t>(indicator_count_));
  try {
    system_->indicators(std::clamp(t, earliest_, latest_), {x, scales_.count()}, values);
  } catch (const std::exception& error) {
    thrown_ = error.what();
    return false;
  }
  return all_finite(values);
}

void AdaptiveProblem::note_peaks(double t, const double* x) {
  if (system_->watches_peaks() && derivatives(t, x, work_.data())) system_->note_peaks();
}

bool AdaptiveProblem::evaluate_jacobian(double t, const double* x, const double* f0) {
  ++jacobians;
  if (jacobian_) return jacobian_->evaluate(t, x, f0, f_);
  // Motion and wrenches may be those of another trial.
  if (!derivatives(t, x, work_.data())) return false;
  coupled_->linearise(*system_, std::clamp(t, earliest_, latest_), {x, scales_.count()},
                      Linearisation::tangent);
  return true;
}

bool AdaptiveProblem::factorise(double a, double b) {
  ++factorisations;
  return jacobian_ ? jacobian_->factorise(a, b) : coupled_->factorise(a, b);
}

void AdaptiveProblem::solve(double* b) {
  if (jacobian_)
    jacobian_->solve(b);
  else
    coupled_->solve({b, scales_.count()});
}

AdaptiveIntegrator::AdaptiveIntegrator(const SolverParameters& parameters, const OdeSystem& system)
    : problem_(system, parameters.tolerance, parameters.matrix),
      method_(system.state_count() > 0 ? make_adaptive_method(parameters.name, problem_) : nullptr),
      indicators_(static_cast<std::size_t>(system.indicator_count())),
      after_(-kInfinity) {}

void AdaptiveIntegrator::count() {
  const AdaptiveMethod::Counts now = method_->counts();
  const auto add = [](std::uint64_t& total, long value, long counted) {
    if (value > counted) total += static_cast<std::uint64_t>(value - counted);
  };
  add(statistics_.steps, now.steps, counted_.steps);
  add(statistics_.rejected_steps, now.rejected, counted_.rejected);
  add(statistics_.newton_iterations, now.newton_iterations, counted_.newton_iterations);
  add(statistics_.newton_failures, now.newton_failures, counted_.newton_failures);
  counted_ = now;
  statistics_.evaluations += problem_.evaluations;
  statistics_.jacobians += problem_.jacobians;
  statistics_.factorisations += problem_.factorisations;
  problem_.evaluations = problem_.jacobians = problem_.factorisations = 0;
}

bool AdaptiveIntegrator::start(double t, std::span<const double> x, double first_step_s) {
  count();
  counted_ = {};
  ++statistics_.restarts;
  t_ = t;
  return method_->start(t, x, first_step_s);
}

bool AdaptiveIntegrator::fail(double t, const std::string& reason) {
  count();
  restart_pending_ = true;
  failure_ = reason + " at t = " + seconds(t);
  if (!problem_.message().empty()) failure_ += " (" + problem_.message() + ")";
  return false;
}

// The state was accepted at t_: from there with smaller and smaller steps.
bool AdaptiveIntegrator::recover(double t, double stop, std::span<double> x) {
  while (true) {
    if (!problem_.thrown().empty()) {
      problem_.clear_message();
      return fail(t, "a plant model could not be evaluated: " + problem_.thrown());
    }
    if (++attempts_ > kMaxAttempts || ++attempts_here_ > kMaxAttemptsHere)
      return fail(t, "no step succeeded, however small,");
    const double first_step = (stop - t) * std::pow(10.0, -2.0 * attempts_here_);
    if (start(t, x, std::max(first_step, 10.0 * one_time(t)))) return true;
  }
}

bool AdaptiveIntegrator::take_state(double t_before, double t, std::span<double> x) {
  const std::span<const double> state = method_->state();
  if (!all_finite(state)) return false;
  std::copy(state.begin(), state.end(), x.begin());
  t_ = t;
  attempts_here_ = 0;
  if (t > t_before) {
    const double h = method_->last_step_s();
    statistics_.largest_step_s = std::max(statistics_.largest_step_s, h);
    if (statistics_.smallest_step_s == 0.0 || h < statistics_.smallest_step_s)
      statistics_.smallest_step_s = h;
  }
  return true;
}

bool AdaptiveIntegrator::switch_modes(OdeSystem& system, double t, std::span<double> x, bool& changed) {
  changed = false;
  for (int i = 0; i < kMaxSwitchesAtOnce && system.switch_modes(t, x); ++i) {
    changed = true;
    ++statistics_.mode_switches;
  }
  if (all_finite(x)) return true;
  problem_.clear_message();
  return fail(t, "a plant model switched its mode to a state that is not finite,");
}

bool AdaptiveIntegrator::note_event(double t) {
  events_here_ = std::abs(t - last_event_) <= one_time(t) ? events_here_ + 1 : 1;
  last_event_ = t;
  if (++events_ <= kMaxEvents && events_here_ <= kMaxEventsHere) return true;
  problem_.clear_message();
  return fail(t, "the modes of the plant models switch without end");
}

// A mode that does not hold although no indicator crossed zero: it was wrong from the beginning.
bool AdaptiveIntegrator::check_modes(double t, std::span<const double> x, bool& wrong) {
  wrong = false;
  if (indicators_.empty()) return true;
  if (!problem_.indicators(t, x.data(), indicators_.data())) {
    problem_.clear_message();
    return fail(t, problem_.thrown().empty() ? "an indicator of a plant model's mode is not finite"
                                             : "a plant model could not be evaluated: " + problem_.thrown());
  }
  wrong = std::any_of(indicators_.begin(), indicators_.end(), [](double g) { return g < 0.0; });
  return true;
}

bool AdaptiveIntegrator::take_step(OdeSystem& system, double t, double h, std::span<double> x) {
  if (method_ == nullptr) return true;
  problem_.use(system);
  problem_.forget_errors();
  steps_ = attempts_ = attempts_here_ = events_ = events_here_ = 0;
  last_event_ = -kInfinity;
  const double end = t + h;
  const bool elsewhere = std::abs(t - t_) > one_time(t) ||
                         std::memcmp(x.data(), method_->state().data(), x.size() * sizeof(double)) != 0;
  if (elsewhere) after_ = -kInfinity;
  problem_.limit_times(after_, kInfinity);
  bool changed = false;
  if (restart_pending_ || elsewhere) {
    problem_.find_groups(t, x.data());
    if (!switch_modes(system, t, x, changed)) return false;
    if (!start(t, x, 0.0) && !recover(t, end, x)) return false;
    restart_pending_ = false;
  }
  while (true) {
    const double event = system.next_time_event(t_ + one_time(t_));
    if (!(event > t_)) {
      problem_.clear_message();
      return fail(t_, "a plant model announced a next corner that is not after the present,");
    }
    problem_.limit_times(after_, std::nextafter(event, -kInfinity));
    const bool event_within = event < end - one_time(end);
    const double stop = event_within ? event : end;
    if (stop - t_ > one_time(stop)) {
      if (++steps_ > kMaxSteps) {
        problem_.clear_message();
        return fail(t_, "more than " + std::to_string(kMaxSteps) + " steps within one communication step");
      }
      const double before = t_;
      double reached = t_;
      const AdaptiveMethod::Outcome outcome = method_->step(stop, reached);
      if (outcome == AdaptiveMethod::Outcome::failed || !take_state(before, reached, x)) {
        if (!recover(before, stop, x)) return false;
        continue;
      }
      if (outcome == AdaptiveMethod::Outcome::crossing) {
        if (!note_event(t_)) return false;
        if (!switch_modes(system, t_, x, changed)) return false;
        if (changed && !start(t_, x, 0.0) && !recover(t_, stop, x)) return false;
        continue;
      }
      if (!check_modes(t_, x, changed)) return false;
      if (changed && !switch_modes(system, t_, x, changed)) return false;
      if (changed) {
        if (!note_event(t_)) return false;
        if (!start(t_, x, 0.0) && !recover(t_, stop, x)) return false;
        continue;
      }
      if (stop - t_ > one_time(stop)) {
        problem_.note_peaks(t_, x.data());
        continue;
      }
    }
    if (!event_within) {
      t_ = end;
      if (event <= end + one_time(end)) {
        after_ = event;
        restart_pending_ = true;
      }
      problem_.limit_times(after_, kInfinity);
      count();
      return true;
    }
    t_ = after_ = event;
    problem_.limit_times(after_, kInfinity);
    if (!note_event(t_)) return false;
    if (!switch_modes(system, t_, x, changed)) return false;
    if (!start(t_, x, 0.0) && !recover(t_, end, x)) return false;
  }
}

}  // namespace takt
