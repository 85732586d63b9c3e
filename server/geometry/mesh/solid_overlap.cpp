#include "server/geometry/mesh/solid_overlap.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "server/geometry/mesh/edges.h"
#include "server/geometry/mesh/refinement.h"
#include "server/geometry/segment_distance.h"

namespace takt {

namespace {

// Edges are divided until the surface has about this many triangles.
constexpr double kTriangles = 600.0;
// Difference of the normals of faces in one plane.
constexpr double kOnePlane = 1e-3;
// Rays in generic directions: one ray hits an edge of the mesh only by accident, and all three practically
// never.
const std::array<Vec3, 3> kRays{Vec3(0.5773, 0.6112, 0.5414).normalized(),
                                Vec3(-0.7321, 0.2519, 0.6328).normalized(),
                                Vec3(0.1187, -0.8831, 0.4539).normalized()};

double surface_area(const TriangleMesh& mesh) {
  double area = 0.0;
  for (const auto& [a, b, c] : mesh.triangles)
    area += 0.5 * (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).norm();
  return area;
}

/// The first half of each examined edge: all edges between faces in different planes, and per cell of a grid
/// one edge within a plane.
std::vector<HalfEdge> examined_edges(const TriangleMesh& mesh, double cell_m) {
  std::vector<Vec3> normals;
  for (const auto& [a, b, c] : mesh.triangles)
    normals.push_back(
        (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).normalized());
  const std::vector<HalfEdge> halves = sorted_half_edges(mesh);
  std::vector<HalfEdge> edges;
  std::set<std::array<std::int64_t, 6>> cells;
  for (std::size_t i = 0, end = 0; i < halves.size(); i = end) {
    end = end_of_edge(halves, i);
    const Vec3& n = normals[halves[i].triangle];
    bool flat = true;
    for (std::size_t k = i; k < end; ++k) flat = flat && (normals[halves[k].triangle] - n).norm() < kOnePlane;
    if (flat) {
      const Vec3 middle = 0.5 * (mesh.vertices[halves[i].low] + mesh.vertices[halves[i].high]);
      std::array<std::int64_t, 6> cell;
      for (int k = 0; k < 3; ++k) {
        cell[static_cast<std::size_t>(k)] = static_cast<std::int64_t>(std::floor(middle[k] / cell_m));
        cell[static_cast<std::size_t>(k) + 3] = std::llround(n[k] / (10.0 * kOnePlane));
      }
      if (!cells.insert(cell).second) continue;
    }
    edges.push_back(halves[i]);
  }
  return edges;
}

/// Intersection of the line p + t d with the triangle, and its side; 0: no intersection.
int crossing(const Vec3& p, const Vec3& d, const Vec3& a, const Vec3& b, const Vec3& c, double& t) {
  const Vec3 ab = b - a, ac = c - a;
  const Vec3 h = d.cross(ac);
  const double determinant = ab.dot(h);
  if (determinant == 0.0) return 0;
  const Vec3 ap = p - a;
  const double u = ap.dot(h) / determinant;
  const Vec3 q = ap.cross(ab);
  const double v = d.dot(q) / determinant;
  if (!(u >= 0.0 && v >= 0.0 && u + v <= 1.0)) return 0;
  t = ac.dot(q) / determinant;
  return determinant > 0.0 ? -1 : 1;  // negative: inwards
}

}  // namespace

SolidProbe::SolidProbe(const TriangleMesh& mesh) : triangles_(mesh.triangles) {
  std::vector<Aabb> boxes;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec3 &pa = mesh.vertices[a], &pb = mesh.vertices[b], &pc = mesh.vertices[c];
    boxes.push_back({pa.cwiseMin(pb).cwiseMin(pc), pa.cwiseMax(pb).cwiseMax(pc)});
  }
  faces_ = BoxTree(boxes);
  // Vertices of the mesh keep their numbers.
  const double length = 2.0 * std::sqrt(surface_area(mesh) / kTriangles);
  TriangleMesh fine = refine_to_edge(mesh, length);
  for (const HalfEdge& edge : examined_edges(fine, length)) edges_.push_back({edge.low, edge.high});
  vertices_ = std::move(fine.vertices);
  boxes.clear();
  for (const auto& [from, to] : edges_)
    boxes.push_back({vertices_[from].cwiseMin(vertices_[to]), vertices_[from].cwiseMax(vertices_[to])});
  edge_tree_ = BoxTree(boxes);
}

double SolidProbe::distance(const Vec3& p_B, double enough_m) const {
  double best = std::numeric_limits<double>::infinity(), limit = best;
  const double enough = enough_m * enough_m;
  faces_.visit_near(p_B, limit, [&](std::int32_t face) {
    const auto& [a, b, c] = triangles_[static_cast<std::size_t>(face)];
    best = std::min(best, point_triangle_squared_distance(p_B, {vertices_[a], vertices_[b], vertices_[c]}));
    limit = best > enough ? best : -1.0;
  });
  return std::sqrt(best);
}

