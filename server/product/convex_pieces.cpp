#include "server/product/convex_pieces.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <stdexcept>

#include "server/geometry/convex/convex_shape.h"
#include "server/geometry/convex/volume_comparison.h"

namespace takt::product {

namespace {

constexpr double kSame_m = 1e-7;
constexpr double kAgrees = 0.01;
constexpr std::size_t kMostPieces = 300;
using Pieces = std::vector<std::vector<Vec3>>;

double hull_volume(const std::vector<Vec3>& points) {
  try {
    const std::vector<Vec3> corners = convex_hull_vertices(points);
    return volume_properties(convex_hull_mesh(corners)).volume;
  } catch (const std::invalid_argument&) {
    return 0.0;  // flat
  }
}

/// Directions of plane normals and cylinder axes, each once.
std::vector<Vec3> axes_of(const Body& body) {
  std::vector<Vec3> axes;
  for (const Face& face : body.faces) {
    if (face.kind != SurfaceKind::plane && face.kind != SurfaceKind::cylinder) continue;
    if (std::none_of(axes.begin(), axes.end(),
                     [&](const Vec3& a) { return a.cross(face.axis_B).norm() < 1e-6; }))
      axes.push_back(face.axis_B);
  }
  return axes;
}

/// Heights at which the outline changes: those of planes across the axis.
std::vector<double> heights(const Body& body, const Vec3& axis) {
  std::vector<double> result;
  for (const Face& face : body.faces)
    if (face.kind == SurfaceKind::plane && std::abs(face.axis_B.dot(axis)) > 1.0 - 1e-9)
      result.push_back(face.point_B.dot(axis));
  for (const Vec3& vertex : body.mesh.vertices) {
    if (result.size() > 64) break;
    const double h = vertex.dot(axis);
    if (std::none_of(result.begin(), result.end(), [&](double x) { return std::abs(x - h) < kSame_m; }))
      result.push_back(h);
  }
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end(), [](double a, double b) { return b - a < kSame_m; }),
               result.end());
  return result;
}

/// The body between two heights.
std::vector<Vec3> slab(const TriangleMesh& mesh, const Vec3& axis, double from, double to) {
  std::vector<Vec3> points;
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 &p = mesh.vertices[t[k]], &q = mesh.vertices[t[(k + 1) % 3]];
      const double a = p.dot(axis), b = q.dot(axis);
      if (a >= from - kSame_m && a <= to + kSame_m) points.push_back(p);
      for (const double h : {from, to})
        if ((a - h) * (b - h) < 0.0) points.push_back(p + (q - p) * ((h - a) / (b - a)));
    }
  }
  return points;
}

std::optional<Pieces> stack(const Body& body, const Vec3& axis, double volume) {
  const std::vector<double> h = heights(body, axis);
  if (h.size() < 2 || h.size() > 24) return std::nullopt;
  Pieces pieces;
  double sum = 0.0;
  for (std::size_t i = 0; i + 1 < h.size(); ++i) {
    // Within the slab, lest vertices of the caps of wider sections belong to it.
    const double margin = 1e-3 * (h[i + 1] - h[i]);
    std::vector<Vec3> points = slab(body.mesh, axis, h[i] + margin, h[i + 1] - margin);
    if (points.size() < 4) continue;
    for (Vec3& p : points) {  // out to the caps
      const double at = p.dot(axis);
      if (std::abs(at - h[i] - margin) < 1e-9) p -= margin * axis;
      if (std::abs(at - h[i + 1] + margin) < 1e-9) p += margin * axis;
    }
    sum += hull_volume(points);
    if (sum > (1.0 + kAgrees) * volume) return std::nullopt;
    pieces.push_back(std::move(points));
  }
  if (std::abs(sum - volume) > kAgrees * volume) return std::nullopt;
  return pieces;
}

