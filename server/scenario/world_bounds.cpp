#include "server/scenario/world_bounds.h"

#include <algorithm>
#include <limits>

#include "idl/common/text.h"
#include "server/geometry/mesh/diagnostic.h"

namespace takt {

namespace {

Aabb joined(const Aabb& a, const Aabb& b) {
  return {a.lower.cwiseMin(b.lower), a.upper.cwiseMax(b.upper)};
}

double distance(const Aabb& a, const Aabb& b) {
  return (a.lower - b.upper).cwiseMax(b.lower - a.upper).cwiseMax(0.0).norm();
}

BodyBox mesh_box(const ComponentDescription& component) {
  Vec3 lower = Vec3::Constant(std::numeric_limits<double>::infinity()), upper = -lower;
  for (std::size_t i = 0; i + 2 < component.mesh->vertices.size(); i += 3) {
    const Vec3 v(component.mesh->vertices[i], component.mesh->vertices[i + 1],
                 component.mesh->vertices[i + 2]);
    lower = lower.cwiseMin(v), upper = upper.cwiseMax(v);
  }
  return {0.5 * (lower + upper), 0.5 * (upper - lower)};
}

/// A box around the reach of the flange.
Aabb reached(const KinematicRobotParameters& robot) {
  double reach_m = robot.arm.X_JF.p.norm();
  for (const JointModel& joint : robot.arm.joints) {
    reach_m += joint.X_PJ.p.norm();
    if (joint.type == JointType::prismatic) reach_m += std::max(std::abs(joint.lower), std::abs(joint.upper));
  }
  return {robot.X_WR.p - Vec3::Constant(reach_m), robot.X_WR.p + Vec3::Constant(reach_m)};
}

/// A Part or a Ground, as it stands at the start.
struct Standing {
  std::string name, key;
  Vec3 p_W;
  Aabb box;
};

std::vector<Standing> all_standing(const Scenario& scenario, const CellModel& cell) {
  std::vector<Standing> all;
  // Parts come first in the cell, then Grounds, both in the scenario's order.
  const auto add = [&](const char* group, const auto& items) {
    for (const auto& item : items)
      all.push_back({item.name, group + ("." + item.name), item.X_WB.p,
                     mesh_box(cell.description.components[all.size()]).at(item.X_WB, 0.0)});
  };
  add("parts", scenario.parts);
  add("grounds", scenario.grounds);
  return all;
}

std::string size_text(const Vec3& size) {
  return number_text(size.x(), 4) + " x " + number_text(size.y(), 4) + " x " + number_text(size.z(), 4) +
         " m";
}

class UnitNotes {
 public:
  explicit UnitNotes(CellModel& cell) : cell_(cell) {}

  void mesh(int id, const std::string& component, const std::string& key, double scale) {
    const ComponentDescription& description = cell_.description.components[static_cast<std::size_t>(id)];
    const Vec3 size = 2.0 * mesh_box(description).half_B;
    if (!(size.maxCoeff() > kOddSize_m)) return;
    note(component, component + " is " + size_text(size) + " large (" + description.mesh_uri +
                        "). Is the file in millimetres? Then set " + key +
                        ".mesh_scale: " + number_text(0.001 * scale, 4) + ".");
  }

  void place(const std::string& component, const std::string& key, const Vec3& p, double distance_m,
             const std::string& from) {
    if (!(distance_m > kOddSize_m)) return;
    note(component, component + " stands at " + place_text(p) + ", " + number_text(distance_m, 4) +
                        " m from " + from + ". Is " + key + ".position_m in metres?");
  }

  void width(const std::string& gripper, double width_m) {
    if (!(width_m > kOddWidth_m)) return;
    note(gripper, gripper + " opens by " + number_text(width_m, 4) + " m. Is grippers." + gripper +
                      ".max_width_m in metres?");
  }

  void angle(const Scenario::OddAngle& angle) {
    std::string degrees = angle.key;
    degrees.replace(degrees.rfind("_rad"), 4, "_deg");
    note(angle.owner, angle.key + " has " + number_text(angle.value_rad, 4) +
                          " rad, more than a full turn. Is it in degrees? Then call it " + degrees + ".");
  }

 private:
  void note(const std::string& component, const std::string& sentence) {
    cell_.import_notes.push_back({component, sentence, {}});
  }
  CellModel& cell_;
};

void note_places(const Scenario& scenario, const CellModel& cell, UnitNotes& notes) {
  const std::vector<Standing> standing = all_standing(scenario, cell);
  std::vector<double> far_m(standing.size(), std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < standing.size(); ++i) {
    for (const KinematicRobotParameters& robot : cell.robots)
      far_m[i] = std::min(far_m[i], distance(standing[i].box, reached(robot)));
    if (!cell.robots.empty()) continue;
    // A near one is enough.
    for (std::size_t j = 0; j < standing.size() && far_m[i] > kOddSize_m; ++j)
      if (j != i) far_m[i] = std::min(far_m[i], distance(standing[i].box, standing[j].box));
    if (standing.size() == 1) far_m[i] = 0.0;
  }
  const char* from = cell.robots.empty() ? "all other components" : "what any robot reaches";
  // If all components are far from the robots, the robots are misplaced.
  if (!cell.robots.empty() && !standing.empty()) {
    const double nearest = *std::min_element(far_m.begin(), far_m.end());
    if (nearest > kOddSize_m) {
      for (const ScenarioRobot& robot : scenario.robots)
        notes.place(robot.name, "robots." + robot.name + ".pose", robot.X_WR.p, nearest, "all components");
      return;
    }
  }
  for (std::size_t i = 0; i < standing.size(); ++i)
    notes.place(standing[i].name, standing[i].key + ".pose", standing[i].p_W, far_m[i], from);
}

}  // namespace

void add_world_bounds(const Scenario& scenario, CellModel& cell) {
  if (scenario.bounds_m) {
    cell.bounds = {(*scenario.bounds_m)[0], (*scenario.bounds_m)[1]};
    return;
  }
  std::optional<Aabb> box;
  const auto add = [&box](const Aabb& more) { box = box ? joined(*box, more) : more; };
  for (const Standing& one : all_standing(scenario, cell)) add(one.box);
  for (const KinematicRobotParameters& robot : cell.robots) add(reached(robot));
  if (!box) return;
  const Vec3 room = Vec3::Constant(std::max(kRoom_m, (box->upper - box->lower).norm()));
  cell.bounds = {box->lower - room, box->upper + room};
}

void note_units(const Scenario& scenario, CellModel& cell) {
  UnitNotes notes(cell);
  int id = 0;
  for (const ScenarioPart& part : scenario.parts)
    notes.mesh(id++, part.name, "parts." + part.name, part.mesh_scale);
  for (const ScenarioGround& ground : scenario.grounds)
    notes.mesh(id++, ground.name, "grounds." + ground.name, ground.mesh_scale);
  for (const ScenarioGripper& gripper : scenario.grippers) {
    const std::string key = "grippers." + gripper.name;
    for (const std::string& name : {gripper.name, gripper.name + "/left_jaw"})
      notes.mesh(cell.description.find_component(name), name, key, gripper.mesh_scale);
    notes.width(gripper.name, gripper.max_width_m);
    notes.place(gripper.name, key + ".mount", gripper.X_FG.p, gripper.X_FG.p.norm(), "its flange");
    notes.place(gripper.name, key + ".tool_center_point", gripper.X_GT.p, gripper.X_GT.p.norm(), "its body");
  }
  for (const Scenario::OddAngle& angle : scenario.odd_angles) notes.angle(angle);
  note_places(scenario, cell, notes);
}

}  // namespace takt
