#include "plant_models/thermal/heated_part.h"

namespace takt {

void HeatedPart::initial_state(double* x) const {
  x[absolute_temperature] = p_.initial_K;
  x[lost] = 0.0;
}

void HeatedPart::write_motion(double, const double* x, CellMotion& motion) const {
  motion.heat[static_cast<std::size_t>(p_.body)] = {x[absolute_temperature], 0.0, false};
}

double HeatedPart::cooling_W(const double* x, const CellMotion& motion) const {
  if (motion.heat[static_cast<std::size_t>(p_.body)].enclosed) return 0.0;
  return p_.cooling_W_per_m2_K * p_.surface_m2 * (x[absolute_temperature] - p_.environment_K);
}

void HeatedPart::derivatives(double, const double* x, const CellMotion& motion, std::span<const Wrench>,
                             double* xdot) const {
  const double cooling = cooling_W(x, motion);
  const double flow = motion.heat[static_cast<std::size_t>(p_.body)].flow_W;
  xdot[absolute_temperature] = (flow - cooling) / p_.capacity_J_per_K;
  xdot[lost] = cooling;
}

void HeatedPart::state_scales(double* scales) const {
  scales[absolute_temperature] = 1.0;
  scales[lost] = p_.capacity_J_per_K;
}

void HeatedPart::set_signal(double, int, double) {}

void HeatedPart::read_signals(double, const double* x, const CellMotion& motion,
                              std::span<double> signals) const {
  signals[temperature] = x[absolute_temperature] - kZeroCelsius_K;
  signals[heat_flow] = motion.heat[static_cast<std::size_t>(p_.body)].flow_W - cooling_W(x, motion);
  signals[energy_lost] = x[lost];
}

}  // namespace takt
