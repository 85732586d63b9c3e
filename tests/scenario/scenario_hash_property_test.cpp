// Which keys of a scenario enter the model hash: each key of a cell that has all sections is given another
// value, and the hash differs exactly where the table of fields says that the key is in the model.
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <map>
#include <set>

#include "server/scenario/scenario_builder.h"
#include "server/scenario/scenario_writer.h"
#include "server/simulation/model/model_hash.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

const std::string kCube =
    "v 0 0 0\nv 0.1 0 0\nv 0.1 0.1 0\nv 0 0.1 0\nv 0 0 0.1\nv 0.1 0 0.1\nv 0.1 0.1 0.1\nv 0 0.1 0.1\n"
    "f 1 4 3\nf 1 3 2\nf 5 6 7\nf 5 7 8\nf 1 2 6\nf 1 6 5\nf 2 3 7\nf 2 7 6\nf 3 4 8\nf 3 8 7\nf 4 1 5\nf 4 "
    "5 8\n";
const std::string kArm = R"(<robot name='r'><link name='base_link'/>
<link name='tool0'><inertial><mass value='2'/><inertia ixx='.1' iyy='.1' izz='.1' ixy='0' ixz='0' iyz='0'/></inertial></link>
<joint name='j' type='revolute'><parent link='base_link'/><child link='tool0'/><axis xyz='0 0 1'/>
<limit lower='-3' upper='3' velocity='1' effort='100'/></joint></robot>)";

/// Every number and word that a scenario may have, as far as one cell can have them at once.
const std::string kCell = R"(
takt_scenario: 1
name: all
description: all sections
duration_s: 1
csv_period_s: 0.02
world: {gravity_m_per_s2: [0, 0, -9.81], temperature_degC: 25, bounds_m: {lower: [-9, -9, -9], upper: [9, 9, 9]}, allow_overlap: [["*", "*"]]}
solver: {method: rk2, step_s: 0.001, tolerance: 1.0e-5, matrix: separate, contact: {method: implicit, tolerance: 1.0e-4, step_s: 0.002}, dynamics: {method: implicit, tolerance: 1.0e-4}}
interaction: {algorithm: partner_search, weight_feed_forward: true, allowed_position_error_m: 0.0001, damping_ratio: 1.1, contact_margin_m: 0.0002, max_volume_error: 0.5}
sleeping: {method: exact, speed_m_per_s: 1.0e-6, time_to_sleep_s: 0.1}
parts:
  Plain: {mesh: cube.obj, mesh_scale: 1.1, mass_kg: 1, hierarchy: 2, pose: {position_m: [0, 0, 1], quaternion_xyzw: [0, 0, 0, 1]}, color: [1, 0.5, 0]}
  Odd:
    mesh: cube.obj
    mass_kg: 1
    hierarchy: 3
    pose: {position_m: [1, 0, 1], rpy_deg: [10, 0, 0]}
    twist: {velocity_m_per_s: [0, 0, 0.1], angular_velocity_rad_per_s: [0.1, 0, 0]}
    center_of_mass_m: [0.05, 0.05, 0.05]
    inertia_kg_m2: [0.01, 0.01, 0.01, 0, 0, 0]
    holding_spring: {allowed_position_error_m: 0.0002, damping_ratio: 0.9, rotational_stiffness_N_m_per_rad: 100, rotational_damping_N_m_s_per_rad: 10}
    heat: {specific_heat_J_per_kg_K: 500, temperature_degC: 30, emissivity: 0.5, surface_m2: 0.02, cooling_W_per_m2_K: 3}
    thread: {in: Plain, pitch_m: 0.001, length_m: 0.01, driving_torque_N_m: 1, axis: [0, 0.1, 1], head_m: [0, 0, 0.01], stiffness_N_per_m: 2.0e+6}
