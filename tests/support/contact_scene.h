#pragma once
// Small scenes at level of detail 3 for tests: scenario texts with meshes from config/meshes/contact or made
// by the test.
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/scenario/scenario_builder.h"
#include "server/simulation/step/simulation.h"
#include "tests/support/temporary_directory.h"

namespace takt::test {

/// Layer of the defaults: K / b of (2.16), (2.17).
inline constexpr double kLayer_Pa_per_m = layer_modulus(1e6, 0.3) / 0.001;
inline constexpr double kG = 9.80665;

/// A mesh of the scene library, as the value of a key `mesh`.
inline std::string library_mesh(const std::string& name) {
  return std::string(TAKT_CONFIG_DIR) + "/meshes/contact/" + name + ".obj";
}

struct SceneText {
  std::string solver = "{method: rosenbrock, step_s: 0.002, tolerance: 1.0e-6}";
  std::string contact = "{defaults: {friction: 0.3}}";
  std::string parts, grounds;  ///< entries of the sections, one a line
};

inline std::shared_ptr<const CellModel> load_scene(const TemporaryDirectory& directory,
                                                   const SceneText& scene) {
  directory.write("scene.yaml",
                  "takt_scenario: 1\nname: scene\nsolver: " + scene.solver +
                      "\nprocesses: {cell: {level_of_detail: 3, members: all}}\ncontact: " + scene.contact +
                      "\nparts:\n" + scene.parts + "\ngrounds:\n" + scene.grounds + "\n");
  return load_cell(directory / "scene.yaml");
}

/// A scene of config/scenarios/contact with some keys replaced.
inline std::shared_ptr<const CellModel> library_scene(const std::string& name,
                                                      const std::vector<std::string>& overrides = {}) {
  ScenarioOptions options;
  options.overrides = overrides;
  return load_cell(std::filesystem::path(TAKT_CONFIG_DIR) / "scenarios" / "contact" / (name + ".yaml"),
                   options);
}

/// A simulation with the queries of tests. It has no controller.
class SceneRun {
 public:
  explicit SceneRun(std::shared_ptr<const CellModel> cell)
      : cell_(std::move(cell)), simulation_(cell_), snapshot_(simulation_.make_snapshot()) {}

  Simulation& simulation() { return simulation_; }
  /// Up to this time; false if the cell could not be advanced.
  bool run_to(double time_s) {
    while (simulation_.time_s() < time_s - 1e-9)
      if (!step()) return false;
    return true;
  }
  bool step() {
    const bool good = simulation_.step({});
    if (!good) ADD_FAILURE() << simulation_.fault();
    simulation_.read_snapshot(snapshot_);
    return good;
  }
  const ComponentSample& sample(const std::string& name) const {
    return snapshot_.components[static_cast<std::size_t>(cell_->description.find_component(name))];
  }
  /// The contact of two components at this time.
  std::optional<ContactSample> contact(const std::string& a, const std::string& b) {
    const int i = cell_->description.find_component(a), j = cell_->description.find_component(b);
    simulation_.read_contacts(contacts_);
    for (const ContactSample& c : contacts_)
      if ((c.base == i && c.target == j) || (c.base == j && c.target == i)) return c;
    return std::nullopt;
  }

 private:
  std::shared_ptr<const CellModel> cell_;
  Simulation simulation_;
  Snapshot snapshot_;
  std::vector<ContactSample> contacts_;
};

}  // namespace takt::test
