#include "server/scenario/device_builder.h"

#include <algorithm>

#include "plant_models/signal_board.h"
#include "plant_models/thermal/furnace.h"
#include "plant_models/thermal/heated_part.h"

namespace takt {

namespace {

// Air at 20 degC and 1013 hPa.
constexpr double kAirHeat_J_per_m3_K = 1.204 * 1005.0;

double kelvin(double degC) {
  return degC + kZeroCelsius_K;
}

double surface_of(const TriangleMesh& mesh) {
  double area = 0.0;
  for (const auto& [a, b, c] : mesh.triangles)
    area += 0.5 * (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).norm();
  return area;
}

Pose pose_of_ground(const std::string& name, const CellModel& cell) {
  const int id = cell.description.find_component(name);
  for (const GroundModel& ground : cell.grounds)
    if (ground.component == id) return ground.X_WB;
  return {};
}

SignalDescription told(const char* name, const char* unit) {
  return {name, unit, false, 0.0, 0.0};
}

template <class Model, class Parameters>
void add_device(const std::string& name, const Parameters& parameters, std::vector<double> identity,
                std::vector<SignalDescription> signals, CellModel& cell) {
  AuxiliaryModel further;
  further.name = name;
  further.make = [parameters] { return std::make_unique<Model>(parameters); };
  further.device = static_cast<int>(cell.description.devices.size());
  further.identity = std::move(identity);
  cell.auxiliary_models.push_back(std::move(further));
  cell.description.devices.push_back({name, std::move(signals)});
}

using Candidates = std::vector<FurnaceParameters::Candidate>;

Candidates add_heated_parts(const Scenario& scenario, const std::vector<TriangleMesh>& meshes,
                            CellModel& cell) {
  Candidates candidates;
  for (const ScenarioPart& part : scenario.parts) {
    if (!part.heat) continue;
    HeatedPartParameters p;
    p.body = cell.description.find_component(part.name);
    p.capacity_J_per_K = part.mass_kg * part.heat->specific_heat_J_per_kg_K;
    p.initial_K = kelvin(part.heat->temperature_degC);
    p.environment_K = kelvin(scenario.temperature_degC);
    p.surface_m2 = part.heat->surface_m2.value_or(surface_of(meshes[static_cast<std::size_t>(p.body)]));
    p.cooling_W_per_m2_K = part.heat->cooling_W_per_m2_K;
    add_device<HeatedPart>(
        heat_device_name(part.name), p,
        {p.capacity_J_per_K, p.initial_K, p.environment_K, p.surface_m2, p.cooling_W_per_m2_K},
        {told("temperature", "degC"), told("heat_flow", "W"), told("energy_lost", "J")}, cell);
    candidates.push_back({p.body, p.surface_m2, part.heat->emissivity});
  }
  return candidates;
}

void add_furnace(const Scenario& scenario, const ScenarioFurnace& furnace, const Candidates& candidates,
                 CellModel& cell) {
  const Vec3& size = furnace.chamber_size_m;
  const double surface = 2.0 * (size.x() * size.y() + size.y() * size.z() + size.z() * size.x());
  FurnaceParameters p;
  p.capacity_J_per_K = furnace.mass_kg * furnace.specific_heat_J_per_kg_K;
  p.air_capacity_J_per_K = furnace.air_capacity_J_per_K.value_or(kAirHeat_J_per_m3_K * size.prod());
  p.inner_surface_m2 = furnace.inner_surface_m2.value_or(surface);
  p.outer_surface_m2 = furnace.outer_surface_m2.value_or(surface);
  p.convection_W_per_m2_K = furnace.convection_W_per_m2_K;
  p.loss_W_per_m2_K = furnace.loss_W_per_m2_K;
  p.environment_K = kelvin(scenario.temperature_degC);
  p.set_K = kelvin(furnace.set_temperature_degC);
  p.initial_K = kelvin(furnace.temperature_degC.value_or(furnace.set_temperature_degC));
  p.gain_W_per_K = furnace.gain_W_per_K;
  p.integral_time_s = furnace.integral_time_s;
  p.max_power_W = furnace.max_power_W;
  p.X_WV = furnace.ground.empty() ? furnace.X_GV : pose_of_ground(furnace.ground, cell) * furnace.X_GV;
  p.size_m = size;
  p.parts = candidates;
  std::vector<double> identity{p.capacity_J_per_K,
                               p.air_capacity_J_per_K,
                               p.inner_surface_m2,
                               p.outer_surface_m2,
                               p.convection_W_per_m2_K,
                               p.loss_W_per_m2_K,
                               p.environment_K,
                               p.initial_K,
                               p.set_K,
                               p.gain_W_per_K,
                               p.integral_time_s,
                               p.max_power_W};
  for (const Vec3& v : {p.X_WV.p, p.size_m}) identity.insert(identity.end(), v.data(), v.data() + 3);
  identity.insert(identity.end(), p.X_WV.R.data(), p.X_WV.R.data() + 9);
  for (const FurnaceParameters::Candidate& part : candidates)
    identity.insert(identity.end(), {static_cast<double>(part.body), part.surface_m2, part.emissivity});
  add_device<Furnace>(
      furnace.name, p, std::move(identity),
      {{"set_temperature", "degC", true, scenario.temperature_degC, furnace.max_set_temperature_degC},
       {"door", "", true, 0.0, 1.0},
       told("temperature", "degC"),
       told("air_temperature", "degC"),
       told("power", "W"),
       told("energy", "J"),
       told("loss", "W"),
       told("heat_to_parts", "W"),
       told("energy_lost", "J"),
       told("energy_to_parts", "J"),
       told("energy_of_air", "J"),
       told("parts_inside", "")},
      cell);
}

/// A device of plain numbers: what it tells, what may be commanded, and what else makes it another model.
int add_signal_table(const std::string& name, std::vector<SignalDescription> signals,
                     const std::vector<double>& initial, std::vector<double> identity, CellModel& cell) {
  SignalTableParameters p;
  p.count = signals.size();
  std::copy(initial.begin(), initial.end(), p.initial.begin());
  add_device<SignalTable>(name, p, std::move(identity), std::move(signals), cell);
  return cell.auxiliary_models.back().device;
}

void add_thread(const ScenarioPart& part, CellModel& cell) {
  const ScenarioThread& thread = *part.thread;
  ScrewJointModel model;
  model.part = cell.description.find_component(part.name);
  model.holder = cell.description.find_component(thread.in);
  model.law = {thread.pitch_m, thread.length_m, thread.driving_torque_Nm};
  model.axis_B = thread.axis_B;
  model.p_BH = thread.p_BH;
  const Component& component = cell.components[static_cast<std::size_t>(model.part)];
  model.stiffness_ratio = thread.stiffness_N_per_m / component.substitute.k_tr_N_per_m;
  std::vector<double> identity{
      static_cast<double>(model.part), static_cast<double>(model.holder), thread.pitch_m, thread.length_m,
      thread.driving_torque_Nm,        thread.stiffness_N_per_m};
  for (const Vec3& v : {model.axis_B, model.p_BH}) identity.insert(identity.end(), v.data(), v.data() + 3);
  model.device = add_signal_table(thread_device_name(part.name), {told("turns", ""), told("held", "")},
                                  {0.0, 1.0}, std::move(identity), cell);
  cell.threads.push_back(model);
}

void add_screwdriver(const ScenarioScrewdriver& driver, CellModel& cell) {
  ScrewdriverModel model;
  model.max_torque_Nm = driver.max_torque_Nm;
  model.reach_m = driver.reach_m;
  for (const GripperDescription& gripper : cell.description.grippers) {
    if (gripper.name != driver.gripper) continue;
    model.palm = gripper.component;
    model.X_GT = gripper.X_GT;
  }
  std::vector<double> identity{static_cast<double>(model.palm), driver.max_torque_Nm, driver.reach_m};
  identity.insert(identity.end(), model.X_GT.p.data(), model.X_GT.p.data() + 3);
  identity.insert(identity.end(), model.X_GT.R.data(), model.X_GT.R.data() + 9);
  const double fastest = driver.max_speed_rad_per_s;
  model.device = add_signal_table(driver.name,
                                  {{"speed", "rad/s", true, -fastest, fastest},
                                   told("torque", "N m"),
                                   told("engaged", ""),
                                   told("power", "W"),
                                   told("energy", "J")},
                                  {}, std::move(identity), cell);
  cell.screwdrivers.push_back(model);
}

}  // namespace

std::string thread_device_name(const std::string& part) {
  return part + "_thread";
}

std::string heat_device_name(const std::string& part) {
  return part + "_heat";
}

void add_devices(const Scenario& scenario, const std::vector<TriangleMesh>& meshes, CellModel& cell) {
  const Candidates candidates = add_heated_parts(scenario, meshes, cell);
  for (const ScenarioFurnace& furnace : scenario.furnaces) add_furnace(scenario, furnace, candidates, cell);
  for (const ScenarioPart& part : scenario.parts)
    if (part.thread) add_thread(part, cell);
  for (const ScenarioScrewdriver& driver : scenario.screwdrivers) add_screwdriver(driver, cell);
}

}  // namespace takt