grounds:
  Floor: {mesh: cube.obj, mesh_scale: 2, pose: {position_m: [0, 0, -1], rpy_rad: [0, 0, 0.1]}}
  Platform: {mesh: cube.obj, pose: {position_m: [5, 0, 0]}}
  Disc: {mesh: cube.obj, pose: {position_m: [5, 1, 0]}}
  Pusher: {mesh: cube.obj, pose: {position_m: [5, 2, 0]}}
robots:
  R:
    urdf: arm.urdf
    pose: {position_m: [2, 0, 0]}
    initial_joints_rad: [0.5]
    command_period_s: 0.01
    command_deadline_s: 0.05
    safe_action: stop
    max_acceleration_rad_per_s2: 10
    drives: {model: detailed, gear_ratio: 100, motor_inertia_kg_m2: 1.0e-4, torque_constant_N_m_per_A: 0.1, current_loop_rad_per_s: 1000,
      current_loop_damping: 0.7, armature_resistance_ohm: 200, power_stage_gain: 4, gear_stiffness_N_m_per_rad: 40, gear_damping_N_m_s_per_rad: 0.01,
      friction: regularised, friction_zero_speed_N_m: 0.1, friction_slope_N_m_s_per_rad: 0.001, breakaway_factor: 1.1,
      friction_regularisation_rad_per_s: 0.02, position_encoder: motor, position_gain_per_s: 4, speed_gain_A_s_per_rad: 0.4, speed_integral_time_s: 0.06}
    power: {idle_W: 10, loss_factor: 1.2, regenerative: true}
    trajectory: {end_rad: [1], max_velocity_rad_per_s: [0.5], max_acceleration_rad_per_s2: [1]}
  S: {urdf: arm.urdf, pose: {position_m: [4, 0, 0]}, initial_joints_rad: [0], drives: {model: simplified, bandwidth_rad_per_s: 50}}
grippers:
  G: {robot: R, mount: {position_m: [0, 0, 0.1]}, tool_center_point: {position_m: [0, 0, 0.2]}, body_mesh: cube.obj, jaw_mesh: cube.obj, mesh_scale: 0.5,
    max_width_m: 0.1, initial_width_m: 0.05, jaw_speed_m_per_s: 0.1, max_force_N: 10, mass_kg: 1, jaw_mass_kg: 0.2, grasp: on_contact, color: [1, 0, 0]}
furnaces:
  Oven: {ground: Floor, chamber: {center: {position_m: [0, 0, 0.4]}, size_m: [1, 1, 1], inner_surface_m2: 5, outer_surface_m2: 6, air_capacity_J_per_K: 400},
    mass_kg: 200, specific_heat_J_per_kg_K: 900, convection_W_per_m2_K: 15, loss_W_per_m2_K: 0.8, max_set_temperature_degC: 400,
    set_temperature_degC: 300, temperature_degC: 290, control: {gain_W_per_K: 2000, integral_time_s: 600, max_power_W: 9000}}
screwdrivers: {Driver: {gripper: G, max_speed_rad_per_s: 60, max_torque_N_m: 4, reach_m: 0.02}}
light_barriers: {Beam: {at: Odd, pose: {position_m: [0, 0, 1]}, from_m: [0, 0, 0.1], to_m: [1, 0, 0], sees_grounds: true, on_delay_s: 0.1, off_delay_s: 0.2}}
light_curtains: {Field: {at: Odd, pose: {position_m: [0, 0, 1]}, width_m: 1, beams: 8, pitch_m: 0.02, sees_grounds: true, on_delay_s: 0.1, off_delay_s: 0.2}}
proximity_boxes: {Near: {at: R, pose: {position_m: [0, 0, 1]}, size_m: [0.1, 0.2, 0.3], hysteresis_m: 0.01, sees_grounds: true, on_delay_s: 0.1, off_delay_s: 0.2}}
distance_sensors: {Far: {at: G, pose: {position_m: [0, 0, 1]}, range_m: 2, sees_grounds: false, noise_m: 0.001, lag_s: 0.1, resolution_m: 0.01, seed: 3,
    switch_m: 1, hysteresis_m: 0.1, on_delay_s: 0.1, off_delay_s: 0.2}}
