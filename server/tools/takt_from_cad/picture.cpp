#include "server/tools/takt_from_cad/picture.h"

#include <algorithm>
#include <array>
#include <vector>

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
    render::smooth(mesh, kFeatureAngle_rad);
    scene.meshes.push_back(std::move(mesh));
  }
  render::Camera camera;
  camera.width_px = 1280, camera.height_px = 960;
  camera.vertical_view_rad = 0.4;
  std::vector<Vec3> points;
  for (const render::Mesh& mesh : scene.meshes)
    for (const Vec3& v : mesh.vertices) points.push_back(mesh.X_WB * v);
  render::look_at(camera, points, kMargin, 0.0);
  render::render(scene, camera, png.string());
}

}  // namespace takt
