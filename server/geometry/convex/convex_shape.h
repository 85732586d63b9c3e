#pragma once
// Convex shapes: points, the graph of their hull, and their extreme points. Only this file's source uses
// qhull.
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "plant_models/spatial.h"
#include "server/geometry/aabb.h"
#include "server/geometry/mesh/triangle_mesh.h"

namespace takt {

/// Which vertices of a convex hull share an edge. A climb from any vertex to its highest neighbour ends at
/// the highest vertex of all, because a convex hull has no other local maximum.
struct HullGraph {
  std::vector<std::uint32_t> begin;       ///< by vertex, and one more: its neighbours start here
  std::vector<std::uint32_t> neighbours;  ///< vertex indices
  std::array<std::uint32_t, 6> start{};   ///< extreme vertices along +x, -x, +y, -y, +z, -z
  bool empty() const { return neighbours.empty(); }
};

/// The convex hull of a set of points in the frame B of a body. Points inside the hull are allowed and cost
/// time.
struct ConvexShape {
  /// Up to this many vertices a scan of all vertices is faster than a climb.
  static constexpr std::size_t kScanLimit = 16;

  std::vector<Vec3> vertices;
  Vec3 center_B = Vec3::Zero();  ///< a point well inside: the mean of the vertices
  BodyBox box;                   ///< bounds of the vertices
  double radius = 0.0;           ///< half diagonal of the box (m): the size that tolerances refer to
  double reach = 0.0;            ///< no vertex is further from the origin of B (m)
  bool is_box = false;  ///< the vertices are exactly the corners of `box`: extreme points need no search
  /// Empty for at most kScanLimit vertices, for vertices that span no volume, and for edges shorter than 1e-6
  /// of the radius: rounding could end a climb too early among such edges.
  HullGraph graph;

  /// Keeps the points as they are. Throws std::invalid_argument if `points` is empty or a point is not
  /// finite.
  static ConvexShape from_points(std::vector<Vec3> points);
  /// Becomes the box between two corners; does not allocate if the shape already has eight vertices.
  void become_box(const Vec3& lower_B, const Vec3& upper_B);

  /// Start value for extreme_point() without a hint: the climb begins at the extreme vertex of the nearest
  /// axis.
  static constexpr std::uint32_t kNoVertex = 0xFFFFFFFFU;

  /// A vertex that is highest along d (any length), up to rounding. `vertex` is the start of the climb and
  /// returns its end: a start near the answer costs one scan of its neighbours. Give kNoVertex, or the result
  /// of an earlier call for this shape.
  Vec3 extreme_point(const Vec3& d, std::uint32_t& vertex) const;
  /// Start of a climb if d may be far from the direction that led to `vertex`.
  std::uint32_t higher_start(const Vec3& d, std::uint32_t vertex) const;
  /// Height of the extreme point: max over the vertices of d . vertex.
  double extreme_height(const Vec3& d, std::uint32_t& vertex) const;
};

/// Whether all twelve numbers are finite.
inline bool is_finite(const Pose& X) {
  return X.p.allFinite() && X.R.allFinite();
}
/// Throws std::invalid_argument if a pose or the margin is not finite, or the margin is negative: the
/// searches would return a wrong answer.
void check_query(const Pose& X_WA, const Pose& X_WB, double margin);

/// Extreme points of the convex hull (qhull), in the order given. Throws std::invalid_argument if a point is
/// not finite or the points span no volume.
std::vector<Vec3> convex_hull_vertices(const std::vector<Vec3>& points);

/// The surface of the convex hull in triangles that face outwards; its vertices are all the points, in the
/// order given. Throws as convex_hull_vertices.
TriangleMesh convex_hull_mesh(const std::vector<Vec3>& points);

/// The graph of the hull of these points; points inside the hull have no neighbours. Throws as
/// convex_hull_vertices.
HullGraph hull_graph(const std::vector<Vec3>& points);

// Inline: these two are most of a collision query.

inline double height(const Vec3& v, const Vec3& d) {
  return v.x() * d.x() + v.y() * d.y() + v.z() * d.z();
}

inline std::uint32_t climb(const HullGraph& graph, const std::vector<Vec3>& vertices, const Vec3& d,
                           std::uint32_t at, double& highest) {
  highest = height(vertices[at], d);
  for (;;) {
    std::uint32_t best = at;
    const std::uint32_t end = graph.begin[at + 1];
    for (std::uint32_t i = graph.begin[at]; i < end; ++i) {
      const std::uint32_t v = graph.neighbours[i];
      const double h = height(vertices[v], d);
      if (h > highest) {
        highest = h;
        best = v;
      }
    }
    if (best == at) return at;  // always reached: `highest` grows with every round
    at = best;
  }
}

inline std::uint32_t first_vertex(const HullGraph& graph, const Vec3& d, std::uint32_t vertex) {
  if (vertex != ConvexShape::kNoVertex) return vertex;
  const double x = std::abs(d.x()), y = std::abs(d.y()), z = std::abs(d.z());
  const std::size_t axis = x >= y && x >= z ? 0 : (y >= z ? 1 : 2);
  return graph.start[2 * axis + (d[static_cast<Eigen::Index>(axis)] < 0.0 ? 1U : 0U)];
}

inline std::uint32_t ConvexShape::higher_start(const Vec3& d, std::uint32_t vertex) const {
  if (graph.empty()) return vertex;
  const std::uint32_t other = first_vertex(graph, d, kNoVertex);
  return vertex == kNoVertex || height(vertices[other], d) > height(vertices[vertex], d) ? other : vertex;
}

inline Vec3 ConvexShape::extreme_point(const Vec3& d, std::uint32_t& vertex) const {
  if (is_box) {
    const Vec3& c = box.center_B;
    const Vec3& h = box.half_B;
    return {c.x() + std::copysign(h.x(), d.x()), c.y() + std::copysign(h.y(), d.y()),
            c.z() + std::copysign(h.z(), d.z())};
  }
  if (!graph.empty()) {
    double highest = 0.0;
    vertex = climb(graph, vertices, d, first_vertex(graph, d, vertex), highest);
    return vertices[vertex];
  }
  const Vec3* best = vertices.data();
  double best_height = height(*best, d);
  for (const Vec3* v = best + 1; v != vertices.data() + vertices.size(); ++v) {
    const double h = height(*v, d);
    if (h > best_height) {
      best_height = h;
      best = v;
    }
  }
  return *best;
}

inline double ConvexShape::extreme_height(const Vec3& d, std::uint32_t& vertex) const {
  if (is_box)
    return height(box.center_B, d) + (box.half_B.x() * std::abs(d.x()) + box.half_B.y() * std::abs(d.y()) +
                                      box.half_B.z() * std::abs(d.z()));
  if (!graph.empty()) {
    double highest = 0.0;
    vertex = climb(graph, vertices, d, first_vertex(graph, d, vertex), highest);
    return highest;
  }
  // Two independent chains of maxima run in parallel in the processor.
  const std::size_t n = vertices.size();
  double even = height(vertices[0], d);
  double odd = even;
  std::size_t i = 1;
  for (; i + 1 < n; i += 2) {
    const double h0 = height(vertices[i], d);
    const double h1 = height(vertices[i + 1], d);
    even = h0 > even ? h0 : even;
    odd = h1 > odd ? h1 : odd;
  }
  if (i < n) {
    const double h = height(vertices[i], d);
    even = h > even ? h : even;
  }
  return even > odd ? even : odd;
}

}  // namespace takt
