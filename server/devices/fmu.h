#pragma once
// A co-simulation FMU (FMI 2.0 and 3.0) as a device. Its inputs are commanded signals, its outputs reported ones, and
// `failed` is 1 after a failure: the outputs are then held until a reset.
//
// The FMU steps between the steps of the cell, never in the right-hand side. At t = k H (H: its step, a whole multiple of the
// cell's) it takes the inputs that apply at t and advances to t + H; from t + H on the device reports its outputs. So outputs
// never come from the future, and a recording shows what any other master of the FMU gets.
#include <optional>
#include <string>
#include <vector>

#include "server/devices/device_type.h"
#include "server/devices/fmu_link.h"
#include "server/simulation/model/hashed_state.h"

namespace takt {

/// The keys of an FMU in a scenario.
struct ScenarioFmu {
  FmuRequest request;
  std::optional<double> step_s;
};
DeviceType fmu_type();
void build(const ScenarioFmu& s, DeviceBuilder& b);

struct FmuParameters {
  FmuOffer offer;
  double cell_step_s = 0.001;
  int cell_steps = 1;  ///< of one step of the FMU
};

class FmuDevice final : public DeviceModel, public HashedState {
 public:
  explicit FmuDevice(const FmuParameters& parameters);

  void write_motion(double, const double*, CellMotion&) const override {}
  bool decide(double t, double* x, const CellMotion& motion) override;
  void reset() override;
  void set_signal(double t, int signal, double value) override;
  void read_signals(double t, const double* x, const CellMotion& motion,
                    std::span<double> signals) const override;
  std::string take_message() override;
  std::uint64_t discrete_hash() const override;
  void save(StateWriter& out) const override;
  void load(StateReader& in) override;

 private:
  std::size_t inputs() const { return p_.offer.inputs.size(); }
  void fail(std::string why);

  FmuParameters p_;
  std::unique_ptr<FmuLink> link_;
  std::vector<double> inputs_, now_, next_;  ///< next_: from the end of the present step of the FMU on
  double next_from_s_ = 0.0;
  std::uint64_t steps_ = 0;  ///< of the cell since the reset
  bool starting_ = true;     ///< the next decision is that of the initial state, ahead of the first step
  std::string failure_, notice_;
};

}  // namespace takt
