#pragma once
// A device whose signals are plain numbers between steps: a mechanism reads the commanded ones and writes the
// reported ones (server/devices/screw_joints.h).
#include <algorithm>
#include <array>
#include <cstddef>

#include "plant_models/device_model.h"
#include "plant_models/state_bytes.h"

namespace takt {

struct SignalTableParameters {
  std::size_t count = 0;                      ///< of signals
  std::array<double, kMaxSignals> initial{};  ///< values after a reset
};

class SignalTable final : public DeviceModel {
 public:
  explicit SignalTable(const SignalTableParameters& parameters)
      : p_(parameters), values_(parameters.initial) {}

  double value(int signal) const { return values_[static_cast<std::size_t>(signal)]; }
  void report(int signal, double value) { values_[static_cast<std::size_t>(signal)] = value; }

  void write_motion(double, const double*, CellMotion&) const override {}
  void reset() override { values_ = p_.initial; }
  void set_signal(double, int signal, double value) override { report(signal, value); }
  void read_signals(double, const double*, const CellMotion&, std::span<double> signals) const override {
    std::copy_n(values_.begin(), std::min(p_.count, signals.size()), signals.begin());
  }
  std::span<const double> kept_signals() const override { return std::span(values_).first(p_.count); }
  void save(StateWriter& out) const override { out.put(std::span(values_).first(p_.count)); }
  void load(StateReader& in) override { in.numbers(std::span(values_).first(p_.count), "a signal"); }

 private:
  SignalTableParameters p_;
  std::array<double, kMaxSignals> values_;
};

class CellPlant;
/// The model of a device that was added by DeviceBuilder::add_signal_table.
SignalTable& signal_table(CellPlant& plant, int device);

}  // namespace takt
