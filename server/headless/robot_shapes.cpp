#include "server/headless/robot_shapes.h"

#include <algorithm>
#include <exception>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

#include "plant_models/robot/arm_kinematics.h"
#include "server/scenario/urdf_arm.h"
#include "server/scenario/urdf_meshes.h"

namespace takt {
namespace {

constexpr double kMostTriangles = 2e6;  // of all robots: a picture of more takes minutes
constexpr double kCurved_rad = 0.6;
constexpr render::Color kPlain{0.86, 0.87, 0.89};

struct Surface {
  TriangleMesh mesh;
  render::Color color;
};

/// The shapes for pictures in the frame in which X_AL places the link, or those of collision checking, or none.
std::vector<Surface> surfaces(const UrdfRobot& robot, const UrdfLink& link, const Pose& X_AL) {
  for (const auto* shapes : {&link.visuals, &link.collisions}) {
    std::vector<Surface> made;
    try {
      for (const UrdfShape& shape : *shapes) {
        const auto color =
            shape.color ? render::Color{(*shape.color)[0], (*shape.color)[1], (*shape.color)[2]} : kPlain;
        for (NamedMesh& one : urdf_meshes(robot, link.name, {shape}, "link '" + link.name + "': ", X_AL))
          made.push_back({std::move(one.mesh), color});
      }
      if (!made.empty()) return made;
    } catch (const std::exception&) {  // a file that is missing, or of a format that is not read
    }
  }
  return {};
}

/// Names of the links that the flange link carries.
std::set<std::string> carried_by(const UrdfRobot& robot, std::size_t flange) {
  std::set<std::string> names;
  std::vector<std::size_t> walk{flange};
  for (std::size_t i = 0; i < walk.size(); ++i)
    for (const std::size_t joint : robot.links[walk[i]].below) {
      walk.push_back(robot.joints[joint].child);
      names.insert(robot.links[walk.back()].name);
    }
  return names;
}

}  // namespace

RobotShapes::RobotShapes(const Scenario& scenario, const CellDescription& cell,
                         const PackageFolders& packages) {
  double triangles = 0.0;
  for (const RobotDescription& description : cell.robots) {
    Robot& robot = robots_.emplace_back();
    robot.description = &description;
    const auto source = std::ranges::find(scenario.robots, description.name, &ScenarioRobot::name);
    if (source == scenario.robots.end()) continue;
    try {
      const UrdfRobot urdf = read_urdf(source->urdf, packages);
      const bool has_fingers = std::ranges::any_of(scenario.grippers, [&](const ScenarioGripper& gripper) {
        return gripper.robot == description.name && gripper.fingers;
      });
      const std::set<std::string> left_out =
          has_fingers ? carried_by(urdf, urdf_ends(urdf, source->base_link, source->flange_link).flange)
                      : std::set<std::string>{};
      for (const RobotLink& link : description.links) {
        if (left_out.contains(link.name)) continue;
        for (Surface& surface : surfaces(urdf, urdf.links[urdf.find_link(link.name)], link.X_JL)) {
          triangles += static_cast<double>(surface.mesh.triangles.size());
          if (triangles > kMostTriangles) throw std::length_error("too many triangles for a picture");
          Piece& piece = robot.pieces.emplace_back();
          piece.joint = link.joint;
          piece.mesh.color = surface.color;
          piece.mesh.vertices = std::move(surface.mesh.vertices);
          piece.mesh.triangles = std::move(surface.mesh.triangles);
          render::smooth(piece.mesh, kCurved_rad);
        }
      }
    } catch (
        const std::exception&) {  // the file is gone since the cell was built, or its shapes are too many
      robot.pieces.clear();
    }
  }
}

bool RobotShapes::add_to(render::Scene& scene, std::size_t index, const double* q, const Pose& X_WR) const {
  const Robot& robot = robots_.at(index);
  if (robot.pieces.empty()) return false;
  ArmPoses poses;
  forward_kinematics(robot.description->arm, q, poses);
  for (const Piece& piece : robot.pieces) {
    render::Mesh& mesh = scene.meshes.emplace_back(piece.mesh);
    mesh.X_WB = piece.joint < 0 ? X_WR : X_WR * poses.link[static_cast<std::size_t>(piece.joint)];
  }
  return true;
}

}  // namespace takt
