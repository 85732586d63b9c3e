#include "server/geometry/convex/convex_shape.h"

#include <libqhull_r/libqhull_r.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

namespace takt {
namespace {

/// Runs qhull on the points and passes the result to `use`, which must not keep it.
void with_hull(const std::vector<Vec3>& points, const char* command, const std::function<void(qhT*)>& use) {
  for (std::size_t i = 0; i < points.size(); ++i)
    if (!points[i].allFinite())
      throw std::invalid_argument("a convex hull needs finite points, number " + std::to_string(i) +
                                  " is not");
  if (points.size() < 4)
    throw std::invalid_argument("a convex hull with volume needs at least 4 points, " +
                                std::to_string(points.size()) + " given");
  std::vector<double> coordinates;
  coordinates.reserve(3 * points.size());
  for (const Vec3& v : points) coordinates.insert(coordinates.end(), {v.x(), v.y(), v.z()});

  // qhull prints its long explanations to a stream in memory; the caller gets one sentence.
  char* text = nullptr;
  std::size_t text_size = 0;
  std::FILE* messages = open_memstream(&text, &text_size);
  if (messages == nullptr) throw std::bad_alloc();
  auto context = std::make_unique<qhT>();
  qh_zero(context.get(), messages);
  std::string options = command;
  const int exit_code = qh_new_qhull(context.get(), 3, static_cast<int>(points.size()), coordinates.data(),
                                     False, options.data(), nullptr, messages);
  if (exit_code == 0) use(context.get());
  qh_freeqhull(context.get(), !qh_ALL);
  int long_memory = 0;
  int total_memory = 0;
  qh_memfreeshort(context.get(), &long_memory, &total_memory);
  std::fclose(messages);
  std::free(text);
  if (exit_code != 0)
    throw std::invalid_argument("the " + std::to_string(points.size()) +
                                " points span no volume (qhull code " + std::to_string(exit_code) +
                                "): a convex shape needs four points that are not in one plane");
}

bool are_box_corners(const std::vector<Vec3>& points, const Vec3& lower, const Vec3& upper,
                     const BodyBox& box) {
  if (points.size() != 8) return false;
  std::array<bool, 8> seen{};
  for (const Vec3& v : points) {
    std::size_t corner = 0;
    for (int i = 0; i < 3; ++i) {
      if (v[i] != lower[i] && v[i] != upper[i]) return false;
      if (v[i] == upper[i]) corner |= std::size_t{1} << i;
    }
    if (seen[corner]) return false;
    seen[corner] = true;
  }
  // The general search treats a box whose half extents vanish beside its coordinates.
  return (box.half_B.array() > 0.0).all();
}

/// The graph of the shape's hull, or an empty one if a climb in it is unreliable; extreme_point() then scans
/// all vertices.
HullGraph trusted_graph(const ConvexShape& shape) {
  constexpr double kShortestEdge = 1e-6;  // of the radius
  constexpr double kHeightError = 1e-12;  // of the radius
  HullGraph graph;
  try {
    graph = hull_graph(shape.vertices);
  } catch (const std::invalid_argument&) {
    return {};  // flat
  }
  const std::vector<Vec3>& vertices = shape.vertices;
  for (std::size_t v = 0; v < vertices.size(); ++v)
    for (std::uint32_t i = graph.begin[v]; i < graph.begin[v + 1]; ++i)
      if (!((vertices[graph.neighbours[i]] - vertices[v]).norm() >= kShortestEdge * shape.radius)) return {};
  // qhull merges facets that rounding keeps from being convex; the check finds graphs that this makes unsafe.
  const std::size_t stride = std::max<std::size_t>(1, vertices.size() / 200);
  for (std::size_t v = 0; v < vertices.size(); v += stride) {
    const Vec3 d = vertices[v] - shape.center_B;
    double highest = height(vertices[0], d);
    for (const Vec3& p : vertices) highest = std::max(highest, height(p, d));
    for (const std::uint32_t start : graph.start) {
      double reached = 0.0;
      climb(graph, vertices, d, start, reached);
      if (!(reached >= highest - kHeightError * shape.radius * d.norm())) return {};
    }
  }
  return graph;
}

}  // namespace

ConvexShape ConvexShape::from_points(std::vector<Vec3> points) {
  if (points.empty()) throw std::invalid_argument("a convex shape needs at least one point, none given");
  Vec3 lower = points.front();
  Vec3 upper = points.front();
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i].allFinite())
      throw std::invalid_argument("a convex shape needs finite points, number " + std::to_string(i) +
                                  " is not");
    lower = lower.cwiseMin(points[i]);
    upper = upper.cwiseMax(points[i]);
    sum += points[i];
  }
  ConvexShape shape;
  shape.center_B = sum / static_cast<double>(points.size());
  shape.box.center_B = 0.5 * (lower + upper);
  shape.box.half_B = 0.5 * (upper - lower);
  shape.radius = shape.box.half_B.norm();
  shape.reach = shape.box.center_B.norm() + shape.radius;
  shape.is_box = are_box_corners(points, lower, upper, shape.box);
  shape.vertices = std::move(points);
  if (shape.vertices.size() > kScanLimit) shape.graph = trusted_graph(shape);
  return shape;
}

