#pragma once
// The service in this process with scenario files to load: the one it begins with, one with other robots, and
// wrong ones. All of them in a directory of the test.
#include <filesystem>
#include <memory>
#include <string>

#include "server/dds/dds_adapter.h"
#include "server/runtime/host/cell_host.h"
#include "tests/support/dds_service.h"
#include "tests/support/service_cell.h"
#include "tests/support/temporary_directory.h"

namespace takt::test {

class HostedService {
 public:
  /// Without a scenario to begin with where `begin` is false.
  explicit HostedService(bool begin = true, HostOptions options = paused(), ScenarioOptions scenario = {})
      : host(named(std::move(options))) {
    adapter = std::make_unique<DdsAdapter>(host, ParticipantOptions{"hosted", test_domain(), "", ""});
    if (begin) {
      host.open(ScenarioSource{two_robots(), std::move(scenario)});
    } else {
      host.open_empty();
    }
  }
  ~HostedService() {
    host.stop();
    adapter->stop();
  }

  static HostOptions paused() {
    HostOptions options;
    options.loop.state = SimulationState::paused;
    options.loop.pace = Pace::free;
    return options;
  }

  /// Robot1 and Robot2 with Gripper1 and Gripper2, Parts P and C.
  std::filesystem::path two_robots() { return file("two_robots.yaml", service_scenario_text()); }
  /// One robot Arm without a gripper, one Part Q.
  std::filesystem::path one_arm() {
    const std::string config = TAKT_CONFIG_DIR;
    return file("one_arm.yaml",
                "takt_scenario: 1\nname: one_arm\nduration_s: 0.2\nsolver: {method: rk2, step_s: 0.002}\n"
                "parts:\n  Q: {mesh: " +
                    config +
                    "/meshes/C.obj, mass_kg: 0.5, hierarchy: 3, pose: {position_m: [0.3, -0.2, 0.7]}}\n"
                    "grounds:\n  Table1: {mesh: " +
                    config + "/meshes/table.obj, convex: objects, pose: {position_m: [0, 0, 0.7]}}\n" +
                    "robots:\n  Arm: {urdf: " + config +
                    "/robots/ur10e.urdf, pose: {position_m: [-0.75, 0, 0.7]}, initial_joints_rad: [0, -1.5, "
                    "1.5, -1.5, -1.5, 0]}\n");
  }
  /// Line 3 has a key that does not exist.
  std::filesystem::path wrong_key() {
    return file("wrong_key.yaml", "takt_scenario: 1\nname: wrong\nduration: 0.2\n");
  }
  std::filesystem::path file(const std::string& name, const std::string& text) {
    directory.write(name, text);
    return directory / name;
  }

  TemporaryDirectory directory;
  CellHost host;
  std::unique_ptr<DdsAdapter> adapter;

 private:
  static HostOptions named(HostOptions options) {
    options.cell = test_cell();
    return options;
  }
};

}  // namespace takt::test
