#pragma once
// A Part with a temperature: one heat capacity with uniform temperature, kept for the Part's whole life,
// wherever it is carried. Other models (a furnace) give it heat (CellMotion::heat); outside of them it may
// cool to its surroundings:
//   C dT/dt = sum of the flows - h A (T - T_environment)     (the last term if it is not enclosed)
// Temperatures are absolute (K); signals are in degrees Celsius, for users.
#include <optional>

#include "server/devices/device_type.h"

namespace takt {

inline constexpr double kZeroCelsius_K = 273.15;
constexpr double kelvin(double degC) {
  return degC + kZeroCelsius_K;
}

/// The keys of the heat of a Part in a scenario.
struct ScenarioHeat {
  double specific_heat_J_per_kg_K = 0.0;
  std::optional<double> temperature_degC;
  double emissivity = 0.0;
  std::optional<double> surface_m2;
  double cooling_W_per_m2_K = 0.0;
};
DeviceType heated_part_type();

struct HeatedPartParameters {
  int body = -1;
  double capacity_J_per_K = 0.0;
  double initial_K = 293.15;
  double environment_K = 293.15;
  double surface_m2 = 0.0;          ///< exposed to air
  double cooling_W_per_m2_K = 0.0;  ///< to the surroundings, if it is not enclosed; 0: without cooling
};

class HeatedPart final : public DeviceModel {
 public:
  enum Signal : int { temperature, heat_flow, energy_lost, kSignals };
  enum State : int { absolute_temperature, lost, kStates };

  explicit HeatedPart(const HeatedPartParameters& parameters) : p_(parameters) {}

  int state_count() const override { return kStates; }
  void initial_state(double* x) const override;
  void write_motion(double t, const double* x, CellMotion& motion) const override;
  void derivatives(double t, const double* x, const CellMotion& motion, std::span<const Wrench> wrenches,
                   double* xdot) const override;
  void state_scales(double* scales) const override;
  void set_signal(double t, int signal, double value) override;
  void read_signals(double t, const double* x, const CellMotion& motion,
                    std::span<double> signals) const override;

 private:
  double cooling_W(const double* x, const CellMotion& motion) const;

  HeatedPartParameters p_;
};

}  // namespace takt
