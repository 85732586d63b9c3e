#include "server/simulation/solver/implicit_integrator.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace takt {

namespace {
// Both make the method L-stable. The second one is used only where I - g h A is singular with the first.
const double kGammas[] = {1.0 - std::sqrt(0.5), 1.0 + std::sqrt(0.5)};
// Of a step with stiff pairs, relative to the states and their scales.
constexpr double kTolerance = 3e-4;
constexpr double kSafety = 0.9, kLeastFactor = 0.1, kMaxFactor = 4.0;
// Beyond this error a forced step is that of Euler's method.
constexpr double kForcedError = 10.0;
// An earlier A is good while the error is below this.
constexpr double kSmallError = 0.5;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr const char* kNotFinite = "the derivatives are not finite";
constexpr const char* kNoInverse =
    "the matrix of the linearly implicit step has no inverse, or its entries are not finite";

// Times closer than this are one time (s, relative above 1 s).
double one_time(double t) {
  return 2e-14 * std::max(1.0, std::abs(t));
}

std::vector<int> states_with_entries(const OdeSystem& system) {
  std::vector<int> states;
  for (const OdeSystem::Entry& entry : system.jacobian_pattern()) {
    states.push_back(entry.row);
    states.push_back(entry.column);
  }
  std::sort(states.begin(), states.end());
  states.erase(std::unique(states.begin(), states.end()), states.end());
  return states;
}

SparseLu make_lu(const OdeSystem& system, const std::vector<int>& states) {
  const auto place = [&states](int state) {
    return static_cast<int>(std::lower_bound(states.begin(), states.end(), state) - states.begin());
  };
  std::vector<std::pair<int, int>> pattern;
  for (const OdeSystem::Entry& entry : system.jacobian_pattern())
    pattern.emplace_back(place(entry.row), place(entry.column));
  return {static_cast<int>(states.size()), pattern};
}
}  // namespace

ImplicitIntegrator::ImplicitIntegrator(const SolverParameters& parameters, const OdeSystem& system)
    : implicit_states_(states_with_entries(system)),
      lu_(make_lu(system, implicit_states_)),
      values_(system.jacobian_pattern().size()),
      right_side_(implicit_states_.size()) {
  const auto n = static_cast<std::size_t>(system.state_count());
  kept_segments_.reserve(system.segments().size());
  rate_.resize(n), k1_.resize(n), k2_.resize(n), trial_.resize(n);
  if (is_coupled(parameters.matrix, system))
    coupled_ = std::make_unique<RosenbrockStep>(system, kTolerance, statistics_, Linearisation::secant);
}

bool ImplicitIntegrator::factorise(double gamma_h) {
  ++statistics_.factorisations;
  return lu_.factorise(gamma_h, values_);
}

void ImplicitIntegrator::solve(std::vector<double>& k) {
  for (std::size_t i = 0; i < implicit_states_.size(); ++i)
    right_side_[i] = k[static_cast<std::size_t>(implicit_states_[i])];
  lu_.solve(right_side_);
  for (std::size_t i = 0; i < implicit_states_.size(); ++i)
    k[static_cast<std::size_t>(implicit_states_[i])] = right_side_[i];
}

void ImplicitIntegrator::accept(const OdeSystem& system, double h, std::span<double> x) {
  const std::vector<double>& new_x = coupled_->new_x();
  for (const OdeSystem::Range& range : system.active_states())
    for (std::size_t i = range.begin; i < range.end; ++i) x[i] = new_x[i];
  ++statistics_.steps;
  statistics_.largest_step_s = std::max(statistics_.largest_step_s, h);
  if (statistics_.smallest_step_s == 0.0 || h < statistics_.smallest_step_s) statistics_.smallest_step_s = h;
}

// Where a piece may end at most, and which corners of f its evaluations stay clear of. A corner that is
// nearer than the least piece is stepped over.
double ImplicitIntegrator::limit_piece(const OdeSystem& system, double now, double end, double least) {
  const double corner = system.next_time_event(now + one_time(now));
  const bool within = corner >= now + least && corner <= end + one_time(end);
  coupled_->limit_times(after_, within ? std::nextafter(corner, -kInfinity) : kInfinity);
  return within && corner < end - one_time(end) ? corner : end;
}

bool ImplicitIntegrator::try_piece(OdeSystem& system, double now, double& size, bool forced,
                                   std::span<const double> x) {
  using Outcome = RosenbrockStep::Outcome;
  const bool two = method_ == Method::two_stages;
  const Outcome outcome =
      two ? coupled_->two_stages(system, now, size, x) : coupled_->four_stages(system, now, size, x);
  if (outcome == Outcome::good) return true;
  const double error = coupled_->error();
  if (forced) {
    ++statistics_.forced_steps;
    return (outcome == Outcome::too_large && error <= kForcedError) ||
           coupled_->euler(system, size, x) == Outcome::good;
  }
  ++statistics_.rejected_steps;
  const double factor =
      outcome == Outcome::not_finite ? kLeastFactor : kSafety * std::pow(error, two ? -1.0 / 2 : -1.0 / 3);
  if (two) take_four_stages();
  size *= std::clamp(factor, kLeastFactor, kSafety);
  return false;
}

void ImplicitIntegrator::take_four_stages() {
  method_ = Method::four_stages;
  four_stages_left_ = kMaxStepsOfOne;
}

void ImplicitIntegrator::keep(const OdeSystem& system, double h) {
  const auto awake = system.active_segments();
  kept_segments_.assign(awake.begin(), awake.end());
  kept_h_ = h;
  steps_left_ = kMaxStepsOfOne;
}

