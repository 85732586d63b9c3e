#include "plant_models/mechanics/screw_thread.h"

#include <algorithm>
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

double ScrewTightening::angle_rad(const ScrewThread& thread, double torque_N_m) const {
  return std::max(torque_N_m - thread.driving_torque_N_m, 0.0) / stiffness_N_m_per_rad;
}

ThreadIn turn_in(const ScrewThread& thread, const ScrewTightening& tightening, double turned_rad,
                 double tight_rad, double speed_rad_per_s, double torque_limit_N_m, double duration_s) {
  ThreadIn result;
  if (torque_limit_N_m < thread.driving_torque_N_m) {
    result.torque_N_m = torque_limit_N_m;
    result.reached = true;
    return result;
  }
  const double by = speed_rad_per_s * duration_s;
  result.down_rad = std::min(by, turned_rad);
  const double left = by - result.down_rad;
  const double room = tightening.angle_rad(thread, torque_limit_N_m) - tight_rad;
  result.reached = left > 0.0 && left >= room;
  result.tight_rad = std::clamp(left, 0.0, std::max(room, 0.0));
  result.torque_N_m =
      thread.driving_torque_N_m + tightening.stiffness_N_m_per_rad * (tight_rad + result.tight_rad);
  return result;
}

}  // namespace takt
