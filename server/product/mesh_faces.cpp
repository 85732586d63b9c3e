#include "server/product/mesh_faces.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>

#include "server/geometry/mesh/edges.h"
#include "server/geometry/mesh/welding.h"

namespace takt::product {

namespace {

constexpr double kFlat_m = 1e-6;    ///< between a surface and the vertices on it
constexpr double kRound = 1e-4;     ///< likewise, of the radius
constexpr double kSame_rad = 0.01;  ///< between normals of one plane
constexpr double kSoft_rad = 0.6;   ///< between facets of one curved surface
constexpr std::size_t kFewestFacets = 4;

struct Cylinder {
  Vec3 point, axis;
  double radius = 0.0;
  double distance(const Vec3& p) const { return (p - point).cross(axis).norm(); }
};

/// Sum of products of the normals, each with its weight.
struct Spread {
  Mat3 sum = Mat3::Zero();
  void add(const Vec3& normal, double weight) { sum += weight * normal * normal.transpose(); }
};

/// The direction that all normals are at right angles to; none where they turn by less than about twice the root of
/// `least_turn`, or in all directions.
std::optional<Vec3> axis_of(const Mat3& spread, double least_turn) {
  const double total = spread.trace();
  const Eigen::SelfAdjointEigenSolver<Mat3> axes(spread);
  const Vec3& parts = axes.eigenvalues();
  if (parts(0) > 1e-5 * total || parts(0) > 0.01 * parts(1) || parts(1) < least_turn * total)
    return std::nullopt;
  return axes.eigenvectors().col(0);
}

/// Least squares of u^2 + v^2 = 2 a u + 2 b v + c (Kasa 1976), from the first vertex for accuracy.
std::optional<Cylinder> around(const Vec3& axis, const std::vector<Vec3>& vertices) {
  const Vec3 x = axis.unitOrthogonal(), y = axis.cross(x);
  Mat3 A = Mat3::Zero();
  Vec3 rhs = Vec3::Zero();
  for (const Vec3& vertex : vertices) {
    const Vec3 r = vertex - vertices[0];
    const Vec3 row(2.0 * r.dot(x), 2.0 * r.dot(y), 1.0);
    const double value = r.dot(x) * r.dot(x) + r.dot(y) * r.dot(y);
    A += row * row.transpose();
    rhs += value * row;
  }
  const Vec3 solution = A.ldlt().solve(rhs);
  const double squared = solution.z() + solution.x() * solution.x() + solution.y() * solution.y();
  if (!(squared > 0.0) || !solution.allFinite()) return std::nullopt;
  return Cylinder{vertices[0] + solution.x() * x + solution.y() * y, axis, std::sqrt(squared)};
}

bool lies_on(const Cylinder& cylinder, const Vec3& vertex, double within_m) {
  return std::abs(cylinder.distance(vertex) - cylinder.radius) <=
         std::max(within_m, kRound * cylinder.radius);
}

void become(const Cylinder& cylinder, Face& face) {
  face.kind = SurfaceKind::cylinder;
  face.point_B = cylinder.point, face.axis_B = cylinder.axis, face.radius_m = cylinder.radius;
}

/// Divides a closed mesh into faces.
class Segmentation {
 public:
  explicit Segmentation(Body& body) : body_(body), mesh_(body.mesh) {
    double size = 0.0;
    for (const Vec3& v : mesh_.vertices) size = std::max(size, v.cwiseAbs().maxCoeff());
    within_m_ = std::max(kFlat_m, single_precision_m(size));
    for (const auto& t : mesh_.triangles) {
      const Vec3 n = (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0]));
      area_.push_back(0.5 * n.norm());
      normal_.push_back(n.norm() > 0.0 ? Vec3(n.normalized()) : n);
    }
    find_neighbours();
    body_.faces.clear();
    body_.triangle_faces.assign(mesh_.triangles.size(), -1);
  }

