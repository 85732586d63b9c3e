#include "server/tools/takt_from_cad/picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "client_lib/render/renderer.h"

namespace takt {

namespace {

constexpr double kFeatureAngle_rad = 0.5;  ///< faces that meet at more than this have a drawn edge
constexpr double kMargin = 1.05;           ///< around the product in the picture
constexpr std::array<render::Color, 8> kColors{{{0.36, 0.55, 0.75},
                                                {0.86, 0.60, 0.30},
                                                {0.45, 0.67, 0.45},
                                                {0.78, 0.42, 0.42},
                                                {0.62, 0.53, 0.75},
                                                {0.63, 0.52, 0.45},
                                                {0.83, 0.76, 0.42},
                                                {0.55, 0.58, 0.62}}};

render::Color color_of(const product::Product& product, std::size_t body) {
  const auto& own = product.bodies[body].colour;
  return own ? render::Color{(*own)[0], (*own)[1], (*own)[2]} : kColors[body % kColors.size()];
}

/// All points are as near as they can be within the picture.
render::Camera look_at(const std::vector<render::Mesh>& meshes) {
  render::Camera camera;
  camera.width_px = 1280, camera.height_px = 960;
  camera.vertical_view_rad = 0.4;
  Vec3 lower = Vec3::Constant(std::numeric_limits<double>::infinity()), upper = -lower;
  for (const render::Mesh& mesh : meshes)
    for (const Vec3& v : mesh.vertices)
      lower = lower.cwiseMin(mesh.X_WB * v), upper = upper.cwiseMax(mesh.X_WB * v);
  camera.target_W = 0.5 * (lower + upper);
  const Vec3 back = Vec3(-0.42, -0.98, 0.66).normalized(), right = Vec3::UnitZ().cross(back).normalized(),
             up = back.cross(right);
  const double slope = std::tan(0.5 * camera.vertical_view_rad),
               wide = slope * camera.width_px / camera.height_px;
  double distance = 0.0;
  for (const render::Mesh& mesh : meshes)
    for (const Vec3& v : mesh.vertices) {
      const Vec3 p = mesh.X_WB * v - camera.target_W;
      distance = std::max(distance, p.dot(back) + kMargin * std::max(std::abs(p.dot(up)) / slope,
                                                                     std::abs(p.dot(right)) / wide));
    }
  camera.eye_W = camera.target_W + distance * back;
  return camera;
}

}  // namespace

void draw_exploded(const product::Product& product, const product::Explosion& explosion,
                   const std::filesystem::path& png) {
  // The picture has the size 1, whatever that of the product.
  double size = 0.0;
  for (const product::Instance& instance : product.instances)
    for (const Vec3& v : product.bodies[instance.body].mesh.vertices)
      size = std::max(size, (instance.X_WB * v - product.instances[0].X_WB.p).norm());
  const double scale = 1.0 / size;
  render::Scene scene;
  scene.background_top = scene.background_bottom = {1.0, 1.0, 1.0};
  for (std::size_t i = 0; i < product.instances.size(); ++i) {
    const product::Instance& instance = product.instances[i];
    const product::Body& body = product.bodies[instance.body];
    Vec3 at = instance.X_WB * body.exact.p_BBcm;
    for (const Vec3& shift : explosion[i]) {
      scene.lines.push_back({scale * at, scale * (at + shift), {0.55, 0.55, 0.58}, 1.0});
      at += shift;
    }
    render::Mesh mesh;
    mesh.X_WB = {instance.X_WB.R, scale * (at - instance.X_WB.R * body.exact.p_BBcm)};
    mesh.color = color_of(product, instance.body);
    for (const Vec3& v : body.mesh.vertices) mesh.vertices.push_back(scale * v);
    mesh.triangles = body.mesh.triangles;
    render::add_edges(scene, mesh, kFeatureAngle_rad, {0.15, 0.15, 0.17}, 1.0);
    scene.meshes.push_back(std::move(mesh));
  }
  render::render(scene, look_at(scene.meshes), png.string());
}

}  // namespace takt
