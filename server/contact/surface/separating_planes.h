#pragma once
// Regions in which a cluster of the Base's elements cannot touch the Target, described by a few planes.
//
// A region is valid while no centroid of the cluster's elements moves by more than `bound_m` along the axes
// of the cluster's box. Within that reach (the box, grown) each face of the Target belongs to one of the
// planes or is below one of them. The set above all planes is convex and contains no face, and one of its
// points is outside of the Target: so all of it is outside. Sliding along a plane keeps the region valid, so
// a peg that slides along the wall of its hole needs few updates.
//
// The region is solid if, moreover, the faces of each plane are above all other planes and all other faces
// are deep below one of them. Then every point a little below any of the planes is inside, and the closest
// point of the surface is on the border of the set above all planes.
#include <array>
#include <cstdint>
#include <span>

#include "server/geometry/surface/contact_surface_data.h"

namespace takt {

struct SeparatingPlanes {
  static constexpr std::size_t kMaxPlanes = 16;
  enum class Kind : std::uint8_t { none, free, solid };

  Kind kind = Kind::none;
  bool made = false;  ///< false: not searched yet
  std::uint8_t count = 0;
  std::array<std::int32_t, kMaxPlanes> planes{};  ///< patches of the Target
  /// Solid: bit i is set if the mesh covers the whole facet that plane i contributes to the region.
  std::uint32_t covered = 0;
  Vec3 bound_m = Vec3::Zero();  ///< Kind::none: motion after which the search is repeated
  Pose X_TB;
  Vec3 center_T = Vec3::Zero();
  double deepest_m = 0.0;  ///< deepest penetration for which a solid region is valid
  double until_m = 0.0;    ///< valid while ContactSearch has not travelled further
  /// After the region is left: motion, and travelled length, after which the search is repeated.
  double again_after_m = 0.0, again_m = 0.0;

  std::span<const std::int32_t> all() const { return {planes.data(), count}; }
  double least_bound_m() const { return bound_m.minCoeff(); }
  /// Share of the bound that the motion to this pose takes.
  double used(const ContactCluster& cluster, const Pose& pose) const;
};

/// Lengths for the classification as on, above and below a plane of this Target.
struct PlaneTolerance {
  explicit PlaneTolerance(const ContactSurface::Data& target)
      : flat_m(1e-8 * target.radius_m + 1e-9), clear_m(3.0 * flat_m), tie_m(10.0 * flat_m) {}
  double flat_m;   ///< faces are on their plane within this
  double clear_m;  ///< centroids that are this much above a plane are above it
  double tie_m;    ///< points closer than this to where two planes meet may belong to either
};

/// Searches the widest region about the cluster at this pose; with `solid` it prefers a solid one.
void find_free_region(const ContactSurface::Data& target, const ContactCluster& cluster, const Pose& X_TB,
                      bool solid, SeparatingPlanes& region);

}  // namespace takt
