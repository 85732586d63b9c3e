#include "server/geometry/mesh/refinement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <queue>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "server/geometry/mesh/edges.h"

namespace takt {
namespace {

constexpr std::uint32_t kNone = ~std::uint32_t{0};

/// Strictly ordered: by length, then by vertices, so that "the longest edge" is one edge even among equals.
struct Edge {
  double squared = 0.0;
  std::uint32_t low = 0;
  std::uint32_t high = 0;

  bool operator<(const Edge& o) const {
    if (squared != o.squared) return squared < o.squared;
    return low != o.low ? low > o.low : high > o.high;
  }
  bool same(const Edge& o) const { return low == o.low && high == o.high; }
};

class Refiner {
 public:
  Refiner(const TriangleMesh& mesh, const RefinementOptions& options) : options_(options), mesh_(mesh) {
    join();
    for (std::uint32_t i = 0; i < mesh_.triangles.size(); ++i) demand(i);
  }

  TriangleMesh run() {
    while (!demanded_.empty()) {
      const Demand wanted = demanded_.top();
      demanded_.pop();
      // Skips an edge that is gone or whose triangles need no division. One that had moved to another triangle before was demanded
      // by that one too.
      std::uint32_t triangle = wanted.triangle;
      for (std::size_t k = side_of(triangle, wanted.edge);
           k < 3 && (asks(triangle) || asks(beyond_[triangle][k])); k = side_of(triangle, wanted.edge)) {
        for (const std::uint32_t added : halve(longest_from({wanted.edge, triangle})))
          if (side_of(triangle, wanted.edge) == 3 && side_of(added, wanted.edge) < 3) triangle = added;
      }
    }
    return std::move(mesh_);
  }

 private:
  /// An edge, and a triangle that has it.
  struct Demand {
    Edge edge;
    std::uint32_t triangle = kNone;
    bool operator<(const Demand& o) const { return edge < o.edge; }
  };
  using Sides = std::array<std::uint32_t, 3>;

  /// Finds the triangles beyond each edge.
  void join() {
    for (std::size_t i = 0; i < mesh_.triangles.size(); ++i) {
      const auto& t = mesh_.triangles[i];
      if (std::max({t[0], t[1], t[2]}) >= mesh_.vertices.size() || t[0] == t[1] || t[1] == t[2] ||
          t[2] == t[0])
        throw std::invalid_argument("refinement: triangle " + std::to_string(i) +
                                    " names a vertex twice or one that is not there");
    }
    beyond_.assign(mesh_.triangles.size(), Sides{kNone, kNone, kNone});
    first_.assign(mesh_.triangles.size(), {});
    const std::vector<HalfEdge> edges = sorted_half_edges(mesh_);
    for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
      end = end_of_edge(edges, begin);
      const HalfEdge& one = edges[begin];
      if (end - begin > 2)
        throw std::invalid_argument("refinement: the edge between vertices " + std::to_string(one.low) +
                                    " and " + std::to_string(one.high) +
                                    " belongs to more than two triangles");
      if (end - begin < 2) continue;
      const std::uint32_t other = edges[begin + 1].triangle;
      const Edge e{0.0, one.low, one.high};
      const std::size_t side = side_of(one.triangle, e);
      beyond_[one.triangle][side] = other;
      beyond_[other][side_of(other, e)] = one.triangle;
      first_[one.triangle][side] = true;
    }
  }

  Edge edge(std::uint32_t a, std::uint32_t b) const {
    const std::uint32_t low = std::min(a, b);
    const std::uint32_t high = std::max(a, b);
    return {(mesh_.vertices[high] - mesh_.vertices[low]).squaredNorm(), low, high};
  }
  /// Side k goes from corner k to the next.
  Edge edge_of(std::uint32_t triangle, std::size_t k) const {
    const auto& t = mesh_.triangles[triangle];
    return edge(t[k], t[(k + 1) % 3]);
  }
  /// 3: it has no such edge.
  std::size_t side_of(std::uint32_t triangle, const Edge& e) const {
    if (triangle == kNone) return 3;
    const auto& t = mesh_.triangles[triangle];
    for (std::size_t k = 0; k < 3; ++k)
      if (std::min(t[k], t[(k + 1) % 3]) == e.low && std::max(t[k], t[(k + 1) % 3]) == e.high) return k;
    return 3;
  }

  bool asks(std::uint32_t triangle) const {
    if (triangle == kNone) return false;
    if (!options_.region) return true;
    const auto& t = mesh_.triangles[triangle];
    const Vec3 &a = mesh_.vertices[t[0]], &b = mesh_.vertices[t[1]], &c = mesh_.vertices[t[2]];
    return options_.region->overlaps({a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)});
  }

  void demand(std::uint32_t triangle) {
    if (!asks(triangle)) return;
    for (std::size_t k = 0; k < 3; ++k) {
      const Edge e = edge_of(triangle, k);
      if (std::sqrt(e.squared) > options_.edge_m) demanded_.push({e, triangle});
    }
  }