bool ImplicitIntegrator::is_kept(const OdeSystem& system, double h) const {
  const auto awake = system.active_segments();
  return steps_left_ > 0 && h == kept_h_ &&
         std::equal(awake.begin(), awake.end(), kept_segments_.begin(), kept_segments_.end());
}

bool ImplicitIntegrator::step_again(OdeSystem& system, double t, double h, std::span<const double> x) {
  --steps_left_;
  const RosenbrockStep::Outcome outcome = method_ == Method::two_stages
                                              ? coupled_->two_stages_again(system, t, h, x)
                                              : coupled_->four_stages_again(system, t, h, x);
  if (outcome == RosenbrockStep::Outcome::good && coupled_->error() <= kSmallError) return true;
  ++statistics_.rejected_steps;
  steps_left_ = 0;
  return false;
}

bool ImplicitIntegrator::advance_stiff_pairs(OdeSystem& system, double t, double h, std::span<double> x) {
  const double end = t + h;
  double now = t, size = h;
  after_ = system.next_time_event(t - one_time(t));
  if (after_ > t + one_time(t)) after_ = -kInfinity;
  const std::uint64_t switches = statistics_.mode_switches;
  if (!coupled_->begin(system, now, size, x)) {
    failure_ = kNotFinite;
    return false;
  }
  if (method_ == Method::four_stages && four_stages_left_-- == 0) {
    method_ = Method::two_stages;
    steps_left_ = 0;
  }
  bool begun = true, linearised = false;
  int attempts_left = kMaxAttempts;
  if (limit_piece(system, now, end, h / kMaxAttempts) == end && is_kept(system, h)) {
    --attempts_left;
    if (step_again(system, now, h, x)) {
      accept(system, h, x);
      now = end;
    }
  }
  for (; now < end; --attempts_left) {
    const double least = (end - now) / attempts_left;
    const double stop = limit_piece(system, now, end, least);
    const bool forced = size <= least || attempts_left == 1;
    size = std::max(size, least);
    if (attempts_left == 1 || size > stop - now - one_time(stop)) size = stop - now;
    if (!begun && !coupled_->begin(system, now, size, x)) {
      failure_ = kNotFinite;
      return false;
    }
    if (!linearised) coupled_->linearise(system, now, x);
    begun = linearised = true;
    steps_left_ = 0;
    if (!try_piece(system, now, size, forced, x)) {
      if (!forced) continue;
      failure_ = kNoInverse;
      return false;
    }
    accept(system, size, x);
    if (now == t && now + size == end) keep(system, h);
    begun = linearised = false;
    now = size >= stop - now ? stop : now + size;
    if (now < end) take_four_stages();
    if (now == stop && stop < end) after_ = stop;
    if (forced) continue;
    size *=
        std::clamp(kSafety * std::pow(std::max(coupled_->error(), 1e-9), -1.0 / 3), kLeastFactor, kMaxFactor);
    // Two equal steps rather than a large and a tiny one.
    if (size < end - now) size = std::min(size, 0.5 * (end - now));
  }
  const bool arrived = finish(system, end, x);
  if (statistics_.mode_switches != switches) steps_left_ = 0;
  return arrived;
}

void ImplicitIntegrator::forget() {
  steps_left_ = 0;
  method_ = Method::two_stages;
}

bool ImplicitIntegrator::advance_coupled(OdeSystem& system, double t, double h, std::span<double> x) {
  steps_left_ = 0;
  if (!coupled_->begin(system, t, h, x)) {
    failure_ = kNotFinite;
    return false;
  }
  coupled_->linearise(system, t, x);
  if (coupled_->two_stages(system, t, h, x) == RosenbrockStep::Outcome::not_finite) {
    failure_ = kNoInverse;
    return false;
  }
  accept(system, h, x);
  return finish(system, t + h, x);
}

bool ImplicitIntegrator::take_step(OdeSystem& system, double t, double h, std::span<double> x) {
  if (coupled_)
    return system.has_stiff_pairs() ? advance_stiff_pairs(system, t, h, x) : advance_coupled(system, t, h, x);
  double gamma = kGammas[0];
  const bool linearised = !values_.empty();
  if (linearised) {
    system.jacobian(t, x, values_);
    system.time_derivative(t, x, rate_);
    ++statistics_.jacobians;
    if (!factorise(gamma * h)) {
      gamma = kGammas[1];
      ++statistics_.newton_failures;
      if (!factorise(gamma * h)) {
        failure_ = kNoInverse;
        return false;
      }
    }
  }
  system.derivatives_at_motion(t, x, k1_);
  if (linearised) {
    for (const int i : implicit_states_)
      k1_[static_cast<std::size_t>(i)] += gamma * h * rate_[static_cast<std::size_t>(i)];
    solve(k1_);
  }
  for (const OdeSystem::Range& range : system.active_states())
    for (std::size_t i = range.begin; i < range.end; ++i) trial_[i] = x[i] + h * k1_[i];
  system.derivatives(t + h, trial_, k2_);
  // In terms of k2 + k1, with which models without entries are Heun's method to the bit.
  if (linearised) {
    for (const int state : implicit_states_) {
      const auto i = static_cast<std::size_t>(state);
      k2_[i] -= 2.0 * k1_[i] + gamma * h * rate_[i];
    }
    solve(k2_);
    for (const int state : implicit_states_) {
      const auto i = static_cast<std::size_t>(state);
      k2_[i] += 2.0 * k1_[i];
    }
  }
  for (const OdeSystem::Range& range : system.active_states())
    for (std::size_t i = range.begin; i < range.end; ++i) x[i] += 0.5 * h * (k1_[i] + k2_[i]);
  return finish_fixed_step(system, t, h, x, 2);
}

}  // namespace takt
