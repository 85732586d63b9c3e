#include "server/geometry/mesh/triangle_mesh.h"

#include <cmath>
#include <cstddef>
#include <sstream>
#include <vector>

#include "server/geometry/mesh/edges.h"

namespace takt {
namespace {

std::string find_bad_triangle(const TriangleMesh& mesh) {
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    if (!has_area(mesh, t))
      return "triangle " + std::to_string(i) + " has no area; its corners are " + vertex_text(mesh, t[0]) +
             ", " + vertex_text(mesh, t[1]) + " and " + vertex_text(mesh, t[2]) + ".";
  }
  return {};
}

std::string find_bad_edge(const TriangleMesh& mesh) {
  const std::vector<HalfEdge> edges = sorted_half_edges(mesh);
  for (std::size_t i = 0; i < edges.size();) {
    const std::size_t end = end_of_edge(edges, i);
    const std::string name =
        end - i == 2 && edges[i].upward != edges[i + 1].upward
            ? std::string()
            : "the edge from " + vertex_text(mesh, edges[i].low) + " to " + vertex_text(mesh, edges[i].high);
    if (end - i == 1)
      return name + " belongs to triangle " + std::to_string(edges[i].triangle) +
             " only: the surface has a hole there.";
    if (end - i > 2)
      return name + " belongs to " + std::to_string(end - i) + " triangles (" +
             std::to_string(edges[i].triangle) + ", " + std::to_string(edges[i + 1].triangle) + ", " +
             std::to_string(edges[i + 2].triangle) + (end - i > 3 ? ", ..." : "") +
             "), allowed are exactly 2.";
    if (!name.empty())
      return name + " is run through in the same direction by triangles " +
             std::to_string(edges[i].triangle) + " and " + std::to_string(edges[i + 1].triangle) +
             ": one of them faces inwards.";
    i = end;
  }
  return {};
}

}  // namespace

MeshCheck check_closed(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) return {"there are no triangles."};
  std::string problem = find_bad_vertex_or_index(mesh);
  if (problem.empty()) problem = find_bad_triangle(mesh);
  if (problem.empty()) problem = find_bad_edge(mesh);
  if (!problem.empty()) return {problem};
  const double volume = volume_properties(mesh).volume;
  if (volume > 0.0 && std::isfinite(volume)) return {};
  std::ostringstream text;
  if (!std::isfinite(volume))
    text << "the coordinates are too large for a volume to be computed.";
  else
    text << "the enclosed volume is " << volume << " m^3: "
         << (volume < 0.0 ? "the faces point inwards, they must point outwards."
                          : "the surface encloses nothing.");
  return {text.str()};
}

TriangleMesh box_mesh(const Vec3& lower, const Vec3& upper) {
  TriangleMesh mesh;
  for (const double x : {lower.x(), upper.x()})
    for (const double y : {lower.y(), upper.y()})
      for (const double z : {lower.z(), upper.z()}) mesh.vertices.emplace_back(x, y, z);
  mesh.triangles = {{0, 1, 3}, {0, 3, 2}, {4, 6, 7}, {4, 7, 5}, {0, 4, 5}, {0, 5, 1},
                    {2, 3, 7}, {2, 7, 6}, {0, 2, 6}, {0, 6, 4}, {1, 5, 7}, {1, 7, 3}};
  return mesh;
}

Aabb bounds_of(const TriangleMesh& mesh) {
  Aabb box{mesh.vertices.front(), mesh.vertices.front()};
  for (const Vec3& v : mesh.vertices) box.lower = box.lower.cwiseMin(v), box.upper = box.upper.cwiseMax(v);
  return box;
}

VolumeProperties volume_properties(const TriangleMesh& mesh) {
  VolumeProperties result;
  if (mesh.triangles.empty()) return result;
  // Sum over the signed tetrahedra between a reference point and each triangle. A reference amid the vertices
  // keeps the digits when the solid is far from the origin.
  const Aabb box = bounds_of(mesh);
  const Vec3 p_BR = 0.5 * (box.lower + box.upper);
  double six_volumes = 0.0;
  Vec3 first = Vec3::Zero();   // 24 times the first moment about R
  Mat3 second = Mat3::Zero();  // 120 times the second moment about R
  for (const auto& t : mesh.triangles) {
    const Vec3 a = mesh.vertices[t[0]] - p_BR;
    const Vec3 b = mesh.vertices[t[1]] - p_BR;
    const Vec3 c = mesh.vertices[t[2]] - p_BR;
    const double d = a.dot(b.cross(c));
    const Vec3 s = a + b + c;
    six_volumes += d;
    first += d * s;
    second += d * (a * a.transpose() + b * b.transpose() + c * c.transpose() + s * s.transpose());
  }
  result.volume = six_volumes / 6.0;
  if (result.volume == 0.0) {
    result.p_BBcm = p_BR;
    return result;
  }
  const Vec3 p_RBcm = first / (24.0 * result.volume);
  const Mat3 covariance = second / (120.0 * result.volume) - p_RBcm * p_RBcm.transpose();
  result.p_BBcm = p_BR + p_RBcm;
  result.G_BBcm_B = covariance.trace() * Mat3::Identity() - covariance;
  return result;
}

}  // namespace takt