  void run() {
    find_patches();
    find_cylinders();
    find_curved();
    std::vector<int> face_of_patch(patch_size_.size(), -1);
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      if (body_.triangle_faces[t] >= 0) continue;
      int& face = face_of_patch[patch_[t]];
      if (face < 0) face = new_face(SurfaceKind::plane);
      body_.triangle_faces[t] = face;
    }
    measure_faces();
    orient_faces(body_);
  }

 private:
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  struct SoftEdge {
    std::size_t a, b;  ///< triangles
    Vec3 from, to;
    double length;
  };

  struct Neighbour {
    std::size_t triangle, edge;
  };

  const Vec3& at(std::uint32_t vertex) const { return mesh_.vertices[vertex]; }
  double angle(std::size_t a, std::size_t b) const {
    return std::atan2(normal_[a].cross(normal_[b]).norm(), normal_[a].dot(normal_[b]));
  }

  void find_neighbours() {
    neighbours_.assign(mesh_.triangles.size(), {});
    const std::vector<HalfEdge> edges = sorted_half_edges(mesh_);
    for (std::size_t i = 0; i < edges.size(); i = end_of_edge(edges, i)) {
      if (end_of_edge(edges, i) != i + 2) continue;
      const std::size_t a = edges[i].triangle, b = edges[i + 1].triangle;
      neighbours_[a].push_back({b, edges_.size()}), neighbours_[b].push_back({a, edges_.size()});
      const Vec3 &from = at(edges[i].low), &to = at(edges[i].high);
      edges_.push_back({a, b, from, to, (to - from).norm()});
    }
  }

  /// The triangles that are connected with `seed` and that `accepts` accepts.
  template <class Accepts>
  std::vector<std::size_t> connected(std::size_t seed, const Accepts& accepts) {
    std::vector<std::size_t> found{seed};
    if (mark_.empty()) mark_.assign(mesh_.triangles.size(), 0);
    mark_[seed] = ++marks_;
    for (std::size_t k = 0; k < found.size(); ++k)
      for (const auto& [next, edge] : neighbours_[found[k]]) {
        if (mark_[next] == marks_ || !accepts(next, found[k])) continue;
        mark_[next] = marks_;
        found.push_back(next);
      }
    return found;
  }

  /// Every triangle belongs to the flat patch of the largest triangle around it. The plane of a patch is that of all of its
  /// triangles, as a single one has the rounding of its corners.
  void find_patches() {
    patch_.assign(mesh_.triangles.size(), kNone);
    std::vector<std::size_t> order(mesh_.triangles.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return area_[a] > area_[b]; });
    for (const std::size_t seed : order) {
      if (patch_[seed] != kNone) continue;
      std::vector<std::size_t> found{seed};
      for (int round = 0; round < 3; ++round) {
        Vec3 n = Vec3::Zero(), centre = Vec3::Zero();
        double whole = 0.0;
        for (const std::size_t t : found) {
          n += area_[t] * normal_[t], whole += area_[t];
          for (const std::uint32_t v : mesh_.triangles[t]) centre += area_[t] / 3.0 * at(v);
        }
        if (!(whole > 0.0) || !(n.norm() > 0.0)) break;
        n.normalize(), centre /= whole;
        const std::size_t before = found.size();
        found = connected(seed, [&](std::size_t t, std::size_t) {
          const auto& corners = mesh_.triangles[t];
          return patch_[t] == kNone && (normal_[t].dot(n) > std::cos(kSame_rad) || is_needle(t)) &&
                 std::all_of(corners.begin(), corners.end(),
                             [&](std::uint32_t v) { return std::abs((at(v) - centre).dot(n)) < within_m_; });
        });
        if (found.size() == before && round > 0) break;
      }
      for (const std::size_t t : found) patch_[t] = patch_size_.size();
      patch_size_.push_back(found.size());
    }
  }

  /// Too narrow for a normal of its own.
  bool is_needle(std::size_t t) const {
    const auto& c = mesh_.triangles[t];
    const double longest =
        std::max({(at(c[1]) - at(c[0])).norm(), (at(c[2]) - at(c[1])).norm(), (at(c[0]) - at(c[2])).norm()});
    return 2.0 * area_[t] < 100.0 * within_m_ * longest;
  }

  std::vector<SoftEdge> soft_edges() const {
    std::vector<SoftEdge> soft;
    for (const SoftEdge& edge : edges_) {
      if (patch_[edge.a] == patch_[edge.b] || body_.triangle_faces[edge.a] >= 0 ||
          body_.triangle_faces[edge.b] >= 0)
        continue;
      const double turn = angle(edge.a, edge.b);
      if (turn > kSame_rad && turn < kSoft_rad) soft.push_back(edge);
    }
    std::stable_sort(soft.begin(), soft.end(),
                     [](const SoftEdge& a, const SoftEdge& b) { return a.length > b.length; });
    return soft;
  }

  /// The longest edges between facets of a cylinder lie along its axis. Two facets give a first cylinder, which grows over
  /// its neighbours and follows them.
  void find_cylinders() {
    for (const SoftEdge& edge : soft_edges()) {
      if (body_.triangle_faces[edge.a] >= 0 || body_.triangle_faces[edge.b] >= 0) continue;
      std::optional<Cylinder> cylinder = first_cylinder(edge);
      std::vector<std::size_t> found;
      for (std::size_t before = 0; cylinder; before = found.size()) {
        found = on_cylinder(edge.a, *cylinder);
        if (found.size() <= before) break;
        const auto better = fitted(found);
        if (!better) break;
        cylinder = better;
      }
      if (!cylinder || !is_round(found, *cylinder)) continue;
      const int face = new_face(SurfaceKind::cylinder);
      become(*cylinder, body_.faces.back());
      for (const std::size_t t : found) body_.triangle_faces[t] = face;
    }
  }

  std::optional<Cylinder> first_cylinder(const SoftEdge& edge) const {
    if (!(edge.length > 10.0 * within_m_)) return std::nullopt;
    const Vec3 axis = (edge.to - edge.from) / edge.length;
    const auto furthest = [&](std::size_t t) {
      Vec3 best = edge.from;
      double most = 0.0;
      for (const std::uint32_t v : mesh_.triangles[t]) {
        const double away = (at(v) - edge.from).cross(axis).norm();
        if (away > most) most = away, best = at(v);
      }
      return best;
    };
    auto cylinder = around(axis, {edge.from, furthest(edge.a), furthest(edge.b)});
    constexpr double kLargest_m = 100.0;
    if (cylinder && cylinder->radius > kLargest_m) return std::nullopt;
    return cylinder;
  }

  std::vector<std::size_t> on_cylinder(std::size_t seed, const Cylinder& cylinder) {
    const auto outwards = [&](std::size_t t) {
      const auto& c = mesh_.triangles[t];
      Vec3 away = (at(c[0]) + at(c[1]) + at(c[2])) / 3.0 - cylinder.point;
      away -= away.dot(cylinder.axis) * cylinder.axis;
      return away.norm() > std::cos(0.5 * kSoft_rad) * cylinder.radius ? normal_[t].dot(away.normalized())
                                                                       : 0.0;
    };
    const double side = outwards(seed);
    return connected(seed, [&](std::size_t t, std::size_t) {
      if (body_.triangle_faces[t] >= 0) return false;
      const auto& corners = mesh_.triangles[t];
      if (!std::all_of(corners.begin(), corners.end(),
                       [&](std::uint32_t v) { return lies_on(cylinder, at(v), within_m_); }))
        return false;
      return is_needle(t) ? std::abs(normal_[t].dot(cylinder.axis)) < 0.5 : outwards(t) * side > 0.8;
    });
  }

  std::optional<Cylinder> fitted(const std::vector<std::size_t>& triangles) const {
    Spread spread;
    std::vector<Vec3> vertices;
    for (const std::size_t t : triangles) {
      spread.add(normal_[t], area_[t]);
      for (const std::uint32_t v : mesh_.triangles[t]) vertices.push_back(at(v));
    }
    const auto axis = axis_of(spread.sum, 1e-5);
    return axis ? around(*axis, vertices) : std::nullopt;
  }

  /// The facets are enough of a circle, and all of them lie on it.
  bool is_round(const std::vector<std::size_t>& triangles, const Cylinder& cylinder) {
    const Vec3 x = cylinder.axis.unitOrthogonal(), y = cylinder.axis.cross(x);
    std::vector<double> angles;
    for (const std::size_t t : triangles)
      for (const std::uint32_t v : mesh_.triangles[t]) {
        if (!lies_on(cylinder, at(v), within_m_)) return false;
        const Vec3 r = at(v) - cylinder.point;
        angles.push_back(std::atan2(r.dot(y), r.dot(x)));
      }
    std::sort(angles.begin(), angles.end());
    constexpr double kOne_rad = 1e-3;
    std::size_t lines = 1;
    double gap = angles.front() + 2.0 * std::numbers::pi - angles.back();
    for (std::size_t k = 1; k < angles.size(); ++k) {
      lines += angles[k] - angles[k - 1] > kOne_rad ? 1 : 0;
      gap = std::max(gap, angles[k] - angles[k - 1]);
    }
    const double covered = 2.0 * std::numbers::pi - gap;
    return lines > kFewestFacets && covered > kSoft_rad &&
           !is_strip(triangles, cylinder, covered * cylinder.radius / static_cast<double>(lines - 1));
  }

  /// One row of facets of a ball, a ring or the like: the neighbours on both of its sides meet it softly, too.
  bool is_strip(const std::vector<std::size_t>& triangles, const Cylinder& cylinder, double facet_m) {
    inside_.resize(mesh_.triangles.size(), 0);
    for (const std::size_t t : triangles) inside_[t] = 1;
    double soft = 0.0, all = 0.0, low = std::numeric_limits<double>::infinity(), high = -low;
    for (const std::size_t t : triangles) {
      for (const std::uint32_t v : mesh_.triangles[t]) {
        const double along = (at(v) - cylinder.point).dot(cylinder.axis);
        low = std::min(low, along), high = std::max(high, along);
      }
      for (const auto& [next, e] : neighbours_[t]) {
        const SoftEdge& edge = edges_[e];
        if (inside_[next] != 0 || std::abs((edge.to - edge.from).dot(cylinder.axis)) > 0.5 * edge.length)
          continue;
        all += edge.length;
        if (angle(t, next) < kSoft_rad) soft += edge.length;
      }
    }
    for (const std::size_t t : triangles) inside_[t] = 0;
    return soft > 0.7 * all && high - low < 3.0 * facet_m;
  }

  /// Small facets that meet softly with several others.
  void find_curved() {
    const std::vector<SoftEdge> soft = soft_edges();
    const auto small = [&](std::size_t t) { return patch_size_[patch_[t]] <= 2; };
    std::vector<int> meetings(patch_size_.size(), 0);
    for (const SoftEdge& edge : soft)
      if (small(edge.a) && small(edge.b)) ++meetings[patch_[edge.a]], ++meetings[patch_[edge.b]];
    const auto is_facet = [&](std::size_t t) {
      return body_.triangle_faces[t] < 0 && small(t) && meetings[patch_[t]] > 1;
    };
    for (std::size_t seed = 0; seed < mesh_.triangles.size(); ++seed) {
      if (!is_facet(seed)) continue;
      const std::vector<std::size_t> found = connected(seed, [&](std::size_t t, std::size_t before) {
        return is_facet(t) && (patch_[t] == patch_[before] || angle(t, before) < kSoft_rad);
      });
      const int face = new_face(SurfaceKind::other);
      std::vector<Vec3> vertices, normals;
      for (const std::size_t t : found) {
        body_.triangle_faces[t] = face;
        normals.push_back(normal_[t]);
        for (const std::uint32_t v : mesh_.triangles[t]) vertices.push_back(at(v));
      }
      recognise(vertices, normals, body_.faces.back());
    }
  }

  int new_face(SurfaceKind kind) {
    body_.faces.emplace_back().kind = kind;
    return static_cast<int>(body_.faces.size()) - 1;
  }

  /// Areas of all faces, places of planes, and the deflection: an arc over a chord w whose ends turn by a is w a / 8 high.
  void measure_faces() {
    std::vector<Vec3> normals(body_.faces.size(), Vec3::Zero()), centres = normals;
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      const auto f = static_cast<std::size_t>(body_.triangle_faces[t]);
      body_.faces[f].area_m2 += area_[t];
      normals[f] += area_[t] * normal_[t];
      for (const std::uint32_t v : mesh_.triangles[t]) centres[f] += area_[t] / 3.0 * at(v);
    }
    for (std::size_t f = 0; f < body_.faces.size(); ++f) {
      Face& face = body_.faces[f];
      if (face.kind != SurfaceKind::plane || !(face.area_m2 > 0.0)) continue;
      face.point_B = centres[f] / face.area_m2;
      face.axis_B = normals[f].norm() > 0.0 ? Vec3(normals[f].normalized()) : Vec3::UnitZ();
    }
    body_.deflection_m = 0.0;
    for (const SoftEdge& edge : edges_) {
      const int face = body_.triangle_faces[edge.a];
      if (face != body_.triangle_faces[edge.b] || !(edge.length > 0.0) ||
          body_.faces[static_cast<std::size_t>(face)].kind == SurfaceKind::plane || is_needle(edge.a) ||
          is_needle(edge.b))
        continue;
      const double chord = 2.0 * std::min(area_[edge.a], area_[edge.b]) / edge.length;
      body_.deflection_m = std::max(body_.deflection_m, chord * angle(edge.a, edge.b) / 8.0);
    }
  }

  Body& body_;
  const TriangleMesh& mesh_;
  double within_m_ = kFlat_m;
  std::vector<double> area_;  ///< by triangle, as the next three
  std::vector<Vec3> normal_;
  std::vector<std::vector<Neighbour>> neighbours_;
  std::vector<std::size_t> patch_;
  std::vector<SoftEdge> edges_;          ///< all edges of two triangles
  std::vector<std::size_t> patch_size_;  ///< by patch: its triangles
  std::vector<std::size_t> mark_;        ///< by triangle: the last search that found it
  std::size_t marks_ = 0;
  std::vector<char> inside_;  ///< by triangle: scratch of is_strip
};

}  // namespace