/// Merges triangles to convex polygons (Hertel and Mehlhorn 1983). Vertices by number; `at` gives their places.
std::vector<std::vector<std::uint32_t>> merge_convex(
    const std::vector<std::array<std::uint32_t, 3>>& triangles, const std::vector<Eigen::Vector2d>& at) {
  std::vector<std::vector<std::uint32_t>> polygons;
  for (const auto& t : triangles) polygons.push_back({t[0], t[1], t[2]});
  const auto turns_left = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const Eigen::Vector2d u = at[b] - at[a], v = at[c] - at[b];
    return u.x() * v.y() - u.y() * v.x() >= -1e-9 * u.norm() * v.norm();
  };
  for (bool again = true; again;) {
    again = false;
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> edges;
    for (std::size_t p = 0; p < polygons.size(); ++p)
      for (std::size_t k = 0; k < polygons[p].size(); ++k)
        edges[{polygons[p][k], polygons[p][(k + 1) % polygons[p].size()]}] = p;
    std::vector<char> touched(polygons.size(), 0);
    for (const auto& [edge, p] : edges) {
      const auto other = edges.find({edge.second, edge.first});
      if (other == edges.end() || other->second == p) continue;
      const std::size_t q = other->second;
      if (touched[p] != 0 || touched[q] != 0) continue;
      const auto &P = polygons[p], &Q = polygons[q];
      const std::size_t i = static_cast<std::size_t>(std::find(P.begin(), P.end(), edge.first) - P.begin());
      const std::size_t j = static_cast<std::size_t>(std::find(Q.begin(), Q.end(), edge.second) - Q.begin());
      std::vector<std::uint32_t> merged;  // P from the edge's end around to its begin, then the rest of Q
      for (std::size_t k = 1; k <= P.size(); ++k) merged.push_back(P[(i + k) % P.size()]);
      for (std::size_t k = 2; k < Q.size(); ++k) merged.push_back(Q[(j + k) % Q.size()]);
      bool convex = true;
      for (std::size_t k = 0; convex && k < merged.size(); ++k)
        convex = turns_left(merged[k], merged[(k + 1) % merged.size()], merged[(k + 2) % merged.size()]);
      if (!convex) continue;
      polygons[p] = std::move(merged);
      polygons[q].clear();
      touched[p] = touched[q] = 1;
      again = true;
    }
    std::erase_if(polygons, [](const auto& polygon) { return polygon.empty(); });
  }
  return polygons;
}

std::optional<Pieces> prism(const Body& body, const Vec3& axis, double volume) {
  double low = 1e300, high = -1e300;
  for (const Vec3& v : body.mesh.vertices)
    low = std::min(low, v.dot(axis)), high = std::max(high, v.dot(axis));
  for (const Vec3& v : body.mesh.vertices)
    if (v.dot(axis) - low > kSame_m && high - v.dot(axis) > kSame_m) return std::nullopt;
  const Vec3 x = axis.unitOrthogonal(), y = axis.cross(x);
  std::vector<Eigen::Vector2d> at;
  for (const Vec3& v : body.mesh.vertices) at.emplace_back(v.dot(x), v.dot(y));
  std::vector<std::array<std::uint32_t, 3>> cap;
  for (const auto& t : body.mesh.triangles) {
    const bool top = std::all_of(t.begin(), t.end(), [&](std::uint32_t v) {
      return high - body.mesh.vertices[v].dot(axis) <= kSame_m;
    });
    if (top) cap.push_back(t);
  }
  Pieces pieces;
  double sum = 0.0;
  for (const auto& polygon : merge_convex(cap, at)) {
    std::vector<Vec3> points;
    for (const std::uint32_t v : polygon) {
      points.push_back(body.mesh.vertices[v]);
      points.push_back(body.mesh.vertices[v] - (high - low) * axis);
    }
    const double part = hull_volume(points);
    if (!(part > 0.0)) continue;
    sum += part;
    pieces.push_back(std::move(points));
  }
  if (pieces.empty() || pieces.size() > kMostPieces || std::abs(sum - volume) > kAgrees * volume)
    return std::nullopt;
  return pieces;
}

}  // namespace

ConvexChoice choose_convex(const Body& body, double allowed) {
  ConvexChoice choice;
  const double volume = volume_properties(body.mesh).volume;
  const double hull = hull_volume(body.mesh.vertices);
  choice.error = volume > 0.0 ? hull / volume - 1.0 : 0.0;
  if (choice.error <= allowed) return choice;
  for (const Vec3& axis : axes_of(body)) {
    for (const bool stacked : {true, false}) {
      auto pieces = stacked ? stack(body, axis, volume) : prism(body, axis, volume);
      if (!pieces) continue;
      choice.method = ConvexMethod::pieces;
      choice.pieces = std::move(*pieces);
      choice.error = 0.0;
      for (const auto& piece : choice.pieces) choice.error += hull_volume(piece);
      choice.error = std::abs(choice.error / volume - 1.0);
      return choice;
    }
  }
  choice.method = ConvexMethod::vhacd;
  return choice;
}

}  // namespace takt::product
