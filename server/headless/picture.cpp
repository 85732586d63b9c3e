#include "server/headless/picture.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "client_lib/render/renderer.h"
#include "server/simulation/model/cell_frames.h"

namespace takt {

namespace {

constexpr double kFeatureAngle_rad = 0.5;  // faces that meet at more than this have a drawn edge

render::Mesh component_mesh(const ComponentDescription& component, const ComponentSample& sample) {
  render::Mesh mesh;
  mesh.X_WB = Pose::from_quaternion(sample.p_WB, sample.q_WB);
  mesh.color = {component.color[0], component.color[1], component.color[2]};
  for (std::size_t i = 0; i + 2 < component.mesh->vertices.size(); i += 3) {
    mesh.vertices.emplace_back(component.mesh->vertices[i], component.mesh->vertices[i + 1],
                               component.mesh->vertices[i + 2]);
  }
  for (std::size_t i = 0; i + 2 < component.mesh->triangles.size(); i += 3) {
    mesh.triangles.push_back(
        {component.mesh->triangles[i], component.mesh->triangles[i + 1], component.mesh->triangles[i + 2]});
  }
  return mesh;
}

/// The box around all that is drawn.
struct Extent {
  Vec3 lower = Vec3::Constant(1e9), upper = Vec3::Constant(-1e9);
  bool empty() const { return lower.x() > upper.x(); }
  std::vector<Vec3> corners() const {
    std::vector<Vec3> points;
    for (unsigned corner = 0; corner < 8 && !empty(); ++corner) {
      Vec3& p = points.emplace_back();
      for (unsigned k = 0; k < 3; ++k) p[k] = ((corner >> k & 1U) != 0 ? upper : lower)[k];
    }
    return points;
  }
};

Extent extent_of(const render::Scene& scene) {
  Extent extent;
  for (const render::Mesh& mesh : scene.meshes)
    for (const Vec3& vertex : mesh.vertices) {
      const Vec3 p = mesh.X_WB * vertex;
      extent.lower = extent.lower.cwiseMin(p);
      extent.upper = extent.upper.cwiseMax(p);
    }
  return extent;
}

struct Drawing {
  render::Scene scene;
  render::Camera camera;
};

Drawing draw(const CellDescription& cell, const RobotShapes& robots, const Snapshot& snapshot,
             const std::optional<PictureView>& view) {
  Drawing drawing;
  auto& [scene, camera] = drawing;
  double floor = 0.0;  // at z = 0, or below what stands there
  for (std::size_t i = 0; i < cell.components.size(); ++i) {
    if (snapshot.components[i].state == PartState::parked) continue;
    render::Mesh mesh = component_mesh(cell.components[i], snapshot.components[i]);
    if (cell.components[i].stands())
      for (const Vec3& vertex : mesh.vertices) floor = std::min(floor, (mesh.X_WB * vertex).z());
    render::add_edges(scene, mesh, kFeatureAngle_rad, {0.15, 0.15, 0.17}, 1.0);
    render::smooth(mesh, kFeatureAngle_rad);
    scene.meshes.push_back(std::move(mesh));
  }
  for (std::size_t i = 0; i < cell.robots.size(); ++i) {
    const RobotDescription& robot = cell.robots[i];
    const Pose X_WR = base_pose(robot, snapshot);
    const double height = X_WR.p.z();
    // The pedestal of a robot that stands; others hang, or are slides.
    if (robot.mount < 0 && height > 0.0 && X_WR.R(2, 2) > 0.9 && !robot.arm.joints.empty() &&
        robot.arm.joints.front().type == JointType::revolute) {
      const Pose X_WP{Mat3::Identity(), Vec3(X_WR.p.x(), X_WR.p.y(), 0.5 * height)};
      scene.meshes.push_back(render::make_box(X_WP, Vec3(0.24, 0.24, height), {0.45, 0.46, 0.48}));
    }
    if (robots.add_to(scene, i, snapshot.robots[i].position.data(), X_WR)) continue;
    render::add_arm(scene, robot.arm, snapshot.robots[i].position.data(), X_WR, {0.86, 0.87, 0.89},
                    {0.30, 0.45, 0.62});
  }
  const Extent extent = extent_of(scene);
  if (!extent.empty()) camera.vertical_view_rad = 0.55;
  constexpr double kMargin = 1.08, kLeastDistance_m = 0.5;
  render::look_at(camera, extent.corners(), kMargin, kLeastDistance_m);
  if (view) {
    camera.eye_W = view->eye_W;
    camera.target_W = view->target_W;
  }
  const double size = extent.empty() ? 0.0 : (extent.upper - extent.lower).norm();
  render::add_floor(scene, Vec3(camera.target_W.x(), camera.target_W.y(), floor),
                    std::max(4.0, 0.5 * std::ceil(4.0 * size)), 0.25);
  return drawing;
}

}  // namespace

void write_picture(const CellDescription& cell, const RobotShapes& robots, const Snapshot& snapshot,
                   const std::string& png_file, const std::optional<PictureView>& view) {
  const Drawing drawing = draw(cell, robots, snapshot, view);
  render::render(drawing.scene, drawing.camera, png_file);
}

std::string picture_bytes(const CellDescription& cell, const RobotShapes& robots, const Snapshot& snapshot) {
  const Drawing drawing = draw(cell, robots, snapshot, {});
  return render::png_bytes(render::rasterise(drawing.scene, drawing.camera));
}

}  // namespace takt
