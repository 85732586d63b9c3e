#pragma once
// A Part that has a temperature: one heat capacity, uniform in itself, kept for as long as the Part lives,
// wherever it is carried. Heat flows into it from whatever acts on it (CellMotion::heat); outside of such
// things it may cool to its surroundings:
//   C dT/dt = sum of the flows - h A (T - T_environment)     (the last term where it is not enclosed)
// Temperatures are absolute (K); signals are in degrees Celsius, as people read them.
#include <optional>

#include "server/devices/device_type.h"

namespace takt {

inline constexpr double kZeroCelsius_K = 273.15;
constexpr double kelvin(double degC) {
  return degC + kZeroCelsius_K;
}

/// What a scenario says of the heat of a Part.
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
  double cooling_W_per_m2_K = 0.0;  ///< to the surroundings, where nothing encloses it; 0: none
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
