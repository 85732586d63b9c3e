#pragma once
// Cells with an FMU as their only device, and the FMUs that the build makes for tests (support/fmus).
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "server/fmu/fmu_library.h"
#include "server/scenario/scenario_builder.h"
#include "server/simulation/step/simulation.h"
#include "tests/support/temporary_directory.h"

namespace takt::test {

inline const std::filesystem::path kTestFmus = std::filesystem::path(TAKT_BIN_DIR).parent_path() / "fmus";
inline const std::filesystem::path kFmuHost = std::filesystem::path(TAKT_BIN_DIR) / "takt-fmu-host";

/// A cell with one FMU, "Motor".
class FmuCell {
 public:
  /// `keys`: of the FMU, besides `file`, as in a flow mapping.
  explicit FmuCell(const std::filesystem::path& fmu, const std::string& keys = "", double step_s = 0.001) {
    directory_.write("cell.yaml", "takt_scenario: 1\nname: fmu\nduration_s: 1\nsolver: {step_s: " +
                                      std::to_string(step_s) + "}\nfmus: {Motor: {file: " + fmu.string() +
                                      (keys.empty() ? "" : ", " + keys) + "}}\n");
    FmuLibrary library(fmu.parent_path(), kFmuHost);
    ImportOptions import;
    import.fmus = &library;
    model_ = load_cell(directory_ / "cell.yaml", {}, import);
    simulation_ = std::make_unique<Simulation>(model_);
    snapshot_ = simulation_->make_snapshot();
  }

  Simulation& simulation() { return *simulation_; }
  const std::shared_ptr<const CellModel>& model() const { return model_; }
  const DeviceDescription& device() const { return model_->description.devices[0]; }
  std::size_t index(const std::string& signal) const {
    for (std::size_t i = 0; i < device().signals.size(); ++i)
      if (device().signals[i].name == signal) return i;
    ADD_FAILURE() << "no signal " << signal;
    return 0;
  }
  double value(const std::string& signal) {
    simulation_->read_snapshot(snapshot_);
    return snapshot_.devices[0].signals[index(signal)];
  }
  /// From the next step on.
  void command(const std::string& signal, double value) {
    DeviceCommand command;
    command.device = 0;
    command.count = 1;
    command.signals[0] = static_cast<std::uint8_t>(index(signal));
    command.values[0] = value;
    next_ = {command};
  }
  bool step(int count = 1) {
    for (int i = 0; i < count; ++i) {
      if (!simulation_->step(next_)) return false;
      next_.clear();
      for (const DeviceMessage& notice : simulation_->events().device_messages)
        notices_ += notice.sentence + "\n";
    }
    return true;
  }
  const std::string& notices() const { return notices_; }

 private:
  TemporaryDirectory directory_;
  std::shared_ptr<const CellModel> model_;
  std::unique_ptr<Simulation> simulation_;
  Snapshot snapshot_;
  std::vector<Command> next_;
  std::string notices_;
};

/// The sentence by which a cell with this FMU is refused.
inline std::string refusal_of_fmu(const std::filesystem::path& fmu, const std::string& keys = "",
                                  double step_s = 0.001) {
  try {
    FmuCell(fmu, keys, step_s);
  } catch (const ScenarioError& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace takt::test
