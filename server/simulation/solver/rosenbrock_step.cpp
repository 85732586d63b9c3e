#include "server/simulation/solver/rosenbrock_step.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/simulation/solver/rosenbrock_tableau.h"

namespace takt {

namespace {
constexpr RosenbrockForm kMethod = transformed(RosenbrockTableau{});
// Both make ROS2 L-stable. The second one is used only where I - g h A is singular with the first.
const double kGammas[] = {1.0 - std::sqrt(0.5), 1.0 + std::sqrt(0.5)};

// Share of the difference between ROS2 and Euler's method used as error estimate: the difference is Euler's
// error; that of ROS2 is of the next order.
constexpr double kOfEuler = 0.1;
// Share of the change of that difference from one step to the next. The difference is h^2/2 times the second
// derivative, its change h^3/2 times the third one, and h^3/6 times that more than the error of ROS2.
constexpr double kOfChange = 1.0 / 3.0;
// The methods with bounded cost, which have the secant of friction, judge Parts by scales of 0.1 m and 1 m/s. With a looser
// weight of rotations Parts slide 2 % off the closed form (BoundedSolver.*).
constexpr double kLooseness = 20.0, kMostRotation_rad_per_s = 1.0;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

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

RosenbrockStep::RosenbrockStep(const OdeSystem& system, double tolerance, SolverStatistics& statistics,
                               Linearisation of_friction)
    : linear_(system),
      tolerance_(tolerance),
      statistics_(statistics),
      of_friction_(of_friction),
      scales_(of_friction == Linearisation::secant ? ErrorScales(system, kLooseness, kMostRotation_rad_per_s)
                                                   : ErrorScales(system, 1.0, kInfinity)) {
  for (auto* values :
       {&f0_, &f1_, &rate_, &work_, &new_x_, &errors_, &remembered_, &u_[0], &u_[1], &u_[2], &u_[3]})
    values->resize(scales_.count());
}

double RosenbrockStep::clamped(double t) const {
  return std::clamp(t, after_, before_);
}

bool RosenbrockStep::begin(OdeSystem& system, double t, double h, std::span<const double> x) {
  system.update_motion(clamped(t), x);
  system.hold_contacts(h);
  system.derivatives_at_motion(clamped(t), x, f0_);
  return take_derivatives(system, t, x);
}

bool RosenbrockStep::take_derivatives(OdeSystem& system, double t, std::span<const double> x) {
  ++statistics_.evaluations;
  if (!finite(system, f0_)) return false;
  system.note_peaks();
  system.time_derivative(clamped(t), x, rate_);
  return true;
}

bool RosenbrockStep::begin_linearised(OdeSystem& system, double t, double h, std::span<const double> x) {
  system.update_motion(clamped(t), x);
  system.hold_contacts(h);
  linear_.linearise_pairs(system, of_friction_);
  system.derivatives_at_motion(clamped(t), x, f0_);
  if (!take_derivatives(system, t, x)) return false;
  linear_.linearise_models(system, clamped(t), x);
  ++statistics_.jacobians;
  return true;
}

void RosenbrockStep::linearise(OdeSystem& system, double t, std::span<const double> x) {
  linear_.linearise(system, clamped(t), x, of_friction_);
  ++statistics_.jacobians;
}

bool RosenbrockStep::factorise(double a, double b) {
  ++statistics_.factorisations;
  if (linear_.factorise(a, b)) return true;
  ++statistics_.newton_failures;
  return false;
}

RosenbrockStep::Outcome RosenbrockStep::four_stages(OdeSystem& system, double t, double h,
                                                    std::span<const double> x) {
  if (!factorise(1.0 / (kMethod.gamma * h), 1.0)) return Outcome::not_finite;
  return four_stages_again(system, t, h, x);
}

RosenbrockStep::Outcome RosenbrockStep::four_stages_again(OdeSystem& system, double t, double h,
                                                          std::span<const double> x) {
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
      if (stage + 1 == RosenbrockForm::kStages)
        for_each_active(system, [&](std::size_t i) { f1_[i] = u[i]; });
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
    errors_[i] = error;
  });
  return judge(system, x);
}

RosenbrockStep::Outcome RosenbrockStep::two_stages(OdeSystem& system, double t, double h,
                                                   std::span<const double> x) {
  gamma_ = kGammas[0];
  if (!factorise(1.0, gamma_ * h)) {
    gamma_ = kGammas[1];
    if (!factorise(1.0, gamma_ * h)) return Outcome::not_finite;
  }
  return two_stages_again(system, t, h, x);
}

