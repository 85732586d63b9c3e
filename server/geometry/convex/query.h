#pragma once
// Overlap of a pair of convex shapes in repeated queries, between which the shapes move little (thesis 6.2).
//
// The verdict is that of convex_overlap(), bit for bit, whatever the earlier queries were. The hint that
// earlier queries leave serves only to *prove* a verdict at the present poses; the validity of a proof does
// not depend on its origin:
//
// - An axis on which the shapes' extreme points lie further apart than the margin proves "apart". The extreme
//   points are searched at the present poses; the hint gives the start of the search.
// - A point of A and a point of B closer than the margin prove "overlapping".
// - A ball of radius `depth` around the origin that was inside the Minkowski difference A - B, at a pose from
//   which no point of B has moved, relative to A, by `depth` or more, proves "overlapping".
//
// Each proof must hold by more than a guard of kGuard times the size of the problem. convex_overlap() is
// exact to at most a tenth of the guard (its header), so a proof gives its verdict. If the hint proves no
// verdict, a GJK search (Gilbert, Johnson, Keerthi 1988) runs until its first proof. If the search finds no
// proof, because the shapes are within the guard of touching, convex_overlap() decides. So every verdict that
// could depend on rounding or on the path of a search comes from a query without memory, and a simulation
// continued from a snapshot with empty hints has the same bits.
#include <cstdint>

#include "server/geometry/convex/overlap.h"

namespace takt {

/// Result of earlier queries of one pair of shapes, used by the next. Valid for these two shapes in this
/// order as long as both keep their vertices.
struct ConvexHint {
  enum class Evidence : std::uint8_t { none, apart, overlapping };
  Evidence evidence = Evidence::none;
  std::uint32_t vertex_a = ConvexShape::kNoVertex;  ///< start of the climbs
  std::uint32_t vertex_b = ConvexShape::kNoVertex;
  Vec3 axis_A = Vec3::UnitX();  ///< apart: the separating unit vector, from A to B
  // Overlapping: points of A and B whose distance is `distance` at the relative orientation R_AB; the origin
  // lies `depth` inside the difference.
  Vec3 point_A = Vec3::Zero(), point_B = Vec3::Zero();
  Mat3 R_AB = Mat3::Identity();
  double depth = 0.0;
  double reach = 0.0;  ///< largest distance from point_B of the points of B that the proof rests on (m)
};

/// Number of queries by the way that answered them.
struct QueryCounts {
  std::uint64_t by_hint = 0;    ///< the hint still proved the verdict
  std::uint64_t by_search = 0;  ///< a new proof was found
  std::uint64_t by_mpr = 0;     ///< no proof: convex_overlap() decided
};

/// The verdict of convex_overlap() with the same arguments. `hint` is default-constructed or left by any
/// earlier query of the same two shapes. Throws as check_query. Does not allocate.
bool convex_overlap(const ConvexShape& a, const Pose& X_WA, const ConvexShape& b, const Pose& X_WB,
                    double margin, ConvexHint& hint, QueryCounts& counts);

/// Share of the size of the problem (sum of the radii and the margin) by which a proof must hold.
constexpr double kGuard = 1e-7;

}  // namespace takt
