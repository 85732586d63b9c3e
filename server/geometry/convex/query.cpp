#include "server/geometry/convex/query.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/geometry/convex/epa_polytope.h"

namespace takt {
namespace {

constexpr int kMaxRounds = 40;
constexpr double kDepthShare = 0.5;
// Share of the size of the problem beyond which a motion since the hint is a jump: the hint then is no start.
constexpr double kJump = 0.05;
// Only a finite gap is a proof: invalid poses end in convex_overlap(), which refuses them.
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Upper bound of rounding and of convex_overlap()'s own tolerance. The second term matters only for shapes
/// far from the origin of their frames.
double guard_of(const ConvexShape& a, const ConvexShape& b, double margin) {
  return kGuard * (a.radius + b.radius + margin) + 1e-14 * (a.reach + b.reach);
}

/// Gap between the shapes on a unit axis pointing from A to B: a lower bound of their distance.
double gap_on_axis(const ConvexShape& a, const Pose& X_WA, const ConvexShape& b, const Pose& X_WB,
                   ConvexHint& hint) {
  const Vec3& n_A = hint.axis_A;
  const Vec3 n_W = X_WA.R * n_A;
  const Vec3 d_B = -(X_WB.R.transpose() * n_W);
  return n_W.dot(X_WB.p - X_WA.p) - a.extreme_height(n_A, hint.vertex_a) -
         b.extreme_height(d_B, hint.vertex_b);
}

/// Squared distance now of the two points of an overlap.
double moved2_of(const Pose& X_WA, const Pose& X_WB, const ConvexHint& hint) {
  return ((X_WB.R * hint.point_B - X_WA.R * hint.point_A) + (X_WB.p - X_WA.p)).squaredNorm();
}

/// A rotation by an angle w since the overlap moves no point by more than 2 sin(w / 2) times its distance from
/// the axis; 2 - 2 cos(w) = 3 - trace(R_hint^T R). 1e-14 covers rounding.
double turned_since(const Pose& X_WA, const Pose& X_WB, const ConvexHint& hint) {
  const Mat3 M = X_WA.R * hint.R_AB;
  const double trace = (M.array() * X_WB.R.array()).sum();
  return std::sqrt(std::max(0.0, 3.0 - trace) + 1e-14);
}

bool still_overlapping(const Pose& X_WA, const Pose& X_WB, double margin, double guard,
                       const ConvexHint& hint) {
  const double limit = hint.depth + margin - guard;
  const double moved2 = moved2_of(X_WA, X_WB, hint);
  const double without_depth = margin - guard;
  if (without_depth > 0.0 && moved2 < without_depth * without_depth) return true;
  if (!(limit > 0.0 && hint.depth > 0.0 && moved2 < limit * limit)) return false;
  return std::sqrt(moved2) + turned_since(X_WA, X_WB, hint) * hint.reach < limit;
}

void remember_overlap(const Simplex& simplex, const Difference& difference, ConvexHint& hint) {
  hint.evidence = ConvexHint::Evidence::overlapping;
  hint.point_A.setZero();
  hint.point_B.setZero();
  for (int i = 0; i < simplex.count; ++i) {
    hint.point_A += simplex.weight[i] * simplex.corner[i].a;
    hint.point_B += simplex.weight[i] * simplex.corner[i].b;
  }
  hint.R_AB = difference.R_AB;
  hint.depth = hint.reach = 0.0;
}

/// Computes a lower bound of the origin's depth inside A - B: half the depth suffices for many later queries.
void remember_depth(const Simplex& simplex, Difference& difference, double size, double guard,
                    ConvexHint& hint) {
  Polytope polytope;
  if (!polytope.begin(simplex, difference, size)) return;
  polytope.grow(difference, 0.0, kDepthShare, 1e-6);
  // Rounding is about 1e-15 size^3 in a product, so 1e-9 of the size at the thinnest face. The two points of
  // the hint do not coincide exactly.
  const double depth = polytope.lower() - 1e-8 * size - simplex.nearest().norm();
  if (!(depth > guard)) return;
  hint.depth = depth;
  hint.reach = polytope.reach(hint.point_B);
}

enum class Found : std::uint8_t { apart, overlapping, nothing };

/// GJK until the first proof.
Found search(const ConvexShape& a, const Pose& X_WA, const ConvexShape& b, const Pose& X_WB, double margin,
             double guard, ConvexHint& hint) {
  Difference difference(a, X_WA, b, X_WB, hint.vertex_a, hint.vertex_b);
  const double size = a.radius + b.radius + margin;
  Simplex simplex;
  Vec3 v = hint.evidence == ConvexHint::Evidence::apart
               ? Vec3(-hint.axis_A)
               : Vec3(a.center_B - (difference.R_AB * b.center_B + difference.p_AB));
  if (!(v.squaredNorm() > 0.0)) v = Vec3::UnitX();
  // The depth is useful only for shapes that overlap in several queries.
  const bool again = hint.evidence == ConvexHint::Evidence::overlapping;
  hint.evidence = ConvexHint::Evidence::none;
  bool proven = false;   // a point of A and a point of B are closer than the margin
  bool reached = false;  // the simplex contains the origin, up to rounding
  bool apart = false;
  for (int round = 0; round < kMaxRounds && !reached; ++round) {
    const double length = v.norm();
    const Vec3 n = v / -length;
    const SimplexCorner corner = difference.extreme(n);
    hint.vertex_a = difference.vertex_a;
    hint.vertex_b = difference.vertex_b;
    const double gap = -n.dot(corner.y);
    if (gap > margin + guard && gap < kInfinity) {
      hint.evidence = ConvexHint::Evidence::apart;
      hint.axis_A = n;
      return Found::apart;
    }
    apart = gap > 0.0;
    if (proven && apart) break;                              // apart but within the margin
    if (round > 0 && !(length - gap > 1e-12 * size)) break;  // converged up to rounding
    if (!simplex.add(corner)) break;
    const Simplex::Place place = simplex.reduce_to_nearest();
    if (place == Simplex::Place::failed) break;
    v = simplex.nearest();
    const double distance = v.norm();
    proven = distance < margin - guard;
    reached = place == Simplex::Place::inside || !(distance > 1e-12 * size);
    if (proven || reached) remember_overlap(simplex, difference, hint);
    if (proven && !again) return Found::overlapping;
    // If the shapes overlap by more than the margin, a few more rounds bring the origin inside.
  }
  if (hint.evidence == ConvexHint::Evidence::none) return Found::nothing;
  if (reached) remember_depth(simplex, difference, size, guard, hint);
  return proven || hint.depth > 0.0 ? Found::overlapping : Found::nothing;
}

}  // namespace

bool convex_overlap(const ConvexShape& a, const Pose& X_WA, const ConvexShape& b, const Pose& X_WB,
                    double margin, ConvexHint& hint, QueryCounts& counts) {
  const double guard = guard_of(a, b, margin), jump = kJump * (a.radius + b.radius + margin);
  bool jumped = false;
  if (hint.evidence == ConvexHint::Evidence::apart) {
    const double gap = gap_on_axis(a, X_WA, b, X_WB, hint);
    if (gap > margin + guard && gap < kInfinity && margin >= 0.0) {
      ++counts.by_hint;
      return false;
    }
    jumped = !(gap > margin - jump);
  } else if (hint.evidence == ConvexHint::Evidence::overlapping) {
    if (margin >= 0.0 && still_overlapping(X_WA, X_WB, margin, guard, hint)) {
      ++counts.by_hint;
      return true;
    }
    jumped = !(std::sqrt(moved2_of(X_WA, X_WB, hint)) + turned_since(X_WA, X_WB, hint) * b.radius <
               hint.depth + jump);
  }
  if (jumped) hint = {};
  if (!(margin >= 0.0)) check_query(X_WA, X_WB, margin);
  const Found found = search(a, X_WA, b, X_WB, margin, guard, hint);
  if (found != Found::nothing) {
    ++counts.by_search;
    return found == Found::overlapping;
  }
  hint.evidence = ConvexHint::Evidence::none;
  ++counts.by_mpr;
  return convex_overlap(a, X_WA, b, X_WB, margin);
}

}  // namespace takt
