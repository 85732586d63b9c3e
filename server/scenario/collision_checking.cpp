#include <algorithm>
#include <cstdlib>
#include <span>

#include "idl/common/glob.h"
#include "idl/common/text.h"
#include "server/geometry/mesh/import.h"
#include "server/scenario/cell_builders.h"
#include "server/scenario/scenario_reader.h"
#include "server/scenario/urdf_collision.h"

namespace takt {

namespace {

constexpr std::size_t kNamesInError = 40;

RoundedShape plain(ConvexShape shape) {
  return {std::move(shape), 0.0};
}

void add_links(const Scenario& scenario, const std::vector<UrdfArm>& arms, CellModel& cell) {
  for (std::size_t r = 0; r < scenario.robots.size(); ++r) {
    const ScenarioRobot& robot = scenario.robots[r];
    for (UrdfLinkShapes& link : urdf_collision(arms[r])) {
      CheckedBody body;
      body.name = robot.name + "/" + link.link;
      body.robot = static_cast<int>(r);
      body.joint = link.joint;
      body.moves = link.joint >= 0 || !robot.mounted_on.empty();
      body.shapes = std::move(link.shapes);
      cell.clearance.bodies.push_back(std::move(body));
    }
  }
}

void add_components(const Scenario& scenario, const SharedMeshes& meshes, CellModel& cell) {
  for (std::size_t c = 0; c < cell.components.size(); ++c) {
    const Component& component = cell.components[c];
    CheckedBody body;
    body.name = component.name;
    body.component = static_cast<int>(c);
    body.moves = component.type != ComponentType::ground;
    body.is_part = component.type == ComponentType::part;
    for (const ConvexShape& shape : component.convex) body.shapes.push_back(plain(shape));
    if (component.type != ComponentType::gripper) body.solid = meshes[c]->probe();
    if (component.type == ComponentType::gripper) {
      const auto gripper = static_cast<std::size_t>(component.gripper);
      body.robot = cell.grippers[gripper].parameters.robot;
      if (component.role == GripperRole::palm) {
        // The palm has no shape of its own in the simulation, where it stands for the space between the jaws.
        for (const NamedMesh& object :
             import_mesh_objects(scenario.grippers[gripper].body_mesh, scenario.grippers[gripper].mesh_scale))
          body.shapes.push_back(plain(ConvexShape::from_points(convex_hull_vertices(object.mesh.vertices))));
      }
    }
    cell.clearance.bodies.push_back(std::move(body));
  }
}

/// Number of the joint that moves a body of a robot, counted from 1; 0: the base.
int moving_joint(const CellModel& cell, const CheckedBody& body) {
  if (body.component < 0) return body.joint + 1;
  return cell.robots[static_cast<std::size_t>(body.robot)].arm.joint_count();
}

bool are_joined(const CellModel& cell, int a, int b) {
  return std::any_of(cell.joined.begin(), cell.joined.end(), [&](const std::pair<int, int>& joined) {
    return std::minmax(joined.first, joined.second) == std::minmax(a, b);
  });
}

/// Whether `base` is fixed to the base of a robot that stands on `ground`.
bool stands_on(const CellModel& cell, const CheckedBody& base, const CheckedBody& ground) {
  return base.robot >= 0 && base.component < 0 && base.joint < 0 && ground.component >= 0 &&
         cell.robots[static_cast<std::size_t>(base.robot)].mount == ground.component;
}

bool is_checked(const CellModel& cell, const CheckedBody& a, const CheckedBody& b) {
  if (a.shapes.empty() || b.shapes.empty()) return false;
  if (!a.moves && !b.moves) return false;
  if (stands_on(cell, a, b) || stands_on(cell, b, a)) return false;
  if (a.robot < 0 && b.robot < 0) return !are_joined(cell, a.component, b.component);
  if (a.robot >= 0 && b.robot >= 0) {
    if (a.robot != b.robot) return true;
    if (a.component >= 0 && b.component >= 0) return false;
    return std::abs(moving_joint(cell, a) - moving_joint(cell, b)) > 1;
  }
  if (a.component >= 0 && b.component >= 0 && !a.is_part && !b.is_part) {
    return cell.pairs.table().find_either(a.component, b.component) != PairTable::kNone;
  }
  return true;
}

/// The elastic layer of the contact law allows penetrations up to its depth.
double thickest_layer_m(const Scenario& scenario) {
  double layer_m = scenario.contact.defaults.parameters().layer_depth_m;
  for (const ScenarioContactComponent& component : scenario.contact.components)
    layer_m = std::max(layer_m, component.stated.value(&ContactParameters::layer_depth_m).value_or(0.0));
  for (const ScenarioContactPair& pair : scenario.contact.pairs)
    layer_m = std::max(layer_m, pair.stated.value(&ContactParameters::layer_depth_m).value_or(0.0));
  return layer_m;
}

bool fits(const ScenarioCheckedPair& rule, const CheckedBody& a, const CheckedBody& b) {
  return glob_match(rule.pair, a.name, b.name);
}

[[noreturn]] void refuse(const ScenarioCheckedPair& rule, const std::string& found,
                         const std::string& allowed) {
  throw ScenarioError(rule.place + ": found " + found + "; allowed: " + allowed);
}

void require_known_names(const Scenario& scenario, const std::vector<ScenarioCheckedPair>& rules,
                         const std::vector<CheckedBody>& bodies) {
  for (const ScenarioCheckedPair& rule : rules) {
    for (const std::string& name : rule.pair) {
      if (fits_a_deleted_part(scenario, name) ||
          std::any_of(bodies.begin(), bodies.end(),
                      [&](const CheckedBody& body) { return glob_match(name, body.name); }))
        continue;
      std::string list = list_names(std::span(bodies).first(std::min(bodies.size(), kNamesInError)));
      if (bodies.size() > kNamesInError) list += ", ...";
      refuse(rule, "'" + name + "', which fits no body", "names or patterns (*) of " + list);
    }
  }
}

}  // namespace

bool fits_a_deleted_part(const Scenario& scenario, const std::string& pattern) {
  return std::any_of(scenario.deleted.begin(), scenario.deleted.end(),
                     [&](const std::string& name) { return glob_match(pattern, name); });
}

void add_collision_checking(const Scenario& scenario, const std::vector<UrdfArm>& arms,
                            const SharedMeshes& meshes, CellModel& cell) {
  const ScenarioCollisionChecking& checking = scenario.collision_checking;
  cell.clearance = {};
  cell.clearance.enabled = true;
  cell.clearance.hysteresis_m = checking.hysteresis_m;
  add_links(scenario, arms, cell);
  add_components(scenario, meshes, cell);
  const double layer_m = thickest_layer_m(scenario);
  const std::vector<CheckedBody>& bodies = cell.clearance.bodies;
  require_known_names(scenario, checking.limits, bodies);
  require_known_names(scenario, checking.ignore, bodies);
  std::vector<bool> used(checking.limits.size(), false);
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    for (std::size_t j = i + 1; j < bodies.size(); ++j) {
      if (!is_checked(cell, bodies[i], bodies[j])) continue;
      // Grippers and other Parts must come close to Parts: their pairs have a limit only if the scenario
      // states one.
      const bool gripper_and_part =
          (bodies[i].is_part && bodies[j].component >= 0) || (bodies[j].is_part && bodies[i].component >= 0);
      CheckedPair pair{static_cast<int>(i), static_cast<int>(j),
                       gripper_and_part ? 0.0 : checking.min_clearance_m};
      pair.by_solids = bodies[i].solid != nullptr && bodies[j].solid != nullptr;
      if (pair.by_solids) {
        pair.touching_m = std::max(pair.touching_m, scenario.contact_margin_m);
        pair.touching_by_contact_m = std::max(pair.touching_m, layer_m);
      }
      for (std::size_t k = 0; k < checking.limits.size(); ++k) {
        if (!fits(checking.limits[k], bodies[i], bodies[j])) continue;
        used[k] = true;
        pair.limit_m = checking.limits[k].min_clearance_m;
      }
      const bool ignored =
          std::any_of(checking.ignore.begin(), checking.ignore.end(),
                      [&](const ScenarioCheckedPair& rule) { return fits(rule, bodies[i], bodies[j]); });
      if (!ignored) cell.clearance.pairs.push_back(pair);
    }
  }
  for (std::size_t k = 0; k < used.size(); ++k) {
    if (used[k]) continue;
    const ScenarioCheckedPair& rule = checking.limits[k];
    if (fits_a_deleted_part(scenario, rule.pair[0]) || fits_a_deleted_part(scenario, rule.pair[1])) continue;
    refuse(
        rule, "[" + rule.pair[0] + ", " + rule.pair[1] + "], which fits no checked pair",
        "a pair of a robot link or gripper with a ground, a part, another robot's link or gripper, or a link "
        "of the same robot that is not its neighbour; or of a part with a part or a ground");
  }
  for (const CheckedBody& body : bodies) cell.description.checked_bodies.push_back(body.name);
}

}  // namespace takt
