#include "server/simulation/implicit_integrator.h"

#include <algorithm>
#include <cmath>

#include "plant_models/mechanics/rigid_body.h"

namespace takt {

namespace {
// Both make the method L-stable. The second one is used only where I - g h A is singular with the first.
const double kGammas[] = {1.0 - std::sqrt(0.5), 1.0 + std::sqrt(0.5)};
// Twice what a body falls faster in a step of 1 ms: whoever is held or slides is far below.
constexpr double kUnforeseen_m_per_s = 0.02;
// A body whose velocity J leaves alone to within this is touched by nothing that J knows of.
constexpr double kAlone_m_per_s = 1e-9;
constexpr int kPieces = 8;
constexpr std::size_t kVelocityState = 7;  // first of the velocity of a rigid body
constexpr const char* kNoInverse =
    "the matrix of the linearly implicit step has no inverse, or its entries are not finite";

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

StaticLu make_lu(const OdeSystem& system, const std::vector<int>& states) {
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
  rate_.resize(n), k1_.resize(n), k2_.resize(n), trial_.resize(n), begin_.resize(n);
  if (is_coupled(parameters.matrix, system)) coupled_ = std::make_unique<VelocitySystem>(system);
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

void ImplicitIntegrator::linearise_coupled(OdeSystem& system, double t, std::span<const double> x) {
  system.derivatives_at_motion(t, x, k1_);
  coupled_->linearise(system, t, x, Linearisation::secant);
  system.time_derivative(t, x, rate_);
  ++statistics_.jacobians;
}

// A linear system solved exactly has k1 = f(t + h, x + h k1). What begins to press within the step is in f
// there and was not in J: the step went on as if nothing were there. Asked of bodies that J left alone: of
// those that are held or slide it knows, and what f then does beyond J is no hit.
double ImplicitIntegrator::unforeseen_m_per_s(OdeSystem& system, double t_end, double h,
                                              std::span<const double> x) {
  system.derivatives(t_end, x, k2_);
  double worst = 0.0;
  for (const std::size_t s : system.active_segments()) {
    const OdeSystem::Segment& segment = system.segments()[s];
    if (segment.model->body() < 0 || segment.count != RigidBody::kStates) continue;
    const std::size_t v = segment.begin + kVelocityState;
    double sum = 0.0, known = 0.0;
    for (std::size_t i = v; i < v + 3; ++i) {
      sum += (k2_[i] - k1_[i]) * (k2_[i] - k1_[i]);
      known += (k1_[i] - trial_[i]) * (k1_[i] - trial_[i]);
    }
    if (h * std::sqrt(known) <= kAlone_m_per_s) worst = std::max(worst, h * std::sqrt(sum));
  }
  return worst;
}

// Bounded cost: a step in which something hits is taken again in pieces, once.
bool ImplicitIntegrator::advance_stiff_pairs(OdeSystem& system, double t, double h, std::span<double> x) {
  for (const OdeSystem::Range& range : system.active_states())
    std::copy(x.begin() + static_cast<std::ptrdiff_t>(range.begin),
              x.begin() + static_cast<std::ptrdiff_t>(range.end),
              begin_.begin() + static_cast<std::ptrdiff_t>(range.begin));
  if (!step_stiff_pairs(system, t, h, x)) return false;
  if (unforeseen_m_per_s(system, t + h, h, x) <= kUnforeseen_m_per_s)
    return finish_fixed_step(system, t, h, x, 2);
  ++statistics_.rejected_steps;
  for (const OdeSystem::Range& range : system.active_states())
    for (std::size_t i = range.begin; i < range.end; ++i) x[i] = begin_[i];
  for (int piece = 0; piece < kPieces; ++piece) {
    const double at = t + piece * (h / kPieces);
    system.update_motion(at, x);
    if (!step_stiff_pairs(system, at, h / kPieces, x)) return false;
  }
  return finish_fixed_step(system, t, h, x, 2 + kPieces);
}

bool ImplicitIntegrator::step_stiff_pairs(OdeSystem& system, double t, double h, std::span<double> x) {
  linearise_coupled(system, t, x);
  ++statistics_.factorisations;
  if (!coupled_->factorise(1.0, h)) {
    ++statistics_.newton_failures;
    failure_ = kNoInverse;
    return false;
  }
  for (const OdeSystem::Range& range : system.active_states())
    for (std::size_t i = range.begin; i < range.end; ++i) {
      trial_[i] = k1_[i];
      k1_[i] += h * rate_[i];
    }
  coupled_->solve(k1_, h);
  for (const OdeSystem::Range& range : system.active_states())
    for (std::size_t i = range.begin; i < range.end; ++i) x[i] += h * k1_[i];
  return true;
}

bool ImplicitIntegrator::advance_coupled(OdeSystem& system, double t, double h, std::span<double> x) {
  linearise_coupled(system, t, x);
  double gamma = kGammas[0];
  ++statistics_.factorisations;
  if (!coupled_->factorise(1.0, gamma * h)) {
    gamma = kGammas[1];
    ++statistics_.newton_failures;
    ++statistics_.factorisations;
    if (!coupled_->factorise(1.0, gamma * h)) {
      failure_ = kNoInverse;
      return false;
    }
  }
  const std::span<const OdeSystem::Range> ranges = system.active_states();
  for (const OdeSystem::Range& range : ranges)
    for (std::size_t i = range.begin; i < range.end; ++i) k1_[i] += gamma * h * rate_[i];
  coupled_->solve(k1_, gamma * h);
  for (const OdeSystem::Range& range : ranges)
    for (std::size_t i = range.begin; i < range.end; ++i) trial_[i] = x[i] + h * k1_[i];
  system.derivatives(t + h, trial_, k2_);
  for (const OdeSystem::Range& range : ranges)
    for (std::size_t i = range.begin; i < range.end; ++i) k2_[i] -= 2.0 * k1_[i] + gamma * h * rate_[i];
  coupled_->solve(k2_, -gamma * h);
  for (const OdeSystem::Range& range : ranges)
    for (std::size_t i = range.begin; i < range.end; ++i) x[i] += h * (1.5 * k1_[i] + 0.5 * k2_[i]);
  finish_fixed_step(system, t, h, x, 2);
  return true;
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
