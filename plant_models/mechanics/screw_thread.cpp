#include "plant_models/mechanics/screw_thread.h"

#include <numbers>

namespace takt {

double ScrewThread::whole_angle_rad() const {
  return 2.0 * std::numbers::pi * length_m / pitch_m;
}

double ScrewThread::travel_m(double angle_rad) const {
  return pitch_m * angle_rad / (2.0 * std::numbers::pi);
}

ThreadTurn turn_thread(const ScrewThread& thread, double turned_rad, double speed_rad_per_s,
                       double max_torque_N_m, double duration_s) {
  if (speed_rad_per_s == 0.0) return {};
  const double whole = thread.whole_angle_rad();
  if (max_torque_N_m < thread.driving_torque_N_m) return {0.0, max_torque_N_m, false};
  const double to = turned_rad + speed_rad_per_s * duration_s;
  if (to <= 0.0) return {-turned_rad, max_torque_N_m, false};
  // Rounding of a sum over steps does not keep it for another one.
  const bool free = to >= whole * (1.0 - 1e-12);
  return {(free ? whole : to) - turned_rad, thread.driving_torque_N_m, free};
}

}  // namespace takt
