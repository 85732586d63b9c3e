#include "server/scenario/device_fields.h"

#include <algorithm>

#include "idl/common/text.h"
#include "server/scenario/scenario_reader.h"

namespace takt {

namespace {

constexpr NumberRange kTemperature{.lower = -273.0, .upper = 5000.0, .unit = "degC"};

/// One of the names of `items` under `key`.
template <class Items>
std::string read_name_of(YamlFields& fields, const char* key, const char* kind, const Items& items) {
  const std::string name = fields.text(key);
  if (std::any_of(items.begin(), items.end(), [&](const auto& item) { return item.name == name; }))
    return name;
  fields.fail(key, "'" + name + "'", std::string("a ") + kind + " of this scenario: " + list_names(items));
}

/// The name of a Ground under `key`, or empty.
std::string read_ground_name(YamlFields& fields, const Scenario& scenario) {
  if (!fields.has("ground")) return {};
  return read_name_of(fields, "ground", "ground", scenario.grounds);
}

Vec3 read_size(YamlFields& fields, const std::string& key) {
  const std::vector<double> size = fields.numbers(key, 3, positive("m"));
  return {size[0], size[1], size[2]};
}

void read_furnace(YamlFields fields, const std::string& name, Scenario& scenario) {
  ScenarioFurnace furnace;
  furnace.name = name;
  furnace.ground = read_ground_name(fields, scenario);
  YamlFields chamber = fields.mapping("chamber");
  furnace.X_GV = chamber.pose_or_identity("center");
  furnace.chamber_size_m = read_size(chamber, "size_m");
  furnace.inner_surface_m2 = chamber.number_if("inner_surface_m2", positive("m^2"));
  furnace.outer_surface_m2 = chamber.number_if("outer_surface_m2", positive("m^2"));
  furnace.air_capacity_J_per_K = chamber.number_if("air_capacity_J_per_K", positive("J/K"));
  chamber.finish();
  furnace.mass_kg = fields.number("mass_kg", positive("kg"));
  furnace.specific_heat_J_per_kg_K = fields.number("specific_heat_J_per_kg_K", positive("J/(kg K)"));
  furnace.convection_W_per_m2_K = fields.number("convection_W_per_m2_K", not_negative("W/(m^2 K)"));
  furnace.loss_W_per_m2_K = fields.number("loss_W_per_m2_K", not_negative("W/(m^2 K)"));
  furnace.max_set_temperature_degC =
      fields.number_or("max_set_temperature_degC", kTemperature, furnace.max_set_temperature_degC);
  furnace.set_temperature_degC = fields.number(
      "set_temperature_degC",
      {.lower = scenario.temperature_degC, .upper = furnace.max_set_temperature_degC, .unit = "degC"});
  furnace.temperature_degC = fields.number_if("temperature_degC", kTemperature);
  YamlFields control = fields.mapping("control");
  furnace.gain_W_per_K = control.number("gain_W_per_K", positive("W/K"));
  furnace.integral_time_s = control.number("integral_time_s", positive("s"));
  furnace.max_power_W = control.number("max_power_W", positive("W"));
  control.finish();
  fields.finish();
  scenario.furnaces.push_back(furnace);
}

void read_screwdriver(YamlFields fields, const std::string& name, Scenario& scenario) {
  ScenarioScrewdriver driver;
  driver.name = name;
  driver.gripper = read_name_of(fields, "gripper", "gripper", scenario.grippers);
  driver.max_speed_rad_per_s = fields.number("max_speed_rad_per_s", positive("rad/s"));
  driver.max_torque_Nm = fields.number("max_torque_Nm", positive("N m"));
  driver.reach_m = fields.number_or("reach_m", positive("m"), driver.reach_m);
  fields.finish();
  scenario.screwdrivers.push_back(driver);
}

void check_threads(const Scenario& scenario) {
  for (const ScenarioPart& part : scenario.parts) {
    if (!part.thread) continue;
    const std::string& in = part.thread->in;
    const auto is_it = [&in](const auto& item) { return item.name == in; };
    const bool known = std::any_of(scenario.parts.begin(), scenario.parts.end(), is_it) ||
                       std::any_of(scenario.grounds.begin(), scenario.grounds.end(), is_it);
    if (!known || in == part.name)
      throw ScenarioError(part.thread->place + ": found '" + in +
                          "'; allowed: another part, or a ground, of this scenario");
    const auto into = std::find_if(scenario.parts.begin(), scenario.parts.end(), is_it);
    if (into != scenario.parts.end() && into->thread)
      throw ScenarioError(part.thread->place + ": found '" + in +
                          "', which has a thread itself; allowed: a part without one, or a ground");
  }
}

}  // namespace

ScenarioThread read_thread(YamlFields fields) {
  ScenarioThread thread;
  thread.in = fields.text("in");
  thread.place = fields.place_of(fields.optional("in"), "in");
  thread.pitch_m = fields.number("pitch_m", positive("m"));
  thread.length_m = fields.number("length_m", positive("m"));
  thread.driving_torque_Nm = fields.number("driving_torque_Nm", positive("N m"));
  thread.axis_B = fields.vector_or("axis", thread.axis_B, "");
  if (!(thread.axis_B.norm() > 1e-6)) fields.fail("axis", "a vector without direction", "e.g. [0, 0, 1]");
  thread.axis_B.normalize();
  thread.p_BH = fields.vector_or("head_m", thread.p_BH, "m");
  thread.stiffness_N_per_m = fields.number_or("stiffness_N_per_m", positive("N/m"), thread.stiffness_N_per_m);
  fields.finish();
  return thread;
}

ScenarioHeat read_heat(YamlFields fields, double environment_degC) {
  ScenarioHeat heat;
  heat.specific_heat_J_per_kg_K = fields.number("specific_heat_J_per_kg_K", positive("J/(kg K)"));
  heat.temperature_degC = fields.number_or("temperature_degC", kTemperature, environment_degC);
  heat.emissivity = fields.number_or("emissivity", {.lower = 0.0, .upper = 1.0}, heat.emissivity);
  heat.surface_m2 = fields.number_if("surface_m2", positive("m^2"));
  heat.cooling_W_per_m2_K = fields.number_or("cooling_W_per_m2_K", not_negative("W/(m^2 K)"), 0.0);
  fields.finish();
  return heat;
}

void read_devices(YamlFields& top, Scenario& scenario) {
  for (auto& [name, fields] : top.entries("furnaces")) read_furnace(fields, name, scenario);
  for (auto& [name, fields] : top.entries("screwdrivers")) read_screwdriver(fields, name, scenario);
  check_threads(scenario);
}

}  // namespace takt
