#include "server/geometry/convex_overlap.h"

#include <ccd/ccd.h>
#include <libqhull_r/libqhull_r.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

namespace takt {
namespace {

static_assert(sizeof(ccd_real_t) == sizeof(double), "libccd must be built with double precision");

// libccd compares with absolute tolerances (2e-16 for squared areas, for instance), so a problem is handed to
// it scaled to size 1: then they mean the same for a 10 um pin and a 10 m table.
//
// The search stops when the portal advances less than kPortalTolerance; the ball is larger than asked by
// kTouch, so that what touches exactly counts, and so that two flat shapes in one plane still have a
// difference with volume.
constexpr double kPortalTolerance = 1e-10;
constexpr double kTouch = 1e-9;
// Extreme points of the Minkowski difference asked for per query; the most ever seen in tests are 18.
// libccd's own limit does not apply to ccdMPRIntersect, so the support functions keep the count.
constexpr int kMaxSupports = 100;

/// One query, in the frame of shape A, lengths divided by the size of the problem.
struct Query {
  const ConvexShape* a;
  const ConvexShape* b;
  Mat3 R_AB;
  Vec3 p_AB;
  double inverse_size;
  double ball;   // scaled radius of the ball on A
  int supports;  // used so far
  bool gave_up;  // limit reached, the verdict is void
};

Vec3 extreme_point(const ConvexShape& shape, const Vec3& d) {
  if (shape.is_box) {
    const Vec3& c = shape.box.center_B;
    const Vec3& h = shape.box.half_B;
    return {c.x() + std::copysign(h.x(), d.x()), c.y() + std::copysign(h.y(), d.y()),
            c.z() + std::copysign(h.z(), d.z())};
  }
  const Vec3* best = shape.vertices.data();
  double best_height = best->dot(d);
  for (const Vec3* v = best + 1; v != shape.vertices.data() + shape.vertices.size(); ++v) {
    const double height = v->x() * d.x() + v->y() * d.y() + v->z() * d.z();
    if (height > best_height) {
      best_height = height;
      best = v;
    }
  }
  return *best;
}

void set(ccd_vec3_t* out, const Vec3& v) {
  out->v[0] = v.x();
  out->v[1] = v.y();
  out->v[2] = v.z();
}

// libccd asks shape A for its extreme point along dir and shape B along -dir, in this order.
void support_a(const void* object, const ccd_vec3_t* dir, ccd_vec3_t* out) {
  // libccd takes const objects; the count below belongs to this query and lives on the caller's stack.
  Query& q = *static_cast<Query*>(const_cast<void*>(object));
  const Vec3 d(dir->v[0], dir->v[1], dir->v[2]);
  if (++q.supports > kMaxSupports) {
    // A difference behind the direction asked for ends both loops of libccd at once, as "no contact".
    q.gave_up = true;
    set(out, -d);
    return;
  }
  // d has unit length, or is NaN where a portal has no area; a NaN must not reach the point.
  const Vec3 ball = d.x() == d.x() ? Vec3(q.ball * d) : Vec3(Vec3::Zero());
  set(out, extreme_point(*q.a, d) * q.inverse_size + ball);
}

void support_b(const void* object, const ccd_vec3_t* dir, ccd_vec3_t* out) {
  const Query& q = *static_cast<const Query*>(object);
  if (q.gave_up) {
    set(out, Vec3::Zero());
    return;
  }
  const Vec3 d = q.R_AB.transpose() * Vec3(dir->v[0], dir->v[1], dir->v[2]);
  set(out, (q.R_AB * extreme_point(*q.b, d) + q.p_AB) * q.inverse_size);
}

void center_a(const void* object, ccd_vec3_t* out) {
  const Query& q = *static_cast<const Query*>(object);
  set(out, q.a->center_B * q.inverse_size);
}

void center_b(const void* object, ccd_vec3_t* out) {
  const Query& q = *static_cast<const Query*>(object);
  set(out, (q.R_AB * q.b->center_B + q.p_AB) * q.inverse_size);
}

const ccd_t kSearch = [] {
  ccd_t ccd;
  CCD_INIT(&ccd);
  ccd.support1 = support_a;
  ccd.support2 = support_b;
  ccd.center1 = center_a;
  ccd.center2 = center_b;
  ccd.mpr_tolerance = kPortalTolerance;
  return ccd;
}();

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
  // A box whose half extents vanish beside its coordinates is left to the general search.
  return (box.half_B.array() > 0.0).all();
}

/// Runs qhull on the points and hands its result to `read`. Throws std::invalid_argument as the functions
/// below.
void with_hull(const std::vector<Vec3>& points, std::string options, const std::function<void(qhT*)>& read) {
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

  // qhull prints its long explanations to a stream; they go to memory, and one sentence of ours to the
  // caller.
  char* text = nullptr;
  std::size_t text_size = 0;
  std::FILE* messages = open_memstream(&text, &text_size);
  if (messages == nullptr) throw std::bad_alloc();
  auto context = std::make_unique<qhT>();
  qh_zero(context.get(), messages);
  const int exit_code = qh_new_qhull(context.get(), 3, static_cast<int>(points.size()), coordinates.data(),
                                     False, options.data(), nullptr, messages);
  if (exit_code == 0) read(context.get());
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
  shape.is_box = are_box_corners(points, lower, upper, shape.box);
  shape.vertices = std::move(points);
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
  is_box = (box.half_B.array() > 0.0).all();
}

bool convex_overlap(const ConvexShape& a, const Pose& X_WA, const ConvexShape& b, const Pose& X_WB,
                    double margin) {
  const double size = a.radius + b.radius + margin;
  const double inverse_size = size > 0.0 ? 1.0 / size : 1.0;
  Query query{&a,
              &b,
              X_WA.R.transpose() * X_WB.R,
              X_WA.R.transpose() * (X_WB.p - X_WA.p),
              inverse_size,
              margin * inverse_size + kTouch,
              0,
              false};
  const bool overlap = ccdMPRIntersect(&query, &query, &kSearch) != 0;
  return overlap || query.gave_up;
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
    for (facetT* facet = qh->facet_list; facet != nullptr && facet->next != nullptr; facet = facet->next) {
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

}  // namespace takt