int SolidProbe::winding(const Vec3& p_B, const Vec3& d_B) const {
  const double length = (p_B - box().center_B).norm() + 2.0 * box().half_B.norm();
  int turns = 0;
  faces_.visit_segment(p_B, p_B + length * d_B, 0.0, [&](std::int32_t face) {
    const auto& [a, b, c] = triangles_[static_cast<std::size_t>(face)];
    double t = 0.0;
    const int side = crossing(p_B, d_B, vertices_[a], vertices_[b], vertices_[c], t);
    if (side != 0 && t > 0.0) turns += side;
  });
  return turns;
}

bool SolidProbe::contains(const Vec3& p_B) const {
  int inside = 0;
  for (const Vec3& d_B : kRays) inside += winding(p_B, d_B) > 0 ? 1 : 0;
  return inside >= 2;
}

/// Edges of one solid in the other.
class OverlapSearch {
 public:
  OverlapSearch(const SolidProbe& edges, const Pose& X_WE, const SolidProbe& solid, const Pose& X_WS,
                SolidOverlap& result, double& deepest)
      : edges_(edges),
        solid_(solid),
        X_WS_(X_WS),
        X_SE_(X_WS.inverse() * X_WE),
        result_(result),
        deepest_(deepest) {}

  void run() {
    // No point is deeper than it is inside the solid's box.
    const Pose X_ES = X_SE_.inverse();
    edges_.edge_tree_.walk(
        [&](const BodyBox& box, std::int32_t) {
          const BodyBox inner = shrunk();
          if (!(inner.half_B.minCoeff() > 0.0)) return false;
          const Aabb of_solid = inner.at(X_ES, 0.0);
          return of_solid.overlaps({box.center_B - box.half_B, box.center_B + box.half_B});
        },
        [&](std::int32_t edge) {
          look(edges_.edges_[static_cast<std::size_t>(edge)]);
          return true;
        });
  }

 private:
  BodyBox shrunk() const {
    BodyBox box = solid_.box();
    box.half_B -= Vec3::Constant(deepest_);
    return box;
  }

  void look(const SolidProbe::Edge& edge) {
    const Vec3 p = X_SE_ * edges_.vertices_[edge.from], q = X_SE_ * edges_.vertices_[edge.to];
    std::array<double, SolidProbe::kCrossings + 2> t;
    std::size_t count = 0;
    t[count++] = 0.0;
    solid_.faces_.visit_segment(p, q, 0.0, [&](std::int32_t face) {
      const auto& [a, b, c] = solid_.triangles_[static_cast<std::size_t>(face)];
      double at = 0.0;
      if (count <= SolidProbe::kCrossings &&
          crossing(p, q - p, solid_.vertices_[a], solid_.vertices_[b], solid_.vertices_[c], at) != 0 &&
          at > 0.0 && at < 1.0)
        t[count++] = at;
    });
    t[count++] = 1.0;
    std::sort(t.begin(), t.begin() + static_cast<std::ptrdiff_t>(count));
    for (std::size_t i = 0; i + 1 < count; ++i) judge(p + 0.5 * (t[i] + t[i + 1]) * (q - p));
    judge(p);
  }

  void judge(const Vec3& p_S) {
    const BodyBox box = shrunk();
    if (!((p_S - box.center_B).cwiseAbs().array() < box.half_B.array()).all()) return;
    // Most points are near the surface or outside: the distance, which takes the longest, is for the others.
    if (near_surface(p_S) || !solid_.contains(p_S)) return;
    deepest_ = solid_.distance(p_S, 0.0);
    result_ = {deepest_, X_WS_ * p_S};
  }

  /// By no more than the deepest so far.
  bool near_surface(const Vec3& p_S) const {
    const double reach = deepest_ * deepest_;
    double limit = reach;
    solid_.faces_.visit_near(p_S, limit, [&](std::int32_t face) {
      const auto& [a, b, c] = solid_.triangles_[static_cast<std::size_t>(face)];
      const std::array<Vec3, 3> corners{solid_.vertices_[a], solid_.vertices_[b], solid_.vertices_[c]};
      if (point_triangle_squared_distance(p_S, corners) <= reach) limit = -1.0;
    });
    return limit < 0.0;
  }

  const SolidProbe& edges_;
  const SolidProbe& solid_;
  const Pose& X_WS_;
  const Pose X_SE_;
  SolidOverlap& result_;
  double& deepest_;
};

SolidOverlap solid_overlap(const SolidProbe& a, const Pose& X_WA, const SolidProbe& b, const Pose& X_WB,
                           double deeper_than_m) {
  SolidOverlap result;
  double deepest = deeper_than_m;
  OverlapSearch(a, X_WA, b, X_WB, result, deepest).run();
  OverlapSearch(b, X_WB, a, X_WA, result, deepest).run();
  return result;
}

}  // namespace takt
