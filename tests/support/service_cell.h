#pragma once
// A small cell with two robots, their grippers and two Parts, for tests of the service.
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include <unistd.h>

#include "server/scenario/scenario_builder.h"
#include "server/simulation/model/cell_model.h"

namespace takt::test {

inline std::string service_scenario_text() {
  const std::string config = TAKT_CONFIG_DIR;
  const std::string joints =
      "[0, -1.5707963267948966, 1.5707963267948966, -1.5707963267948966, -1.5707963267948966, 0]";
  const auto robot = [&](const std::string& name, const std::string& pose) {
    return "  " + name + ": {urdf: " + config + "/robots/ur10e.urdf, pose: {" + pose +
           "}, initial_joints_rad: " + joints + "}\n";
  };
  const auto gripper = [&](const std::string& name, const std::string& carrier) {
    return "  " + name + ": {robot: " + carrier + ", body_mesh: " + config +
           "/meshes/gripper_body.obj, jaw_mesh: " + config +
           "/meshes/gripper_jaw.obj, tool_center_point: {position_m: [0, 0, 0.2]}, max_width_m: 0.15, " +
           "initial_width_m: 0.1, jaw_speed_m_per_s: 0.075, max_force_N: 150, mass_kg: 3}\n";
  };
  return "takt_scenario: 1\nname: service_test\nduration_s: 0.2\nworld: {gravity_m_per_s2: [0, 0, "
         "-9.80665]}\n"
         "solver: {method: rk2, step_s: 0.001}\n"
         "parts:\n"
         "  P: {mesh: " +
         config +
         "/meshes/P.obj, mass_kg: 0.3, hierarchy: 2, pose: {position_m: [-0.22, 0.2, 0.7]}}\n"
         "  C: {mesh: " +
         config +
         "/meshes/C.obj, mass_kg: 0.5, hierarchy: 3, pose: {position_m: [0.3, -0.2, 0.7]}}\n"
         "grounds:\n"
         "  Table1: {mesh: " +
         config +
         "/meshes/table.obj, convex: objects, pose: {position_m: [0, 0, 0.7]}}\n"
         "robots:\n" +
         robot("Robot1", "position_m: [-0.75, 0, 0.7]") +
         robot("Robot2", "position_m: [0.6, -0.7, 0.7], rpy_deg: [0, 0, 90]") + "grippers:\n" +
         gripper("Gripper1", "Robot1") + gripper("Gripper2", "Robot2");
}

/// Writes the scenario to a file of its own and returns its path.
inline std::filesystem::path write_service_scenario() {
  const auto path =
      std::filesystem::temp_directory_path() / ("takt_service_" + std::to_string(getpid()) + ".yaml");
  std::ofstream(path) << service_scenario_text();
  return path;
}

inline std::shared_ptr<CellModel> service_model(const std::string& cell = "cell") {
  const auto path = write_service_scenario();
  auto model = std::make_shared<CellModel>(*load_cell(path));
  std::filesystem::remove(path);
  model->description.cell = cell;
  return model;
}

/// The same with surface contact prepared, and a solver for it; initially at level of detail 1.
/// `more`: further sections.
inline std::shared_ptr<CellModel> service_contact_model(const std::string& cell = "cell",
                                                        const std::string& more = {}) {
  std::string text = service_scenario_text();
  const std::string explicit_method = "method: rk2";
  text.replace(text.find(explicit_method), explicit_method.size(), "method: implicit");
  const auto path =
      std::filesystem::temp_directory_path() / ("takt_contact_" + std::to_string(getpid()) + ".yaml");
  std::ofstream(path) << text << "contact: {defaults: {friction: 0.3}}\n" << more;
  auto model = std::make_shared<CellModel>(*load_cell(path));
  std::filesystem::remove(path);
  model->description.cell = cell;
  return model;
}

}  // namespace takt::test
