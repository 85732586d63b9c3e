#pragma once
// A cell from the text of a scenario, whose devices are commanded and read by the names of their signals.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/scenario/scenario_builder.h"
#include "server/scenario/scenario_reader.h"
#include "server/simulation/step/simulation.h"
#include "tests/support/temporary_directory.h"

namespace takt::test {

class DeviceCell {
 public:
  static constexpr double kStep_s = 0.001, kGravity = 9.80665;
  /// Text of a scenario without its first lines; MESHES and ROBOTS stand for the folders of `config`.
  static std::shared_ptr<const CellModel> load_text(std::string text) {
    const std::string config = TAKT_CONFIG_DIR;
    for (const auto& [word, path] :
         {std::pair<std::string, std::string>{"MESHES", config + "/meshes"}, {"ROBOTS", config + "/robots"}})
      for (auto at = text.find(word); at != std::string::npos; at = text.find(word))
        text.replace(at, word.size(), path);
    const TemporaryDirectory directory;
    directory.write("cell.yaml", "takt_scenario: 1\nname: cell\n" + text);
    return load_cell(directory.path() / "cell.yaml");
  }
  static std::shared_ptr<const CellModel> load_device(const std::string& name, int level_of_detail = 1) {
    ScenarioOptions options;
    options.level_of_detail = level_of_detail;
    return load_cell(std::filesystem::path(TAKT_CONFIG_DIR) / "devices" / (name + ".yaml"), options);
  }
  explicit DeviceCell(std::shared_ptr<const CellModel> model)
      : simulation_(std::move(model)), snapshot_(simulation_.make_snapshot()) {}

  Simulation& simulation() { return simulation_; }
  const CellDescription& description() const { return simulation_.description(); }
  double time_s() const { return simulation_.time_s(); }
  int device(std::string_view name) const {
    const int found = description().find_device(name);
    if (found < 0) ADD_FAILURE() << "no device " << name;
    return found;
  }
  std::size_t signal(std::string_view of_device, std::string_view name) const {
    const auto& signals = description().devices[static_cast<std::size_t>(device(of_device))].signals;
    for (std::size_t i = 0; i < signals.size(); ++i)
      if (signals[i].name == name) return i;
    ADD_FAILURE() << "no signal " << name << " of " << of_device;
    return 0;
  }
  /// Takes effect with the next step.
  void set(std::string_view of_device, std::string_view name, double value) {
    DeviceCommand command;
    command.device = device(of_device);
    command.count = 1;
    command.signals[0] = static_cast<std::uint8_t>(signal(of_device, name));
    command.values[0] = value;
    next_.emplace_back(command);
  }
  void give(const Command& command) { next_.push_back(command); }
  /// Set-point of the slide, the only joint of robot 0, for the end of the next step.
  void slide_to(double position_m, double velocity_m_per_s) {
    JointCommand command;
    command.robot = 0;
    command.period_s = kStep_s;
    command.has_velocity = true;
    command.position[0] = position_m;
    command.velocity[0] = velocity_m_per_s;
    next_.emplace_back(command);
  }
  bool step() {
    const bool good = simulation_.step(next_);
    EXPECT_TRUE(good) << simulation_.fault();
    next_.clear();
    for (const DeviceNotice& notice : simulation_.events().device_notices) notices_.push_back(notice);
    return good;
  }
  /// All events of devices so far.
  const std::vector<DeviceNotice>& notices() const { return notices_; }
  std::size_t count(DeviceNotice::Kind kind) const {
    return static_cast<std::size_t>(std::count_if(notices_.begin(), notices_.end(),
                                                  [&](const DeviceNotice& n) { return n.kind == kind; }));
  }
  void run(double seconds) {
    for (auto n = std::lround(seconds / description().step_s); n > 0; --n)
      if (!step()) return;
  }
  /// Until the condition holds; false: it does not within the time.
  template <class Condition>
  bool run_until(const Condition& condition, double at_most_s) {
    for (auto n = std::lround(at_most_s / description().step_s); n > 0; --n) {
      if (condition()) return true;
      if (!step()) return false;
    }
    return condition();
  }
  const Snapshot& now() {
    simulation_.read_snapshot(snapshot_);
    return snapshot_;
  }
  double read(std::string_view of_device, std::string_view name) {
    simulation_.read_machines(snapshot_);
    return snapshot_.devices[static_cast<std::size_t>(device(of_device))].signals[signal(of_device, name)];
  }
  const ComponentSample& component(std::string_view name) {
    const int found = description().find_component(name);
    if (found < 0) ADD_FAILURE() << "no component " << name;
    return now().components[static_cast<std::size_t>(found)];
  }
  std::string partner(std::string_view name) {
    const int found = component(name).partner;
    return found < 0 ? "" : description().components[static_cast<std::size_t>(found)].name;
  }

 private:
  Simulation simulation_;
  Snapshot snapshot_;
  std::vector<Command> next_;
  std::vector<DeviceNotice> notices_;
};

}  // namespace takt::test
