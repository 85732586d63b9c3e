#include "server/scenario/urdf_meshes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "idl/common/text.h"
#include "server/geometry/convex/convex_shape.h"

namespace takt {

namespace {

constexpr std::uint32_t kSides = 32;

/// A closed surface of revolution about z: rings of kSides vertices at these radii and heights, from the lowest on,
/// between two poles.
TriangleMesh revolved(const std::vector<std::pair<double, double>>& rings, double bottom, double top) {
  TriangleMesh mesh;
  mesh.vertices.emplace_back(0.0, 0.0, bottom);
  for (const auto& [radius, height] : rings) {
    for (std::uint32_t i = 0; i < kSides; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / kSides;
      mesh.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), height);
    }
  }
  mesh.vertices.emplace_back(0.0, 0.0, top);
  const auto count = static_cast<std::uint32_t>(rings.size());
  const std::uint32_t pole = 1 + count * kSides;
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const std::uint32_t next = (i + 1) % kSides;
    mesh.triangles.push_back({0, 1 + next, 1 + i});
    for (std::uint32_t ring = 0; ring + 1 < count; ++ring) {
      const std::uint32_t low = 1 + ring * kSides, high = low + kSides;
      mesh.triangles.push_back({low + i, low + next, high + next});
      mesh.triangles.push_back({low + i, high + next, high + i});
    }
    mesh.triangles.push_back({pole, pole - kSides + i, pole - kSides + next});
  }
  return mesh;
}

TriangleMesh sphere(double radius) {
  std::vector<std::pair<double, double>> rings;
  for (std::uint32_t i = 1; i < kSides / 2; ++i) {
    const double angle = std::numbers::pi * i / (kSides / 2);
    rings.emplace_back(radius * std::sin(angle), -radius * std::cos(angle));
  }
  return revolved(rings, -radius, radius);
}

}  // namespace

std::filesystem::path require_mesh_file(const UrdfRobot& robot, const UrdfShape& shape,
                                        const std::string& where) {
  if (const auto file = robot.mesh_file(shape)) return *file;
  const std::string package = package_of(shape.filename);
  robot.fail(
      shape.line,
      where + "<mesh>: filename: found '" + shape.filename +
          "'; allowed: an existing OBJ, STL, GLB or DAE file, " +
          (package.empty() ? "relative to the URDF file"
                           : "in the package '" + package +
                                 "', which is searched in the folders of --packages and "
                                 "AMENT_PREFIX_PATH or GZ_SIM_RESOURCE_PATH, and above the URDF file"));
}

void require_positive(const UrdfRobot& robot, const UrdfShape& shape, const std::string& where,
                      const std::vector<double>& numbers) {
  if (std::all_of(numbers.begin(), numbers.end(), [](double number) { return number > 0.0; })) return;
  robot.fail(shape.line, where + ": found '" + join(numbers, " ", exact_text) + "'; allowed: " +
                             (numbers.size() == 1 ? "a finite number > 0" : "3 finite numbers > 0"));
}

std::string make_solid(NamedMesh& object) {
  RepairedMesh repaired = repair_mesh(object.mesh);
  if (repaired.problem.empty()) {
    object.mesh = std::move(repaired.mesh);
    return {};
  }
  object.mesh = convex_hull_mesh(convex_hull_vertices(object.mesh.vertices));
  return repaired.problem;
}

std::vector<NamedMesh> urdf_meshes(const UrdfRobot& robot, const UrdfLink& link, const Pose& X_AL) {
  const bool solid = !link.collisions.empty();
  return urdf_meshes(robot, link.name, solid ? link.collisions : link.visuals,
                     "link '" + link.name + (solid ? "': <collision>: " : "': <visual>: "), X_AL);
}

std::vector<NamedMesh> urdf_meshes(const UrdfRobot& robot, const std::string& name,
                                   const std::vector<UrdfShape>& shapes, const std::string& where,
                                   const Pose& X_AL) {
  std::vector<NamedMesh> meshes;
  for (const UrdfShape& shape : shapes) {
    std::vector<NamedMesh> made(1);
    made[0].name = name;
    switch (shape.kind) {
      case UrdfShapeKind::box:
        require_positive(robot, shape, where + "<box>: size", {shape.size_m.begin(), shape.size_m.end()});
        made[0].mesh = box_mesh(-0.5 * shape.size_m, 0.5 * shape.size_m);
        break;
      case UrdfShapeKind::sphere:
        require_positive(robot, shape, where + "<sphere>: radius", {shape.radius_m});
        made[0].mesh = sphere(shape.radius_m);
        break;
      case UrdfShapeKind::cylinder:
        require_positive(robot, shape, where + "<cylinder>: radius", {shape.radius_m});
        require_positive(robot, shape, where + "<cylinder>: length", {shape.length_m});
        made[0].mesh =
            revolved({{shape.radius_m, -0.5 * shape.length_m}, {shape.radius_m, 0.5 * shape.length_m}},
                     -0.5 * shape.length_m, 0.5 * shape.length_m);
        break;
      case UrdfShapeKind::mesh:
        made = import_mesh_objects(require_mesh_file(robot, shape, where));
        break;
    }
    const bool mirrored = shape.scale.prod() < 0.0;
    for (NamedMesh& object : made) {
      for (Vec3& vertex : object.mesh.vertices)
        vertex = X_AL * (shape.X_LS * vertex.cwiseProduct(shape.scale));
      for (auto& triangle : object.mesh.triangles)
        if (mirrored) std::swap(triangle[1], triangle[2]);
      meshes.push_back(std::move(object));
    }
  }
  return meshes;
}

}  // namespace takt