void ConvexShape::become_box(const Vec3& lower_B, const Vec3& upper_B) {
  vertices.resize(8);
  for (std::size_t corner = 0; corner < 8; ++corner) {
    vertices[corner] =
        Vec3((corner & 1U) != 0U ? upper_B.x() : lower_B.x(), (corner & 2U) != 0U ? upper_B.y() : lower_B.y(),
             (corner & 4U) != 0U ? upper_B.z() : lower_B.z());
  }
  box.center_B = center_B = 0.5 * (lower_B + upper_B);
  box.half_B = 0.5 * (upper_B - lower_B);
  radius = box.half_B.norm();
  reach = box.center_B.norm() + radius;
  is_box = (box.half_B.array() > 0.0).all();
  graph = {};
}

void check_query(const Pose& X_WA, const Pose& X_WB, double margin) {
  for (const auto& [name, pose] : {std::pair{"first", &X_WA}, std::pair{"second", &X_WB}})
    if (!is_finite(*pose))
      throw std::invalid_argument(std::string("the pose of the ") + name +
                                  " of two convex shapes is not finite");
  if (!(margin >= 0.0 && margin <= std::numeric_limits<double>::max()))
    throw std::invalid_argument("the margin between two convex shapes is " + std::to_string(margin) +
                                " m; allowed: a finite number >= 0");
}

std::vector<Vec3> convex_hull_vertices(const std::vector<Vec3>& points) {
  std::vector<std::size_t> extreme;
  with_hull(points, "qhull", [&extreme](qhT* qh) {
    for (const vertexT* v = qh->vertex_list; v != nullptr && v->next != nullptr; v = v->next)
      extreme.push_back(static_cast<std::size_t>(qh_pointid(qh, v->point)));
  });
  std::sort(extreme.begin(), extreme.end());
  std::vector<Vec3> hull;
  hull.reserve(extreme.size());
  for (const std::size_t i : extreme) hull.push_back(points[i]);
  return hull;
}

TriangleMesh convex_hull_mesh(const std::vector<Vec3>& points) {
  TriangleMesh mesh;
  mesh.vertices = points;
  with_hull(points, "qhull Qt", [&mesh](qhT* qh) {
    for (const facetT* facet = qh->facet_list; facet != nullptr && facet->next != nullptr;
         facet = facet->next) {
      std::array<std::uint32_t, 3> t{};
      for (std::size_t k = 0; k < t.size(); ++k) {
        const auto* v = static_cast<const vertexT*>(facet->vertices->e[k].p);
        t[k] = static_cast<std::uint32_t>(qh_pointid(qh, v->point));
      }
      const Vec3& a = mesh.vertices[t[0]];
      const Vec3 normal = (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a);
      if (normal.dot(Vec3(facet->normal[0], facet->normal[1], facet->normal[2])) < 0.0) std::swap(t[1], t[2]);
      mesh.triangles.push_back(t);
    }
  });
  return mesh;
}

HullGraph hull_graph(const std::vector<Vec3>& points) {
  std::vector<std::vector<std::uint32_t>> adjacent(points.size());
  with_hull(points, "qhull Qt", [&adjacent](qhT* qh) {
    for (const facetT* facet = qh->facet_list; facet != nullptr && facet->next != nullptr;
         facet = facet->next) {
      std::vector<std::uint32_t> corners;
      for (const setelemT* e = facet->vertices->e; e->p != nullptr; ++e)
        corners.push_back(static_cast<std::uint32_t>(qh_pointid(qh, static_cast<vertexT*>(e->p)->point)));
      for (const std::uint32_t a : corners)
        for (const std::uint32_t b : corners)
          if (a != b) adjacent[a].push_back(b);
    }
  });
  HullGraph graph;
  graph.begin.push_back(0);
  for (auto& list : adjacent) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
    graph.neighbours.insert(graph.neighbours.end(), list.begin(), list.end());
    graph.begin.push_back(static_cast<std::uint32_t>(graph.neighbours.size()));
  }
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool up : {true, false}) {
      std::uint32_t best = 0;
      bool found = false;
      for (std::uint32_t v = 0; v < points.size(); ++v) {
        if (adjacent[v].empty()) continue;
        if (!found || (up ? points[v][axis] > points[best][axis] : points[v][axis] < points[best][axis]))
          best = v;
        found = true;
      }
      graph.start[static_cast<std::size_t>(2 * axis + (up ? 0 : 1))] = best;
    }
  }
  return graph;
}

}  // namespace takt
