#pragma once
// Overlap of a pair of convex shapes that is asked again and again while the shapes move little (thesis 6.2).
//
// The verdict is that of convex_overlap(), bit for bit, whatever was asked before. What is remembered of
// earlier queries (the hint) is only ever used to *prove* a verdict at the present poses, and a proof does
// not care how it was found:
//
// - An axis on which the shapes' extreme points lie further apart than the margin proves "apart". The
//   extreme points are searched at the present poses; the hint says where to begin.
// - A point of A and a point of B closer than the margin prove "overlapping".
// - A ball of radius `depth` around the origin that was inside the Minkowski difference A - B, at a pose from
//   which no point of B has moved, relative to A, by `depth` or more, proves "overlapping".
//
// Each proof must hold by more than a guard of kGuard times the size of the problem. convex_overlap() is
// exact to a tenth of that at most (its header), so where a proof exists, it says the same. Where the hint
// proves nothing, a search (GJK: Gilbert, Johnson, Keerthi 1988, stopped at the first proof) looks for a new
// one. Where that does not find one either, which is within the guard of touching, convex_overlap() itself is
// asked. So every verdict that could depend on rounding or on the path of a search comes from a query without
// memory, and a simulation continued from a snapshot with empty hints has the same bits.
#include <cstdint>

#include "server/geometry/convex/overlap.h"

namespace takt {

/// What earlier queries of one pair of shapes leave for the next. Valid for these two shapes in this order,
/// as long as neither changes its vertices.
struct ConvexHint {
  enum class Evidence : std::uint8_t { none, apart, overlapping };
  Evidence evidence = Evidence::none;
  std::uint32_t vertex_a = ConvexShape::kNoVertex;  ///< where climbs begin
  std::uint32_t vertex_b = ConvexShape::kNoVertex;
  Vec3 axis_A = Vec3::UnitX();  ///< apart: unit vector from A to B on which they are
  // Overlapping: points of A and B that coincided but for `distance` at relative orientation R_AB, the origin
  // of the difference being `depth` inside it.
  Vec3 point_A = Vec3::Zero(), point_B = Vec3::Zero();
  Mat3 R_AB = Mat3::Identity();
  double depth = 0.0;
  double reach = 0.0;  ///< largest distance from point_B of the points of B that the proof rests on (m)
};

/// How queries were answered.
struct QueryCounts {
  std::uint64_t by_hint = 0;    ///< the hint still proved the verdict
  std::uint64_t by_search = 0;  ///< a new proof was found
  std::uint64_t by_mpr = 0;     ///< no proof: convex_overlap() was asked
};

/// The verdict of convex_overlap() with the same arguments. The hint may come from any earlier query of the
/// same two shapes, or be a new one. Throws as check_query. Does not allocate.
bool convex_overlap(const ConvexShape& a, const Pose& X_WA, const ConvexShape& b, const Pose& X_WB,
                    double margin, ConvexHint& hint, QueryCounts& counts);

/// Share of the size of the problem (sum of the radii and the margin) by which a proof must hold.
constexpr double kGuard = 1e-7;

}  // namespace takt
