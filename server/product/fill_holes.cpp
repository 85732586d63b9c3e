#include "server/product/fill_holes.h"

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "server/geometry/mesh/edges.h"
#include "server/product/geometry.h"

namespace takt::product {

namespace {

using Loop = std::vector<std::uint32_t>;  ///< new triangles run through its sides in its order

constexpr std::size_t kLongestLoop = 800;

/// Directed edges that the surface lacks, each as often as it lacks it.
std::vector<std::pair<std::uint32_t, std::uint32_t>> missing_edges(const TriangleMesh& mesh) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> missing;
  const std::vector<HalfEdge> edges = sorted_half_edges(mesh);
  for (std::size_t begin = 0; begin < edges.size();) {
    const std::size_t end = end_of_edge(edges, begin);
    std::ptrdiff_t upward = 0;
    for (std::size_t i = begin; i < end; ++i) upward += edges[i].upward ? 1 : -1;
    for (; upward > 0; --upward) missing.emplace_back(edges[begin].high, edges[begin].low);
    for (; upward < 0; ++upward) missing.emplace_back(edges[begin].low, edges[begin].high);
    begin = end;
  }
  return missing;
}

/// The loops that the edges form: as many lead to a vertex as leave it.
std::vector<Loop> loops_of(const std::vector<std::pair<std::uint32_t, std::uint32_t>>& edges) {
  std::map<std::uint32_t, std::vector<std::uint32_t>> next;
  for (const auto& [from, to] : edges) next[from].push_back(to);
  std::vector<Loop> loops;
  for (auto& [start, ways] : next) {
    while (!ways.empty()) {
      Loop path{start};
      while (true) {
        std::vector<std::uint32_t>& onward = next.at(path.back());
        const std::uint32_t to = onward.back();
        onward.pop_back();
        const auto met = std::find(path.begin(), path.end(), to);
        if (met == path.end()) {
          path.push_back(to);
          continue;
        }
        loops.emplace_back(met, path.end());  // a part of the path is closed; the rest goes on from there
        path.erase(met + 1, path.end());
        if (path.size() == 1) break;
      }
    }
  }
  return loops;
}

class Filler {
 public:
  explicit Filler(const TriangleMesh& mesh) {
    result_.mesh = mesh;
    for (const TriangleMesh::Triangle& t : mesh.triangles)
      for (int k = 0; k < 3; ++k)
        add_edge(t[static_cast<std::size_t>(k)], t[static_cast<std::size_t>((k + 1) % 3)]);
  }

  FilledMesh fill() {
    for (const Loop& loop : loops_of(missing_edges(result_.mesh))) {
      if (loop.size() < 3 || loop.size() > kLongestLoop) continue;
      ++result_.holes;
      BoxBuilder box;
      for (const std::uint32_t v : loop) box.add(result_.mesh.vertices[v]);
      result_.largest_m = std::max(result_.largest_m, (box.box.upper - box.box.lower).norm());
      triangulate(loop);
    }
    return std::move(result_);
  }

 private:
  void add_edge(std::uint32_t a, std::uint32_t b) { edges_.emplace(std::min(a, b), std::max(a, b)); }
  bool has_edge(std::uint32_t a, std::uint32_t b) const {
    return edges_.contains({std::min(a, b), std::max(a, b)});
  }

  void triangulate(const Loop& loop) {
    const std::size_t n = loop.size();
    constexpr double kNever = std::numeric_limits<double>::infinity();
    std::vector<double> least(n * n, kNever);  // area of the part of the loop from i to j
    std::vector<std::size_t> apex(n * n, 0);
    const auto& vertices = result_.mesh.vertices;
    for (std::size_t i = 0; i + 1 < n; ++i) least[i * n + i + 1] = 0.0;
    for (std::size_t length = 2; length < n; ++length) {
      for (std::size_t i = 0; i + length < n; ++i) {
        const std::size_t j = i + length;
        // A side inside the hole that is an edge of the surface already would belong to four triangles.
        if (length + 1 < n && has_edge(loop[i], loop[j])) continue;
        for (std::size_t k = i + 1; k < j; ++k) {
          const double rest = least[i * n + k] + least[k * n + j];
          if (!(rest < least[i * n + j])) continue;
          const double area =
              rest +
              0.5 *
                  (vertices[loop[k]] - vertices[loop[i]]).cross(vertices[loop[j]] - vertices[loop[i]]).norm();
          if (area < least[i * n + j]) least[i * n + j] = area, apex[i * n + j] = k;
        }
      }
    }
    if (least[n - 1] == kNever) return;
    std::vector<std::pair<std::size_t, std::size_t>> parts{{0, n - 1}};
    while (!parts.empty()) {
      const auto [i, j] = parts.back();
      parts.pop_back();
      if (j < i + 2) continue;
      const std::size_t k = apex[i * n + j];
      result_.mesh.triangles.push_back({loop[i], loop[k], loop[j]});
      add_edge(loop[i], loop[k]), add_edge(loop[k], loop[j]), add_edge(loop[j], loop[i]);
      parts.emplace_back(i, k);
      parts.emplace_back(k, j);
    }
  }

  FilledMesh result_;
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges_;  ///< lower vertex first
};

}  // namespace

std::size_t open_edges(const TriangleMesh& mesh) {
  return missing_edges(mesh).size();
}

FilledMesh fill_holes(const TriangleMesh& mesh) {
  return Filler(mesh).fill();
}

}  // namespace takt::product
