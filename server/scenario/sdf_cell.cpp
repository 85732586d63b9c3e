#include "server/scenario/sdf_cell.h"

#include <algorithm>
#include <cctype>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <stdexcept>

#include "idl/common/disjoint_sets.h"
#include "idl/common/text.h"
#include "server/geometry/mesh/import.h"
#include "server/scenario/scenario_names.h"
#include "server/scenario/sdf_robot.h"
#include "server/scenario/urdf_meshes.h"

namespace takt {

namespace {

namespace fs = std::filesystem;

class Builder {
 public:
  Builder(const SdfWorld& world, fs::path directory) : world_(world), directory_(std::move(directory)) {}

  SdfCell build() {
    Scenario& scenario = cell_.scenario;
    std::set<std::string> none;
    scenario.name = unique(world_.name, none);
    scenario.file = directory_ / (scenario.name + ".yaml");
    scenario.duration_s = 10.0;
    scenario.gravity_m_per_s2 = world_.gravity_m_per_s2;
    cell_.notes = world_.notes;
    for (const SdfModel& model : world_.models) add_model(model);
    number_parts();
    for (const auto& [element, count] : world_.left_out)
      cell_.notes.push_back("<" + element + "> is left out (" + std::to_string(count) +
                            "): takt does not read it from SDFormat.");
    return std::move(cell_);
  }

 private:
  void note(const std::string& sentence) { cell_.notes.push_back(sentence + "."); }

  /// A name that scenarios allow, and that is not among these yet.
  static std::string unique(const std::string& name, std::set<std::string>& names) {
    std::string key;
    for (const char c : name) key += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
    if (key.empty() || std::isalpha(static_cast<unsigned char>(key.front())) == 0) key.insert(0, "m_");
    key.resize(std::min(key.size(), kLongestScenarioName - 6));
    std::string result = key;
    for (int number = 2; !names.insert(result).second; ++number) result = key + "_" + std::to_string(number);
    return result;
  }

  void add_model(const SdfModel& model) {
    if (model.links.empty()) {
      note("model '" + model.name + "' is left out: it has no link");
      return;
    }
    std::vector<std::size_t> all(model.links.size());
    std::iota(all.begin(), all.end(), 0U);
    if (model.is_static) {
      add_body(model, all, true, model.name);
      return;
    }
    DisjointSets sets(model.links.size());
    for (const SdfJoint& joint : model.joints) {
      if (joint.parent) sets.join(*joint.parent, joint.child);
      if (joint.type == UrdfJointType::floating)
        note(joint.place + "joint '" + joint.name + "' is fixed: takt does not move joints of type " +
             joint.kind);
    }
    std::map<std::size_t, std::vector<std::size_t>> groups;
    for (const std::size_t link : all) groups[sets.root(link)].push_back(link);
    for (const auto& group : groups) {
      const std::vector<std::size_t>& links = group.second;
      const std::string name =
          groups.size() == 1 ? model.name : model.name + "_" + model.links[links.front()].name;
      if (add_robot(model, links, name)) continue;
      const bool held = std::any_of(model.joints.begin(), model.joints.end(),
                                    [&](const SdfJoint& joint) {
                                      return !joint.parent && std::find(links.begin(), links.end(),
                                                                        joint.child) != links.end();
                                    }) ||
                        std::all_of(links.begin(), links.end(),
                                    [&](std::size_t link) { return model.links[link].is_massless; });
      add_body(model, links, held, name);
    }
  }

  bool add_robot(const SdfModel& model, const std::vector<std::size_t>& links, const std::string& name) {
    auto robot = sdf_robot(model, links, [&](const UrdfShape& shape) { return copy_of(shape.filename); });
    if (!robot) return false;
    ScenarioRobot made;
    made.name = unique(name, names_);
    made.urdf = directory_ / "robots" / (made.name + ".urdf");
    made.base_link = robot->base_link, made.flange_link = robot->flange_link;
    made.X_WR = robot->X_WR;
    made.initial_joints_rad = robot->initial_joints;
    cell_.urdfs.emplace_back(made.urdf, std::move(robot->urdf));
    note("model '" + model.name + "' is a robot: its chain is from link '" + made.base_link + "' to '" +
         made.flange_link + "', with " + std::to_string(made.initial_joints_rad.size()) + " moving joints");
    cell_.notes.insert(cell_.notes.end(), robot->notes.begin(), robot->notes.end());
    if (!robot->fingers.empty()) {
      ScenarioGripper gripper;
      gripper.name = unique(made.name + "_gripper", names_);
      gripper.robot = made.name;
      gripper.fingers = ScenarioFingers{};
      gripper.fingers->joints = robot->fingers;
      note("model '" + model.name + "': its fingers '" + robot->fingers[0] + "' and '" + robot->fingers[1] +
           "' are gripper " + gripper.name);
      cell_.scenario.grippers.push_back(std::move(gripper));
    }
    cell_.scenario.robots.push_back(std::move(made));
    return true;
  }

  /// The name that a URDF in robots/ has for a mesh file, which is copied beside it.
  std::optional<std::string> copy_of(const std::string& file) {
    const fs::path original = file;
    const std::string kind = lower_text(original.extension().string());
    if (kind != ".obj" && kind != ".stl" && kind != ".glb" && kind != ".dae") {
      if (refused_.insert(file).second)
        note("mesh " + original.string() + " is left out; allowed: .obj, .stl, .glb, .dae");
      return std::nullopt;
    }
    const auto [at, added] = copied_.emplace(file, fs::path());
    if (added) {
      at->second = fs::path("meshes") / (unique(original.stem().string(), files_) + kind);
      cell_.copies.emplace_back(directory_ / "robots" / at->second, original);
    }
    return at->second.generic_string();
  }

