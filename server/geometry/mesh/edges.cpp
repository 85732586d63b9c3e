#include "server/geometry/mesh/edges.h"

#include <algorithm>
#include <sstream>

namespace takt {

std::vector<HalfEdge> sorted_half_edges(const TriangleMesh& mesh) {
  // Counting sort by the first vertex; only the few edges of one vertex remain to be sorted.
  std::vector<std::uint32_t> begin(mesh.vertices.size() + 1, 0);
  for (const auto& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) ++begin[std::min(t[k], t[(k + 1) % 3]) + 1];
  for (std::size_t v = 1; v < begin.size(); ++v) begin[v] += begin[v - 1];
  std::vector<HalfEdge> edges(3 * mesh.triangles.size());
  std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t from = t[k];
      const std::uint32_t to = t[(k + 1) % 3];
      edges[next[std::min(from, to)]++] = {std::min(from, to), std::max(from, to),
                                           static_cast<std::uint32_t>(i), from < to};
    }
  }
  for (std::size_t v = 0; v + 1 < begin.size(); ++v)
    std::sort(edges.begin() + begin[v], edges.begin() + begin[v + 1],
              [](const HalfEdge& a, const HalfEdge& b) {
                return a.high != b.high ? a.high < b.high : a.triangle < b.triangle;
              });
  return edges;
}

std::size_t end_of_edge(const std::vector<HalfEdge>& edges, std::size_t begin) {
  std::size_t end = begin + 1;
  while (end < edges.size() && edges[end].low == edges[begin].low && edges[end].high == edges[begin].high)
    ++end;
  return end;
}

bool has_area(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& t) {
  const Vec3 ab = mesh.vertices[t[1]] - mesh.vertices[t[0]];
  const Vec3 ac = mesh.vertices[t[2]] - mesh.vertices[t[0]];
  const double longest = std::max({ab.squaredNorm(), ac.squaredNorm(), (ac - ab).squaredNorm()});
  return ab.cross(ac).norm() > 1e-12 * longest;
}

std::string find_bad_vertex_or_index(const TriangleMesh& mesh) {
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
    if (!mesh.vertices[i].allFinite())
      return vertex_text(mesh, static_cast<std::uint32_t>(i)) + " is not finite.";
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (const std::uint32_t v : mesh.triangles[i])
      if (v >= mesh.vertices.size())
        return "triangle " + std::to_string(i) + " refers to vertex " + std::to_string(v) +
               ", but there are only " + std::to_string(mesh.vertices.size()) + " vertices.";
  return {};
}

std::string vertex_text(const TriangleMesh& mesh, std::uint32_t vertex) {
  std::ostringstream text;
  const Vec3& v = mesh.vertices[vertex];
  text.precision(9);
  text << "vertex " << vertex << " (" << v.x() << ", " << v.y() << ", " << v.z() << ")";
  return text.str();
}

}  // namespace takt
