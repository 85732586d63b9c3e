#include "server/geometry/convex/overlap.h"

#include <ccd/ccd.h>

namespace takt {
namespace {

static_assert(sizeof(ccd_real_t) == sizeof(double), "libccd must be built with double precision");

// libccd compares with absolute tolerances (2e-16 for squared areas, for instance), so it receives each
// problem scaled to size 1: the tolerances then have the same effect for a 10 um pin and a 10 m table.
//
// The search stops when the portal advances less than kPortalTolerance. The ball exceeds the margin by
// kTouch, so that exact contact counts, and so that two flat shapes in one plane have a difference with
// volume.
constexpr double kPortalTolerance = 1e-10;
constexpr double kTouch = 1e-9;
// Limit of the computed extreme points of the Minkowski difference per query; tests reach at most 18.
// libccd's own limit does not apply to ccdMPRIntersect, so the support functions count.
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
  bool gave_up;  // limit reached, the verdict is invalid
};

// Scans all vertices and ignores the graph: this search is the reference, and its extreme points must not
// depend on the start of a climb.
Vec3 extreme_point(const ConvexShape& shape, const Vec3& d) {
  std::uint32_t unused = 0;
  if (shape.is_box) return shape.extreme_point(d, unused);
  const Vec3* best = shape.vertices.data();
  double best_height = best->dot(d);
  for (const Vec3* v = best + 1; v != shape.vertices.data() + shape.vertices.size(); ++v) {
    const double h = height(*v, d);
    if (h > best_height) {
      best_height = h;
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

// libccd evaluates the extreme point of shape A along dir and that of shape B along -dir, in this order.
void support_a(const void* object, const ccd_vec3_t* dir, ccd_vec3_t* out) {
  // libccd takes const objects; the count below belongs to this query and lives on the caller's stack.
  Query& q = *static_cast<Query*>(const_cast<void*>(object));
  const Vec3 d(dir->v[0], dir->v[1], dir->v[2]);
  if (++q.supports > kMaxSupports) {
    // A difference behind the search direction ends both loops of libccd at once, as "no contact".
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

}  // namespace

bool convex_overlap(const ConvexShape& a, const Pose& X_WA, const ConvexShape& b, const Pose& X_WB,
                    double margin) {
  check_query(X_WA, X_WB, margin);
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

}  // namespace takt
