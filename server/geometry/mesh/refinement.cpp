#include "server/geometry/mesh/refinement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <queue>
#include <stdexcept>
#include <string>
#include <unordered_map>

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
  std::uint64_t key() const { return (std::uint64_t{low} << 32) | high; }
};

struct KeyHash {
  std::size_t operator()(std::uint64_t key) const {
    key *= 0x9E3779B97F4A7C15ULL;  // 2^64 / golden ratio: spreads neighbouring numbers
    return static_cast<std::size_t>(key ^ (key >> 32));
  }
};

class Refiner {
 public:
  Refiner(const TriangleMesh& mesh, const RefinementOptions& options) : options_(options), mesh_(mesh) {
    neighbours_.reserve(3 * mesh_.triangles.size());
    for (std::uint32_t i = 0; i < mesh_.triangles.size(); ++i) {
      const auto& t = mesh_.triangles[i];
      if (std::max({t[0], t[1], t[2]}) >= mesh_.vertices.size() || t[0] == t[1] || t[1] == t[2] ||
          t[2] == t[0])
        throw std::invalid_argument("refinement: triangle " + std::to_string(i) +
                                    " names a vertex twice or one that is not there");
      for (std::size_t k = 0; k < 3; ++k) attach(edge(t[k], t[(k + 1) % 3]), i);
    }
    for (std::uint32_t i = 0; i < mesh_.triangles.size(); ++i) demand(i);
  }

  TriangleMesh run() {
    while (!demanded_.empty()) {
      const Edge wanted = demanded_.top();
      demanded_.pop();
      // Skips an edge that is gone or whose triangles need no division.
      for (auto entry = neighbours_.find(wanted.key());
           entry != neighbours_.end() && (asks(entry->second[0]) || asks(entry->second[1]));
           entry = neighbours_.find(wanted.key()))
        halve(longest_from(wanted));
    }
    return std::move(mesh_);
  }

 private:
  using Pair = std::array<std::uint32_t, 2>;

  Edge edge(std::uint32_t a, std::uint32_t b) const {
    const std::uint32_t low = std::min(a, b);
    const std::uint32_t high = std::max(a, b);
    return {(mesh_.vertices[high] - mesh_.vertices[low]).squaredNorm(), low, high};
  }

  Edge longest_of(std::uint32_t triangle) const {
    const auto& t = mesh_.triangles[triangle];
    return std::max({edge(t[0], t[1]), edge(t[1], t[2]), edge(t[2], t[0])});
  }

  bool asks(std::uint32_t triangle) const {
    if (triangle == kNone) return false;
    if (!options_.region) return true;
    const auto& t = mesh_.triangles[triangle];
    const Vec3 &a = mesh_.vertices[t[0]], &b = mesh_.vertices[t[1]], &c = mesh_.vertices[t[2]];
    return options_.region->overlaps({a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)});
  }

  void attach(const Edge& e, std::uint32_t triangle) {
    const auto [entry, is_new] = neighbours_.try_emplace(e.key(), Pair{triangle, kNone});
    if (is_new) return;
    if (entry->second[1] != kNone)
      throw std::invalid_argument("refinement: the edge between vertices " + std::to_string(e.low) + " and " +
                                  std::to_string(e.high) + " belongs to more than two triangles");
    entry->second[1] = triangle;
  }

  void demand(std::uint32_t triangle) {
    if (!asks(triangle)) return;
    const auto& t = mesh_.triangles[triangle];
    for (std::size_t k = 0; k < 3; ++k) {
      const Edge e = edge(t[k], t[(k + 1) % 3]);
      if (std::sqrt(e.squared) > options_.edge_m) demanded_.push(e);
    }
  }

  /// Walks along ever longer edges to one that is the longest of all its triangles.
  Edge longest_from(Edge e) const {
    for (;;) {
      Edge next = e;
      for (const std::uint32_t triangle : neighbours_.at(e.key()))
        if (triangle != kNone) next = std::max(next, longest_of(triangle));
      if (next.same(e)) return e;
      e = next;
    }
  }

  void halve(const Edge& e) {
    const Pair sides = neighbours_.at(e.key());
    const std::size_t grown = mesh_.triangles.size() + (sides[1] == kNone ? 1 : 2);
    if (grown > options_.max_triangles || mesh_.vertices.size() >= kNone)
      throw std::invalid_argument("refinement: an edge of " + std::to_string(options_.edge_m) +
                                  " m would need more than " + std::to_string(options_.max_triangles) +
                                  " triangles");
    neighbours_.erase(e.key());
    const auto middle = static_cast<std::uint32_t>(mesh_.vertices.size());
    mesh_.vertices.push_back(0.5 * (mesh_.vertices[e.low] + mesh_.vertices[e.high]));
    for (const std::uint32_t triangle : sides)
      if (triangle != kNone) halve_triangle(triangle, e, middle);
  }

  void halve_triangle(std::uint32_t triangle, const Edge& e, std::uint32_t middle) {
    std::array<std::uint32_t, 3> t = mesh_.triangles[triangle];
    // Turned until the third corner is the one opposite to the edge.
    while (t[2] == e.low || t[2] == e.high) t = {t[1], t[2], t[0]};
    const auto added = static_cast<std::uint32_t>(mesh_.triangles.size());
    mesh_.triangles[triangle] = {t[0], middle, t[2]};
    mesh_.triangles.push_back({middle, t[1], t[2]});
    Pair& moved = neighbours_.at(edge(t[1], t[2]).key());
    moved[moved[0] == triangle ? 0 : 1] = added;
    attach(edge(t[0], middle), triangle);
    attach(edge(middle, t[1]), added);
    attach(edge(middle, t[2]), triangle);
    attach(edge(middle, t[2]), added);
    demand(triangle);
    demand(added);
  }

  const RefinementOptions options_;
  TriangleMesh mesh_;
  std::unordered_map<std::uint64_t, Pair, KeyHash> neighbours_;  ///< lookups only: its order has no effect
  std::priority_queue<Edge> demanded_;
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
