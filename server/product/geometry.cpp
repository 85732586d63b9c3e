#include "server/product/geometry.h"

#include <algorithm>

namespace takt::product {

void clip(Polygon& polygon, const Vec3& n, double offset) {
  Polygon result;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vec3 &p = polygon[k], &q = polygon[(k + 1) % polygon.size()];
    const double a = n.dot(p) - offset, b = n.dot(q) - offset;
    if (a <= 0.0) result.push_back(p);
    if ((a < 0.0 && b > 0.0) || (a > 0.0 && b < 0.0)) result.push_back(p + a / (a - b) * (q - p));
  }
  polygon = std::move(result);
}

Face placed(Face face, const Pose& X_WB) {
  face.point_B = X_WB * face.point_B;
  face.axis_B = X_WB.R * face.axis_B;
  return face;
}

bool coaxial(const Face& a, const Face& b, double apart_m) {
  constexpr double kSame = 1e-4;  // of the sine between two directions
  return a.axis_B.cross(b.axis_B).norm() < kSame && (b.point_B - a.point_B).cross(a.axis_B).norm() <= apart_m;
}

std::vector<PlacedInstance> place(const Product& product) {
  std::vector<PlacedInstance> placed;
  for (const Instance& instance : product.instances) {
    const Body& body = product.bodies[instance.body];
    PlacedInstance result;
    result.mass_kg = body.material.density_kg_m3 * body.exact.volume;
    std::vector<PlacedFace> faces(body.faces.size());
    for (std::size_t f = 0; f < faces.size(); ++f)
      faces[f].face = product::placed(body.faces[f], instance.X_WB);
    std::vector<Vec3> vertices;
    BoxBuilder box;
    for (const Vec3& vertex : body.mesh.vertices) {
      vertices.push_back(instance.X_WB * vertex);
      box.add(vertices.back());
    }
    result.box = box.box;
    for (std::size_t i = 0; i < body.mesh.triangles.size(); ++i) {
      const auto& t = body.mesh.triangles[i];
      result.triangles.push_back({vertices[t[0]], vertices[t[1]], vertices[t[2]]});
      const int face = i < body.triangle_faces.size() ? body.triangle_faces[i] : -1;
      if (face >= 0) faces[static_cast<std::size_t>(face)].triangles.push_back(result.triangles.back());
    }
    for (PlacedFace& face : faces) {
      if (face.triangles.empty()) continue;
      BoxBuilder of_face;
      for (const Triangle& t : face.triangles)
        for (const Vec3& p : t) of_face.add(p);
      face.box = of_face.box;
      result.faces.push_back(std::move(face));
    }
    placed.push_back(std::move(result));
  }
  return placed;
}

Extent along(const PlacedInstance& instance, const Vec3& axis) {
  Extent extent;
  for (const Triangle& t : instance.triangles)
    for (const Vec3& p : t)
      extent.from = std::min(extent.from, p.dot(axis)), extent.to = std::max(extent.to, p.dot(axis));
  return extent;
}

bool covers(const Triangle& t, double x, double y, double up) {
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 &p = t[k], &q = t[(k + 1) % 3];
    const double side = (q.x() - p.x()) * (y - p.y()) - (q.y() - p.y()) * (x - p.x());
    if (!(up * side >= 0.0)) return false;
  }
  return true;
}

}  // namespace takt::product
