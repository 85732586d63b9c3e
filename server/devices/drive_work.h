#pragma once
// Force, power and work of the drive of an axis or a belt, without losses.
#include <utility>

#include "plant_models/state_bytes.h"

namespace takt {

struct DriveWork {
  double force = 0.0;  ///< N, or N m of a rotary drive
  double power_W = 0.0, energy_J = 0.0;

  /// At the end of a step of length h.
  void take(double force_now, double speed, double h) {
    force = force_now;
    const double before_W = std::exchange(power_W, force * speed);
    energy_J += 0.5 * h * (before_W + power_W);
  }
  void save(StateWriter& out) const { out.put(force), out.put(power_W), out.put(energy_J); }
  void load(StateReader& in) {
    for (double* value : {&force, &power_W, &energy_J}) *value = in.number("the work of a drive");
  }
};

}  // namespace takt
