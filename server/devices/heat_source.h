#pragma once
// A heat flow into a Part with a temperature that a signal gives: a heater, a cooler, the losses of a motor, whose model is
// elsewhere (an FMU, a device in Lua, a client). It is held over a step of the cell.
#include <string>

#include "server/devices/device_type.h"
#include "server/simulation/model/hashed_state.h"

namespace takt {

/// The keys of such a heat flow in a scenario.
struct ScenarioHeatSource {
  std::string part, place_of_part;
  double max_heat_W = 1e6;
};
DeviceType heat_source_type();

struct HeatSourceParameters {
  std::size_t body = 0;
};

class HeatSource final : public DeviceModel, public HashedState {
 public:
  enum Signal : int { heat, delivered, kSignals };

  explicit HeatSource(const HeatSourceParameters& parameters) : p_(parameters) {}

  int state_count() const override { return 1; }  ///< the heat delivered (J)
  void initial_state(double* x) const override { x[0] = 0.0; }
  void write_motion(double t, const double* x, CellMotion& motion) const override;
  void derivatives(double, const double*, const CellMotion&, std::span<const Wrench>,
                   double* xdot) const override {
    xdot[0] = heat_W_;
  }
  void state_scales(double* scales) const override { scales[0] = 1e3; }
  void reset() override { heat_W_ = 0.0; }
  void set_signal(double t, int signal, double value) override;
  void read_signals(double t, const double* x, const CellMotion& motion,
                    std::span<double> signals) const override;
  std::uint64_t discrete_hash() const override;
  void save(StateWriter& out) const override;
  void load(StateReader& in) override;

 private:
  HeatSourceParameters p_;
  double heat_W_ = 0.0;
};

}  // namespace takt