  /// Walks along ever longer edges to one that is the longest of all its triangles.
  Demand longest_from(Demand at) const {
    for (;;) {
      Demand next = at;
      for (const std::uint32_t triangle :
           {at.triangle, beyond_[at.triangle][side_of(at.triangle, at.edge)]}) {
        if (triangle == kNone) continue;
        for (std::size_t k = 0; k < 3; ++k)
          if (const Edge e = edge_of(triangle, k); next.edge < e) next = {e, triangle};
      }
      if (next.edge.same(at.edge)) return at;
      at = next;
    }
  }

  /// Returns the new triangles.
  std::array<std::uint32_t, 2> halve(const Demand& at) {
    const std::size_t side = side_of(at.triangle, at.edge);
    std::uint32_t one = at.triangle, other = beyond_[one][side];
    const std::size_t grown = mesh_.triangles.size() + (other == kNone ? 1 : 2);
    if (grown > options_.max_triangles || mesh_.vertices.size() >= kNone)
      throw std::invalid_argument("refinement: an edge of " + std::to_string(options_.edge_m) +
                                  " m would need more than " + std::to_string(options_.max_triangles) +
                                  " triangles");
    const auto middle = static_cast<std::uint32_t>(mesh_.vertices.size());
    mesh_.vertices.push_back(0.5 * (mesh_.vertices[at.edge.low] + mesh_.vertices[at.edge.high]));
    if (other != kNone && !first_[one][side]) std::swap(one, other);
    const std::uint32_t added = halve_triangle(one, at.edge, middle);
    if (other == kNone) return {added, kNone};
    const std::uint32_t other_added = halve_triangle(other, at.edge, middle);
    for (const std::uint32_t half : {one, added}) {
      for (const std::uint32_t opposite : {other, other_added}) {
        for (std::size_t k = 0; k < 3; ++k) {
          const Edge e = edge_of(half, k);
          if (e.high != middle || beyond_[half][k] != kNone) continue;
          const std::size_t back = side_of(opposite, e);
          if (back == 3) continue;
          beyond_[half][k] = opposite;
          beyond_[opposite][back] = half;
          first_[half][k] = true;
        }
      }
    }
    return {added, other_added};
  }

  /// Returns the new triangle. What is beyond the halves of the edge stays open.
  std::uint32_t halve_triangle(std::uint32_t triangle, const Edge& e, std::uint32_t middle) {
    std::array<std::uint32_t, 3> t = mesh_.triangles[triangle];
    std::size_t turn = 0;  // until the third corner is the one opposite to the edge
    while (t[2] == e.low || t[2] == e.high) t = {t[1], t[2], t[0]}, ++turn;
    const auto added = static_cast<std::uint32_t>(mesh_.triangles.size());
    const Edge moved = edge(t[1], t[2]);
    const std::uint32_t beyond_moved = beyond_[triangle][(1 + turn) % 3],
                        beyond_kept = beyond_[triangle][(2 + turn) % 3];
    const bool moved_first = first_[triangle][(1 + turn) % 3], kept_first = first_[triangle][(2 + turn) % 3];
    mesh_.triangles[triangle] = {t[0], middle, t[2]};
    mesh_.triangles.push_back({middle, t[1], t[2]});
    beyond_[triangle] = {kNone, added, beyond_kept};
    first_[triangle] = {false, true, kept_first};
    beyond_.push_back({kNone, beyond_moved, triangle});
    first_.push_back({false, moved_first, false});
    if (beyond_moved != kNone) beyond_[beyond_moved][side_of(beyond_moved, moved)] = added;
    demand(triangle);
    demand(added);
    return added;
  }

  const RefinementOptions options_;
  TriangleMesh mesh_;
  std::vector<Sides> beyond_;                 ///< by triangle: the triangles beyond its sides, or kNone
  std::vector<std::array<bool, 3>> first_{};  ///< whether it is divided ahead of the one beyond
  std::priority_queue<Demand> demanded_;
};

}  // namespace

TriangleMesh refine_to_edge(const TriangleMesh& mesh, const RefinementOptions& options) {
  if (!(options.edge_m > 0.0))
    throw std::invalid_argument("refinement: the edge length is " + std::to_string(options.edge_m) +
                                " m, it must be positive");
  return Refiner(mesh, options).run();
}

TriangleMesh refine_to_edge(const TriangleMesh& mesh, double edge_m) {
  RefinementOptions options;
  options.edge_m = edge_m;
  return refine_to_edge(mesh, options);
}

double longest_edge(const TriangleMesh& mesh) {
  double longest = 0.0;
  for (const auto& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k)
      longest = std::max(longest, (mesh.vertices[t[k]] - mesh.vertices[t[(k + 1) % 3]]).norm());
  return longest;
}

}  // namespace takt