identification_readers: {Tag: {pose: {position_m: [0, 0, 1]}, range_m: 0.5, hysteresis_m: 0.1, on_delay_s: 0.1, off_delay_s: 0.2}}
limit_switches: {End: {robot: R, joint: j, position_rad: 0.7, side: below, hysteresis_rad: 0.1, on_delay_s: 0.1, off_delay_s: 0.2}}
force_switches: {Load: {signal: G.force, threshold_N: 5, hysteresis_N: 1, noise_N: 0.1, lag_s: 0.1, resolution_N: 0.2, seed: 4, on_delay_s: 0.1, off_delay_s: 0.2}}
temperature_sensors: {Hot: {of: Odd, noise_K: 0.1, lag_s: 0.1, resolution_K: 0.2, seed: 5, switch_degC: 80, hysteresis_K: 2, on_delay_s: 0.1, off_delay_s: 0.2}}
presence_sensors: {There: {holder: Floor, on_delay_s: 0.1, off_delay_s: 0.2}}
wires: {Driver.speed: 2 * G.width}
linear_axes: {Lift: {grounds: [Platform], mounted_on: Floor, direction: [0, 0.1, 1], stroke_m: [-0.2, 0.5], position_m: 0.1, max_speed_m_per_s: 0.2, max_acceleration_m_per_s2: 1}}
turntables: {Table: {grounds: [Disc], axis: [0, 0.1, 1], center_m: [5, 1.1, 0.1], range_rad: [-1, 2], position_rad: 0.3, max_speed_rad_per_s: 1, max_acceleration_rad_per_s2: 2}}
cylinders: {Cylinder: {grounds: [Pusher], direction: [1, 0.1, 0], stroke_m: 0.1, extend_time_s: 0.5, retract_time_s: 0.4, acceleration_m_per_s2: 10, switch_range_m: 0.002, extended: true}}
conveyors:
  Straight: {ground: Floor, direction: [1, 0.1, 0], max_speed_m_per_s: 1, max_acceleration_m_per_s2: 2, speed_m_per_s: 0.5, running: true}
  Curved: {ground: Platform, curve: {center_m: [0.1, 0.2, 0.3], axis: [0, 0.1, 1], radius_m: 0.5}, max_speed_m_per_s: 1, max_acceleration_m_per_s2: 2}
clamps: {Clamp: {ground: Floor, center_m: [0.1, 0.2, 0.3], size_m: [0.1, 0.2, 0.3], closing_time_s: 0.1, closed: true}}
processes: {all: {level_of_detail: 1, members: all}}
contact:
  defaults: {youngs_modulus_Pa: 1.0e+6, poisson_ratio: 0.3, layer_depth_m: 0.001, areal_damping_N_s_per_m3: 2.0e+5, damping_depth_m: 3.0e-6, friction: 0.3,
    friction_velocity_m_per_s: 0.002, tangential_stiffness_ratio: 0.7, tangential_damping_ratio: 0.6, friction_law: stick}
  grippers: {friction: 0.9}
  element_edge_m: 0.05
  cache_unmoved_pairs: true
  parallel: false
  components: {Odd: {friction: 0.4, element_edge_m: 0.0505, role: base}}
  pairs: [{pair: [Plain, Odd], friction: 0.5, force: contact}]
collision_checking: {enabled: true, min_clearance_m: 0.01, hysteresis_m: 0.002}
controller: {parameters: {x: 1}}
tags: [one]
named_poses: {Drop: {description: a place, tags: [two], pose: {position_m: [0, 0, 1], rpy_deg: [0, 0, 90]}, bounds_m: {lower: [-1, -1, -1], upper: [1, 1, 1]}}}
report_at: [{name: first, time_s: 0.5}]
expected: {tolerance_m: 0.001, parts: {Plain: {position_m: [0, 0, 1]}}}
assertions: {a: {check: held_by, part: Odd, by: Plain, time_s: 0.5}}
)";