void recognise(const std::vector<Vec3>& vertices, const std::vector<Vec3>& normals, Face& face) {
  if (vertices.size() < 3) return;
  Vec3 mean = Vec3::Zero();
  Spread spread;
  for (const Vec3& n : normals) mean += n, spread.add(n, 1.0);
  mean.normalize();
  const auto in_plane = [&](const Vec3& v) { return std::abs((v - vertices[0]).dot(mean)) < kFlat_m; };
  if (std::all_of(vertices.begin(), vertices.end(), in_plane)) {
    face.kind = SurfaceKind::plane, face.point_B = vertices[0], face.axis_B = mean;
    return;
  }
  const auto axis = axis_of(spread.sum, 1e-3);
  const auto cylinder = axis ? around(*axis, vertices) : std::nullopt;
  if (!cylinder) return;
  if (std::all_of(vertices.begin(), vertices.end(),
                  [&](const Vec3& v) { return lies_on(*cylinder, v, kFlat_m); }))
    become(*cylinder, face);
}

void orient_faces(Body& body) {
  std::vector<Vec3> normals(body.faces.size(), Vec3::Zero());
  std::vector<double> outwards(body.faces.size(), 0.0);
  for (std::size_t i = 0; i < body.mesh.triangles.size(); ++i) {
    const auto& t = body.mesh.triangles[i];
    const Vec3 &a = body.mesh.vertices[t[0]], &b = body.mesh.vertices[t[1]], &c = body.mesh.vertices[t[2]];
    const Vec3 n = (b - a).cross(c - a);
    const auto f = static_cast<std::size_t>(body.triangle_faces[i]);
    const Face& face = body.faces[f];
    normals[f] += n;
    Vec3 away = (a + b + c) / 3.0 - face.point_B;
    if (face.kind != SurfaceKind::sphere) away -= away.dot(face.axis_B) * face.axis_B;
    if (face.kind == SurfaceKind::torus) away -= face.radius_m * away.normalized();
    outwards[f] += n.dot(away.normalized());
  }
  for (std::size_t f = 0; f < body.faces.size(); ++f) {
    Face& face = body.faces[f];
    if (face.kind == SurfaceKind::plane) {
      if (normals[f].dot(face.axis_B) < 0.0) face.axis_B = -face.axis_B;
    } else {
      face.concave = outwards[f] < 0.0;
    }
  }
}

void find_faces(Body& body) {
  Segmentation(body).run();
}

}  // namespace takt::product
