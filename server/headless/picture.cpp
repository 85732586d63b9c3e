#include "server/headless/picture.h"

#include <algorithm>

#include "client_lib/render/renderer.h"

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

// Everything that stands on the floor bounds the view: robots and Grounds.
void look_at_cell(const CellDescription& cell, const Snapshot& snapshot, render::Camera& camera) {
  Vec3 lower = Vec3::Constant(1e9), upper = Vec3::Constant(-1e9);
  const auto include = [&](const Vec3& p) {
    lower = lower.cwiseMin(p);
    upper = upper.cwiseMax(p);
  };
  for (const RobotDescription& robot : cell.robots) include(robot.X_WR.p);
  for (std::size_t i = 0; i < cell.components.size(); ++i) {
    if (cell.components[i].type != ComponentType::gripper &&
        snapshot.components[i].state != PartState::parked)
      include(snapshot.components[i].p_WB);
  }
  if (lower.x() > upper.x()) return;
  camera.target_W = 0.5 * (lower + upper);
  const double size = std::max(0.5, (upper - lower).norm());
  camera.eye_W = camera.target_W + size * Vec3(-0.42, -0.98, 0.66);
  camera.vertical_view_rad = 0.55;
}

}  // namespace

void write_picture(const CellDescription& cell, const Snapshot& snapshot, const std::string& png_file,
                   const std::optional<PictureView>& view) {
  render::Scene scene;
  render::Camera camera;
  look_at_cell(cell, snapshot, camera);
  if (view) {
    camera.eye_W = view->eye_W;
    camera.target_W = view->target_W;
  }
  render::add_floor(scene, Vec3(camera.target_W.x(), camera.target_W.y(), 0.0), 4.0, 0.25);
  for (std::size_t i = 0; i < cell.components.size(); ++i) {
    if (snapshot.components[i].state == PartState::parked) continue;
    const render::Mesh mesh = component_mesh(cell.components[i], snapshot.components[i]);
    render::add_edges(scene, mesh, kFeatureAngle_rad, {0.15, 0.15, 0.17}, 1.0);
    scene.meshes.push_back(mesh);
  }
  for (std::size_t i = 0; i < cell.robots.size(); ++i) {
    const RobotDescription& robot = cell.robots[i];
    const double height = robot.X_WR.p.z();
    if (height > 0.0) {  // the robot's pedestal
      const Pose X_WP{Mat3::Identity(), Vec3(robot.X_WR.p.x(), robot.X_WR.p.y(), 0.5 * height)};
      scene.meshes.push_back(render::make_box(X_WP, Vec3(0.24, 0.24, height), {0.45, 0.46, 0.48}));
    }
    render::add_arm(scene, robot.arm, snapshot.robots[i].position.data(), robot.X_WR, {0.86, 0.87, 0.89},
                    {0.30, 0.45, 0.62});
  }
  render::render(scene, camera, png_file);
}

}  // namespace takt
