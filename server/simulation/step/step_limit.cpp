#include "server/simulation/step/step_limit.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>

#include "idl/common/text.h"

namespace takt {

namespace {
constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Above this share of the limit, motion settles only after many steps: the block assembly ends 0.02 mm off at
// 0.94, but exactly at 0.86.
constexpr double kComfortable = 0.87;

bool has_limit(const SolverParameters& solver) {
  return solver_is_explicit(solver.name) ||
         (solver.name == "implicit" && solver.matrix != SystemMatrix::coupled);
}

double growth(const std::string& solver, std::complex<double> z) {
  std::complex<double> sum = 1.0 + z + 0.5 * z * z;
  if (solver == "rk4") sum += z * z * z / 6.0 + z * z * z * z / 24.0;
  return std::abs(sum);
}

std::string milliseconds(double seconds) {
  return number_text(1e3 * seconds, 3) + " ms";
}
}  // namespace

double longest_stable_step_s(const SolverParameters& solver, double stiffness_per_s2, double damping_per_s) {
  if (!has_limit(solver) || !(stiffness_per_s2 > 0.0)) return kInfinity;
  const std::complex<double> root =
      std::sqrt(std::complex<double>(0.25 * damping_per_s * damping_per_s - stiffness_per_s2));
  const std::complex<double> poles[] = {-0.5 * damping_per_s + root, -0.5 * damping_per_s - root};
  const auto stable = [&](double h) {
    return std::all_of(std::begin(poles), std::end(poles), [&](std::complex<double> pole) {
      return growth(solver.name, h * pole) <= 1.0 + 1e-12;
    });
  };
  double good = 0.0, bad = 4.0 / std::abs(poles[1]);
  while (bad - good > 1e-9 * bad) {
    const double middle = 0.5 * (good + bad);
    (stable(middle) ? good : bad) = middle;
  }
  return good;
}

StepLimit substitute_step_limit(const CellModel& cell, const SolverParameters& solver) {
  StepLimit limit{kInfinity, ""};
  for (const Component& c : cell.components) {
    if (c.type != ComponentType::part || !(c.mass_kg > 0.0)) continue;
    const double k = c.substitute.k_tr_N_per_m / c.mass_kg, d = c.substitute.d_tr_N_s_per_m / c.mass_kg;
    const double alone = longest_stable_step_s(solver, k, d);
    if (alone < limit.single_s) limit.single_s = alone, limit.part = c.name;
  }
  return limit;
}

std::string step_remark(const CellModel& cell, bool dynamic, bool& refused) {
  refused = false;
  const SolverParameters& solver = dynamic && cell.dynamics_solver ? *cell.dynamics_solver : cell.solver;
  const StepLimit limit = substitute_step_limit(cell, solver);
  const double h = solver.step_s > 0.0 ? std::min(solver.step_s, cell.step_s) : cell.step_s;
  const auto found = [&] { return "solver.step_s: found " + milliseconds(h) + " with " + solver.name; };
  const std::string remedy = "; choose a shorter step or solver.method: rosenbrock, which has no such limit";
  if (h > limit.single_s) {
    refused = true;
    return found() + "; allowed: at most " + milliseconds(limit.single_s) +
           ", beyond which the substitute force that holds " + limit.part +
           " makes it swing up (2 / w, w = sqrt(g / allowed_position_error_m))" + remedy;
  }
  if (h > kComfortable * limit.single_s)
    return found() + " is close to its limit of " + milliseconds(limit.single_s) + " for " + limit.part +
           ": what it places settles slowly, and may be some 0.01 mm off" + remedy;
  return "";
}

}  // namespace takt