RosenbrockStep::Outcome RosenbrockStep::two_stages_again(OdeSystem& system, double t, double h,
                                                         std::span<const double> x) {
  const double gamma = gamma_;
  std::vector<double>&k1 = u_[0], &k2 = u_[1];
  for_each_active(system, [&](std::size_t i) { k1[i] = f0_[i] + gamma * h * rate_[i]; });
  linear_.solve(k1, gamma * h);
  if (!finite(system, k1)) return Outcome::not_finite;
  for_each_active(system, [&](std::size_t i) { work_[i] = x[i] + h * k1[i]; });
  system.derivatives(clamped(t + h), work_, k2);
  ++statistics_.evaluations;
  for_each_active(system, [&](std::size_t i) { k2[i] -= 2.0 * k1[i] + gamma * h * rate_[i]; });
  linear_.solve(k2, -gamma * h);
  for_each_active(system, [&](std::size_t i) {
    new_x_[i] = x[i] + h * (1.5 * k1[i] + 0.5 * k2[i]);
    errors_[i] = kOfEuler * 0.5 * h * (k1[i] + k2[i]);
  });
  return judge(system, x);
}

RosenbrockStep::Outcome RosenbrockStep::euler(OdeSystem& system, double h, std::span<const double> x) {
  if (!factorise(1.0, h)) return Outcome::not_finite;
  std::vector<double>& k = u_[0];
  for_each_active(system, [&](std::size_t i) { k[i] = f0_[i] + h * rate_[i]; });
  linear_.solve(k, h);
  for_each_active(system, [&](std::size_t i) { new_x_[i] = x[i] + h * k[i]; });
  return finite(system, new_x_) ? Outcome::good : Outcome::not_finite;
}

RosenbrockStep::Outcome RosenbrockStep::judge(const OdeSystem& system, std::span<const double> x) {
  error_ = error_of(system, x, errors_);
  if (!std::isfinite(error_)) return Outcome::not_finite;
  return error_ <= 1.0 ? Outcome::good : Outcome::too_large;
}

void RosenbrockStep::find_change(const OdeSystem& system) {
  for_each_active(system,
                  [&](std::size_t i) { u_[2][i] = kOfChange / kOfEuler * (errors_[i] - remembered_[i]); });
}

void RosenbrockStep::find_defect(OdeSystem& system, double t, double h) {
  const std::vector<double>&k1 = u_[0], &k2 = u_[1];
  std::vector<double>& defect = u_[3];
  system.derivatives(clamped(t + h), new_x_, defect);
  ++statistics_.evaluations;
  // Of smooth motion the rate is k1 at t + gamma h and 2 k1 + k2 at t + (1 - gamma) h.
  const double steps = (1.0 - gamma_) / (1.0 - 2.0 * gamma_);
  for_each_active(system, [&](std::size_t i) { defect[i] -= k1[i] + steps * (k1[i] + k2[i]); });
  linear_.solve(defect);
  for_each_active(system, [&](std::size_t i) { defect[i] *= gamma_ * h; });
}

double RosenbrockStep::bend_of(const OdeSystem& system, std::size_t segment, double h,
                               std::span<const double> x) {
  const OdeSystem::Segment& of = system.segments()[segment];
  for (std::size_t i = of.begin; i < of.begin + of.count; ++i) u_[0][i] = 0.125 * h * (f0_[i] - f1_[i]);
  return error_of(system, segment, x, u_[0]);
}

void RosenbrockStep::remember() {
  remembered_ = errors_;
}

// The worst model counts: the number of other models in the cell must not loosen the tolerance.
double RosenbrockStep::error_of(const OdeSystem& system, std::span<const double> x,
                                std::span<const double> errors) const {
  double worst = 0.0;
  for (const std::size_t s : system.active_segments()) {
    const double error = error_of(system, s, x, errors);
    if (!(error <= worst)) worst = error;
  }
  return worst;
}

double RosenbrockStep::error_of(const OdeSystem& system, std::size_t segment, std::span<const double> x,
                                std::span<const double> errors) const {
  const std::size_t begin = system.segments()[segment].begin, count = system.segments()[segment].count;
  if (count == 0) return 0.0;
  double sum = 0.0;
  for (std::size_t i = begin; i < begin + count; ++i) {
    const double allowed = scales_.allowed(i, std::max(std::abs(x[i]), std::abs(new_x_[i])));
    const double e = errors[i] / (tolerance_ * allowed);
    sum += e * e;
  }
  return std::sqrt(sum / static_cast<double>(count));
}

}  // namespace takt
