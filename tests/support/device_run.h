#pragma once
// Runs of the scenarios in config/devices, with commands to their devices.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "server/scenario/scenario_builder.h"
#include "server/simulation/step/simulation.h"

namespace takt::test {

/// A scenario of config/devices with some keys replaced.
inline std::shared_ptr<const CellModel> device_cell(const std::string& name,
                                                    const std::vector<std::string>& overrides = {}) {
  ScenarioOptions options;
  options.overrides = overrides;
  return load_cell(std::filesystem::path(TAKT_CONFIG_DIR) / "devices" / (name + ".yaml"), options);
}
/// All of it at this level of detail.
inline std::string at_level(int level) {
  return "processes={cell: {level_of_detail: " + std::to_string(level) + ", members: all}}";
}

class DeviceRun {
 public:
  explicit DeviceRun(const std::string& name, const std::vector<std::string>& overrides = {})
      : cell_(device_cell(name, overrides)), simulation_(cell_), snapshot_(simulation_.make_snapshot()) {}

  Simulation& simulation() { return simulation_; }
  double time_s() const { return simulation_.time_s(); }
  /// With the commands given since the last step.
  bool step() {
    const bool good = simulation_.step(commands_);
    if (!good) ADD_FAILURE() << simulation_.fault();
    commands_.clear();
    simulation_.read_snapshot(snapshot_);
    return good;
  }
  bool run_to(double time_s) {
    while (simulation_.time_s() < time_s - 1e-9)
      if (!step()) return false;
    return true;
  }
  bool run(double seconds) { return run_to(time_s() + seconds); }
  void set(const std::string& device, const std::string& signal, double value) {
    DeviceCommand command;
    command.device = cell_->description.find_device(device);
    command.count = 1;
    command.signals[0] = static_cast<std::uint8_t>(place(command.device, signal));
    command.values[0] = value;
    commands_.push_back(command);
  }
  double signal(const std::string& device, const std::string& signal) const {
    const int index = cell_->description.find_device(device);
    return snapshot_.devices[static_cast<std::size_t>(index)].signals[place(index, signal)];
  }
  const ComponentSample& sample(const std::string& name) const {
    return snapshot_.components[static_cast<std::size_t>(cell_->description.find_component(name))];
  }
  const Snapshot& snapshot() const { return snapshot_; }

 private:
  std::size_t place(int device, const std::string& signal) const {
    const auto& signals = cell_->description.devices[static_cast<std::size_t>(device)].signals;
    for (std::size_t i = 0; i < signals.size(); ++i)
      if (signals[i].name == signal) return i;
    ADD_FAILURE() << "no signal " << signal;
    return 0;
  }
  std::shared_ptr<const CellModel> cell_;
  Simulation simulation_;
  Snapshot snapshot_;
  std::vector<Command> commands_;
};

/// Runs on from a state saved at `saved_s`; the same bits at the end as without.
inline void expect_same_after_restoring(DeviceRun& run, double saved_s, double end_s) {
  const auto places = [&run] {
    std::vector<Vec3> found;
    for (const ComponentSample& component : run.snapshot().components) found.push_back(component.p_WB);
    return found;
  };
  ASSERT_TRUE(run.run_to(saved_s));
  std::vector<std::byte> bytes;
  ASSERT_EQ(run.simulation().save_state(bytes), "");
  ASSERT_TRUE(run.run_to(end_s));
  const std::uint64_t hash = run.simulation().state_hash();
  const std::vector<Vec3> before = places();
  ASSERT_EQ(run.simulation().restore_state(bytes), "");
  ASSERT_NEAR(run.simulation().time_s(), saved_s, 1e-9);
  ASSERT_TRUE(run.run_to(end_s));
  EXPECT_EQ(run.simulation().state_hash(), hash);
  EXPECT_EQ(places(), before);
}

}  // namespace takt::test
