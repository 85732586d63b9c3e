#pragma once
// A device of the cell that is neither robot nor gripper (furnace, press, screwdriver): a plant model with
// named signals. The device's description has the names, units and limits of the signals
// (CellDescription::devices); here they are numbers in that order.
#include <span>
#include <string>

#include "plant_models/plant_model.h"

namespace takt {

/// Upper bound for the signals of one device: commands and samples are fixed-size, so that no step allocates.
inline constexpr int kMaxSignals = 32;

class DeviceModel : public PlantModel {
 public:
  /// Discrete, between two steps at time t: sets a commanded signal to a value within its limits.
  virtual void set_signal(double t, int signal, double value) = 0;
  /// The values of all signals, where the model keeps them as plain numbers between steps; they then enter the hash of
  /// the state. Empty: they follow from states.
  virtual std::span<const double> kept_signals() const { return {}; }
  /// Writes the present value of every signal. `x`: the model's own segment of the state vector.
  virtual void read_signals(double t, const double* x, const CellMotion& motion,
                            std::span<double> signals) const = 0;
  /// A sentence about what went wrong since the last call, for an event; else empty. Asked between two steps.
  virtual std::string take_message() { return {}; }
};

}  // namespace takt
