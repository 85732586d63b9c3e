#include "server/geometry/mesh/shells.h"

#include <cmath>
#include <cstddef>
#include <numbers>

#include "idl/common/disjoint_sets.h"
#include "server/geometry/mesh/edges.h"

namespace takt {
namespace {

bool contains(const Aabb& outer, const Aabb& inner) {
  return (outer.lower.array() <= inner.lower.array()).all() &&
         (outer.upper.array() >= inner.upper.array()).all();
}

void measure(const TriangleMesh& mesh, Shell& shell) {
  const Vec3 origin = mesh.vertices[mesh.triangles[shell.triangles.front()][0]];
  shell.box = {origin, origin};
  for (const std::uint32_t i : shell.triangles) {
    const auto& t = mesh.triangles[i];
    const Vec3 a = mesh.vertices[t[0]] - origin, b = mesh.vertices[t[1]] - origin,
               c = mesh.vertices[t[2]] - origin;
    shell.volume_m3 += a.dot(b.cross(c)) / 6.0;
    for (const std::uint32_t v : t) {
      shell.box.lower = shell.box.lower.cwiseMin(mesh.vertices[v]);
      shell.box.upper = shell.box.upper.cwiseMax(mesh.vertices[v]);
    }
  }
}

}  // namespace

double winding_number(const TriangleMesh& mesh, const std::vector<std::uint32_t>& triangles,
                      const Vec3& point) {
  double sum = 0.0;
  for (const std::uint32_t i : triangles) {
    const auto& t = mesh.triangles[i];
    const Vec3 a = mesh.vertices[t[0]] - point, b = mesh.vertices[t[1]] - point,
               c = mesh.vertices[t[2]] - point;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    sum += std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return sum / (2.0 * std::numbers::pi);
}

std::vector<Shell> find_shells(const TriangleMesh& mesh) {
  DisjointSets pieces(mesh.triangles.size());
  const std::vector<HalfEdge> edges = sorted_half_edges(mesh);
  for (std::size_t i = 1; i < edges.size(); ++i)
    if (edges[i].low == edges[i - 1].low && edges[i].high == edges[i - 1].high)
      pieces.join(edges[i].triangle, edges[i - 1].triangle);
  std::vector<Shell> shells;
  std::vector<std::size_t> shell_of(mesh.triangles.size());
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const std::uint32_t root = pieces.root(i);
    if (root == i) {
      shell_of[i] = shells.size();
      shells.emplace_back();
    }
    shells[shell_of[root]].triangles.push_back(i);
  }
  for (Shell& shell : shells) measure(mesh, shell);
  for (std::size_t i = 0; i < shells.size(); ++i)
    for (std::size_t k = 0; k < shells.size(); ++k)
      if (i != k && contains(shells[k].box, shells[i].box) &&
          std::abs(winding_number(mesh, shells[k].triangles,
                                  mesh.vertices[mesh.triangles[shells[i].triangles.front()][0]])) > 0.5)
        shells[i].around.push_back(k);
  return shells;
}

}  // namespace takt
