#pragma once
// A small device for tests: a chamber whose temperature follows a set point, theta' = (set - theta) / tau.
// A command also switches a lamp, which has no states.
#include "plant_models/device_model.h"
#include "plant_models/state_bytes.h"
#include "server/simulation/model/cell_model.h"

namespace takt::test {

class WarmChamber final : public DeviceModel {
 public:
  static constexpr double kTau_s = 0.5, kAmbient_C = 20.0;
  enum Signal { set_point, lamp, temperature };

  int state_count() const override { return 1; }
  void initial_state(double* x) const override { x[0] = kAmbient_C; }
  void write_motion(double, const double*, CellMotion&) const override {}
  void derivatives(double, const double* x, const CellMotion&, std::span<const Wrench>,
                   double* xdot) const override {
    xdot[0] = (set_point_ - x[0]) / kTau_s;
  }
  void set_signal(double, int signal, double value) override {
    (signal == set_point ? set_point_ : lamp_) = value;
  }
  void read_signals(double, const double* x, const CellMotion&, std::span<double> signals) const override {
    signals[set_point] = set_point_;
    signals[lamp] = lamp_;
    signals[temperature] = x[0];
  }
  void save(StateWriter& out) const override { out.put(set_point_), out.put(lamp_); }
  void load(StateReader& in) override {
    set_point_ = in.number("the set point");
    lamp_ = in.number("the lamp");
  }

 private:
  double set_point_ = kAmbient_C, lamp_ = 0.0;
};

/// Adds the chamber to a cell, as its first device.
inline void add_chamber(CellModel& cell, const std::string& name = "Chamber") {
  cell.auxiliary_models.push_back({name, [] { return std::make_unique<WarmChamber>(); },
                                   static_cast<int>(cell.description.devices.size())});
  cell.description.devices.push_back({name,
                                      {{"set_point", "C", true, 20.0, 300.0},
                                       {"lamp", "", true, 0.0, 1.0},
                                       {"temperature", "C", false, 0.0, 0.0}}});
}

/// Draws what its signal says, and counts it.
class Heater final : public DeviceModel {
 public:
  enum Signal { power, energy };

  int state_count() const override { return 1; }
  void initial_state(double* x) const override { x[0] = 0.0; }
  void write_motion(double, const double*, CellMotion&) const override {}
  void derivatives(double, const double*, const CellMotion&, std::span<const Wrench>,
                   double* xdot) const override {
    xdot[0] = power_W_;
  }
  void set_signal(double, int, double value) override { power_W_ = value; }
  void read_signals(double, const double* x, const CellMotion&, std::span<double> signals) const override {
    signals[power] = power_W_;
    signals[energy] = x[0];
  }
  void save(StateWriter& out) const override { out.put(power_W_); }
  void load(StateReader& in) override { power_W_ = in.number("the power"); }

 private:
  double power_W_ = 650.0;
};

inline void add_heater(CellModel& cell, const std::string& name = "Heater") {
  cell.auxiliary_models.push_back(
      {name, [] { return std::make_unique<Heater>(); }, static_cast<int>(cell.description.devices.size())});
  cell.description.devices.push_back(
      {name, {{"power", "W", true, 0.0, 1000.0}, {"energy", "J", false, 0.0, 0.0}}});
}

}  // namespace takt::test