  /// The solids of the links, in the frame of the first one.
  std::vector<NamedMesh> solids(const SdfModel& model, const std::vector<std::size_t>& links) {
    const Pose X_BW = model.links[links.front()].X_WL.inverse();
    std::vector<NamedMesh> result;
    for (const std::size_t index : links) {
      const SdfLink& link = model.links[index];
      if (link.collisions.empty() && !link.visuals.empty())
        note("link '" + link.name + "' of model '" + model.name +
             "' has no <collision>: its <visual> is the body that touches others");
      for (const UrdfShape& shape : link.collisions.empty() ? link.visuals : link.collisions)
        add_shape(model, link, shape, X_BW * link.X_WL, result);
    }
    for (std::size_t i = 0; i < result.size(); ++i) result[i].name = "shape_" + std::to_string(i + 1);
    return result;
  }

  void add_shape(const SdfModel& model, const SdfLink& link, const UrdfShape& shape, const Pose& X_BL,
                 std::vector<NamedMesh>& result) {
    UrdfRobot file;  // what urdf_meshes() reads files by
    file.file = directory_ / "world.sdf";
    UrdfLink one;
    one.name = link.name, one.collisions = {shape};
    const std::string where = "a shape of link '" + link.name + "' of model '" + model.name + "' ";
    try {
      for (NamedMesh& object : urdf_meshes(file, one, X_BL)) {
        if (const std::string problem = make_solid(object); !problem.empty())
          note(where + "(" + object.name + ") is its convex hull: " + problem);
        result.push_back(std::move(object));
      }
    } catch (const std::invalid_argument& flat) {
      note(where + "is left out: " + flat.what());
    } catch (const MeshError& reason) {
      note(where + "is left out: " + reason.what());
    }
  }

  void add_body(const SdfModel& model, const std::vector<std::size_t>& links, bool stands,
                const std::string& name) {
    std::vector<NamedMesh> objects = solids(model, links);
    if (objects.empty()) {
      note("model '" + name + "' is left out: it has no shape");
      return;
    }
    const std::string key = unique(name, names_);
    const fs::path mesh = directory_ / "meshes" / (key + ".obj");
    const bool one = objects.size() == 1;
    cell_.meshes.emplace_back(mesh, std::move(objects));
    stands ? add_ground(model, links, key, mesh, one) : add_part(model, links, key, mesh, one);
  }

  template <class Component>
  void fill(Component& component, const SdfModel& model, const std::vector<std::size_t>& links,
            const fs::path& mesh, bool one) {
    component.mesh = mesh;
    component.X_WB = model.links[links.front()].X_WL;
    if (!one) component.convex.kind = ConvexSource::Kind::objects;
    for (const std::size_t link : links) {
      if (!model.links[link].color) continue;
      component.color = *model.links[link].color;
      return;
    }
  }

  void add_ground(const SdfModel& model, const std::vector<std::size_t>& links, const std::string& key,
                  const fs::path& mesh, bool one) {
    ScenarioGround ground;
    ground.name = key;
    fill(ground, model, links, mesh, one);
    cell_.scenario.grounds.push_back(std::move(ground));
  }

  void add_part(const SdfModel& model, const std::vector<std::size_t>& links, const std::string& key,
                const fs::path& mesh, bool one) {
    ScenarioPart part;
    part.name = key;
    fill(part, model, links, mesh, one);
    BodyInertia body;
    bool stated = true;
    for (const std::size_t link : links) {
      const auto& inertial = model.links[link].inertial;
      stated = stated && inertial.has_value();
      if (inertial)
        body = combined(body, inertial->at_centre,
                        part.X_WB.inverse() * model.links[link].X_WL * inertial->X_LC);
    }
    part.mass_kg = body.mass_kg > 0.0 ? body.mass_kg : 1.0;
    const std::string problem = stated ? inertia_problem(body) : "";
    if (stated && problem.empty()) {
      part.center_of_mass_m = body.p_BBcm_B;
      part.inertia_kg_m2 = 0.5 * (body.I_BBcm_B + body.I_BBcm_B.transpose());
    } else {
      note("Part '" + key + "': " + (stated ? problem : "a link has no <inertial>") + "; it has " +
           number_text(part.mass_kg, 6) + " kg at uniform density");
    }
    cell_.scenario.parts.push_back(std::move(part));
  }

  /// A Part rests on Parts of higher numbers: those that begin below it, along gravity.
  void number_parts() {
    std::vector<ScenarioPart>& parts = cell_.scenario.parts;
    const Vec3 up =
        world_.gravity_m_per_s2.norm() > 0.0 ? Vec3(-world_.gravity_m_per_s2.normalized()) : Vec3::UnitZ();
    std::vector<std::pair<double, std::size_t>> order;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      double least = std::numeric_limits<double>::infinity();
      for (const auto& [file, objects] : cell_.meshes)
        if (file == parts[i].mesh)
          for (const NamedMesh& object : objects)
            for (const Vec3& v : object.mesh.vertices) least = std::min(least, up.dot(parts[i].X_WB * v));
      order.emplace_back(least, i);
    }
    std::stable_sort(order.begin(), order.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    for (std::size_t rank = 0; rank < order.size(); ++rank)
      parts[order[rank].second].hierarchy = std::min(static_cast<int>(rank) + kMinHierarchy, kMaxHierarchy);
  }

  const SdfWorld& world_;
  const fs::path directory_;
  SdfCell cell_;
  std::set<std::string> names_, files_, refused_;
  std::map<std::string, fs::path> copied_;
};

}  // namespace

SdfCell sdf_cell(const SdfWorld& world, const std::filesystem::path& directory) {
  return Builder(world, directory).build();
}

}  // namespace takt
