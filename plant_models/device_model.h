#pragma once
// A device of the cell that is neither robot nor gripper (furnace, press, screwdriver): a plant model with
// named signals. The device's description has the names, units and limits of the signals
// (CellDescription::devices); here they are numbers in that order.
#include <span>

#include "plant_models/plant_model.h"

namespace takt {

/// Upper bound for the signals of one device: commands and samples are fixed-size, so that no step allocates.
inline constexpr int kMaxSignals = 32;

class DeviceModel : public PlantModel {
 public:
  /// Discrete, between two steps at time t: sets a commanded signal to a value within its limits.
  virtual void set_signal(double t, int signal, double value) = 0;
  /// Writes the present value of every signal. `x`: the model's own segment of the state vector.
  virtual void read_signals(double t, const double* x, const CellMotion& motion,
                            std::span<double> signals) const = 0;
};

}  // namespace takt
