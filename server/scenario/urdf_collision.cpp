#include "server/scenario/urdf_collision.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/geometry/mesh/import.h"
#include "server/scenario/urdf_meshes.h"

namespace takt {

namespace {

/// The prism whose sides touch the cylinder.
RoundedShape prism(double radius, double length) {
  const double corner = radius / std::cos(std::numbers::pi / kCylinderSides);
  std::vector<Vec3> vertices;
  for (int i = 0; i < kCylinderSides; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kCylinderSides;
    for (const double z : {-0.5 * length, 0.5 * length})
      vertices.emplace_back(corner * std::cos(angle), corner * std::sin(angle), z);
  }
  return {ConvexShape::from_points(std::move(vertices)), 0.0};
}

void add_hulls(const UrdfRobot& robot, const UrdfShape& shape, const std::string& where, const Pose& X_JS,
               std::vector<RoundedShape>& shapes) {
  const std::filesystem::path path = require_mesh_file(robot, shape, where);
  require_positive(robot, shape, where + "<mesh>: scale", {shape.scale.begin(), shape.scale.end()});
  for (const NamedMesh& object : import_mesh_objects(path)) {
    std::vector<Vec3> points;
    for (const Vec3& v : object.mesh.vertices) points.push_back(X_JS * v.cwiseProduct(shape.scale));
    try {
      shapes.push_back({ConvexShape::from_points(convex_hull_vertices(points)), 0.0});
    } catch (const std::invalid_argument& reason) {
      robot.fail(shape.line,
                 where + "<mesh>: object '" + object.name + "' of " + path.string() + ": " + reason.what());
    }
  }
}

void add_shapes(const UrdfRobot& robot, const UrdfShape& shape, const std::string& where, const Pose& X_JL,
                std::vector<RoundedShape>& shapes) {
  const Pose X_JS = X_JL * shape.X_LS;
  const auto require = [&](const char* attribute, const std::vector<double>& numbers) {
    require_positive(robot, shape, where + attribute, numbers);
  };
  switch (shape.kind) {
    case UrdfShapeKind::box: {
      require("<box>: size", {shape.size_m.begin(), shape.size_m.end()});
      ConvexShape box = ConvexShape::from_points(std::vector<Vec3>(8, Vec3::Zero()));
      box.become_box(-0.5 * shape.size_m, 0.5 * shape.size_m);
      shapes.push_back(moved({std::move(box), 0.0}, X_JS));
      break;
    }
    case UrdfShapeKind::sphere:
      require("<sphere>: radius", {shape.radius_m});
      shapes.push_back({ConvexShape::from_points({X_JS.p}), shape.radius_m});
      break;
    case UrdfShapeKind::cylinder:
      require("<cylinder>: radius", {shape.radius_m});
      require("<cylinder>: length", {shape.length_m});
      shapes.push_back(moved(prism(shape.radius_m, shape.length_m), X_JS));
      break;
    case UrdfShapeKind::mesh:
      add_hulls(robot, shape, where, X_JS, shapes);
      break;
  }
}

}  // namespace

std::vector<UrdfLinkShapes> urdf_collision(const UrdfArm& arm) {
  const UrdfRobot& robot = arm.robot;
  std::vector<const RobotLink*> places(robot.links.size(), nullptr);
  for (std::size_t i = 0; i < arm.below_base.size(); ++i) places[arm.below_base[i]] = &arm.links[i];
  std::vector<UrdfLinkShapes> result;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (places[i] == nullptr || robot.links[i].collisions.empty()) continue;
    result.push_back({robot.links[i].name, places[i]->joint, {}});
    for (const UrdfShape& shape : robot.links[i].collisions)
      add_shapes(robot, shape, "link '" + robot.links[i].name + "': <collision>: ", places[i]->X_JL,
                 result.back().shapes);
  }
  return result;
}

}  // namespace takt