/// Keys that are in the model, of which this cell makes no use.
const std::set<std::string> kWithoutEffectHere{
    "solver.contact.step_s",  // counts where a cell begins at level of detail 3
};

using Leaves = std::map<std::string, std::pair<YAML::Node, const KeyInfo*>>;  // by dotted key

const KeyInfo* find_field(const KeyInfo& section, const std::string& key) {
  for (const KeyInfo& field : section.items)
    if (field.key == key || field.key == "*") return &field;
  return nullptr;
}

void collect(const YAML::Node& node, const KeyInfo& info, const std::string& path, bool in_model,
             Leaves& leaves, std::set<std::string>& outside) {
  for (const auto& entry : node) {
    const auto key = entry.first.as<std::string>();
    const std::string below = path.empty() ? key : path + "." + key;
    const KeyInfo* field = find_field(info, key);
    ASSERT_NE(field, nullptr) << below;
    const bool counts = in_model && field->in_model;
    if (entry.second.IsMap()) {
      collect(entry.second, *field, below, counts, leaves, outside);
      continue;
    }
    leaves.emplace(below, std::pair{entry.second, field});
    if (!counts) outside.insert(below);
  }
}

/// Other values of a field; the first readable one is used.
std::vector<std::string> others(const YAML::Node& node, const KeyInfo& field) {
  std::vector<std::string> result;
  if (node.IsScalar()) {
    const std::string text = node.Scalar();
    for (const std::string& word : field.choices)
      if (word != text) result.push_back(word);
    if (field.kind == KeyInfo::Kind::flag) result = {text == "true" ? "false" : "true"};
    if (double number = 0.0;
        field.kind == KeyInfo::Kind::number && YAML::convert<double>::decode(node, number))
      result = {std::to_string(number == 0.0 ? 0.01 : 0.97 * number),
                std::to_string(0.97e9 * number) + "e-9"};
    if (int number = 0; field.kind == KeyInfo::Kind::whole && YAML::convert<int>::decode(node, number))
      result = {std::to_string(number + 1)};
  } else if (field.kind == KeyInfo::Kind::list && node.size() > 0 && node[0].IsScalar()) {
    for (std::size_t i = node.size(); i-- > 0;) {
      double number = 0.0;
      if (!YAML::convert<double>::decode(node[i], number)) continue;
      std::string list = "[";
      for (std::size_t k = 0; k < node.size(); ++k)
        list += (k == 0 ? "" : ", ") +
                (k == i ? std::to_string(number == 0.0 ? 0.001 : 0.9 * number) : node[k].Scalar());
      result.push_back(list + "]");
    }
  }
  return result;
}

TEST(ScenarioHash, HasEveryKeyThatTheTablesSayIsInTheModel) {
  const test::TemporaryDirectory directory;
  directory.write("cube.obj", kCube);
  directory.write("arm.urdf", kArm);
  directory.write("cell.yaml", kCell);
  const auto hash = [&](const std::vector<std::string>& overrides) {
    ScenarioOptions options;
    options.overrides = overrides;
    return model_hash(*load_cell(directory.path() / "cell.yaml", options));
  };
  const std::uint64_t usual = hash({});
  EXPECT_EQ(hash({}), usual);
  Leaves leaves;
  std::set<std::string> outside;
  const KeyInfo info = scenario_info();
  collect(YAML::Load(kCell), info, "", true, leaves, outside);
  int counted = 0;
  for (const auto& [key, leaf] : leaves) {
    const bool in_model = outside.count(key) == 0;
    if (kWithoutEffectHere.count(key) != 0) continue;
    bool differs = false, was_read = false;
    for (const std::string& value : others(leaf.first, *leaf.second)) {
      try {
        differs = differs || hash({key + "=" + value}) != usual;
        was_read = true;
      } catch (const std::exception&) {
        continue;  // e.g. a drive with other keys
      }
    }
    if (!was_read) continue;
    EXPECT_EQ(differs, in_model) << key;
    counted += in_model ? 1 : 0;
  }
  EXPECT_GE(counted, 145);
}

}  // namespace
}  // namespace takt
