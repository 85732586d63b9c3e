#pragma once
// The furnace experiment of thesis 5.5.2 without robots: a rotor core that is put into the chamber and out of
// it at once, by hand. Parameters: see the scenario furnace.yaml.
#include <memory>
#include <string>

#include "server/devices/furnace.h"
#include "server/devices/heated_part.h"
#include "server/simulation/step/simulation.h"
#include "tests/support/box_cell.h"

namespace takt::test {

class FurnaceCell {
 public:
  enum Device : std::size_t { kPartDevice, kFurnaceDevice };

  explicit FurnaceCell(double step_s, const std::string& solver = "rk4", double tolerance = 1e-8,
                       const Pose& start = at(2.0, 0.0, 0.0)) {
    cell_.gravity(Vec3::Zero()).step(step_s);
    part_.body = cell_.part("Rotor", 30.0, 1, {0.2, 0.2, 0.2}, start);
    part_.capacity_J_per_K = 30.0 * 510.0;
    furnace_.capacity_J_per_K = 200.0 * 900.0;
    furnace_.air_capacity_J_per_K = 415.065;
    furnace_.inner_surface_m2 = furnace_.outer_surface_m2 = 6.0 * 0.7 * 0.7;
    furnace_.convection_W_per_m2_K = 15.0;
    furnace_.loss_W_per_m2_K = 0.8;
    furnace_.initial_K = furnace_.set_K = 573.15;
    furnace_.gain_W_per_K = 2000.0;
    furnace_.integral_time_s = 600.0;
    furnace_.max_power_W = 9000.0;
    furnace_.size_m = Vec3::Constant(0.7);
    furnace_.parts = {{part_.body, 0.157080, 0.65}};
    cell_.model().solver = {solver, tolerance, step_s, SystemMatrix::automatic};
  }
  HeatedPartParameters& part() { return part_; }
  FurnaceParameters& furnace() { return furnace_; }

  std::shared_ptr<const CellModel> build() {
    CellModel& model = cell_.model();
    model.auxiliary_models = {
        {"Rotor_heat", [p = part_] { return std::make_unique<HeatedPart>(p); }, kPartDevice},
        {"Furnace", [p = furnace_] { return std::make_unique<Furnace>(p); }, kFurnaceDevice}};
    model.description.devices = {{"Rotor_heat", {}}, {"Furnace", {}}};
    model.description.devices[kPartDevice].signals.resize(HeatedPart::kSignals);
    model.description.devices[kFurnaceDevice].signals.resize(Furnace::kSignals);
    return cell_.build();
  }

  inline static const Pose kOutside = at(2.0, 0.0, 0.0), kInside = at(0.0, 0.0, 0.0);

 private:
  BoxCell cell_;
  HeatedPartParameters part_;
  FurnaceParameters furnace_;
};

/// A run of the cell with its newest snapshot.
class FurnaceRun {
 public:
  explicit FurnaceRun(FurnaceCell& cell)
      : simulation_(cell.build()), snapshot_(simulation_.make_snapshot()) {}

  Simulation& simulation() { return simulation_; }
  bool run_until(double time_s) {
    while (simulation_.time_s() < time_s - 1e-9)
      if (!simulation_.step({})) return false;
    simulation_.read_snapshot(snapshot_);
    return true;
  }
  void put(const Pose& X_WB) { simulation_.set_component_state(0, X_WB, {}); }
  double furnace(int signal) const {
    return snapshot_.devices[FurnaceCell::kFurnaceDevice].signals[static_cast<std::size_t>(signal)];
  }
  double part(int signal) const {
    return snapshot_.devices[FurnaceCell::kPartDevice].signals[static_cast<std::size_t>(signal)];
  }

 private:
  Simulation simulation_;
  Snapshot snapshot_;
};

}  // namespace takt::test
