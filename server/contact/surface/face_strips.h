#pragma once
// The Target along the path of an element of the Base: the plane of the face closest to the element, and those
// of the faces that it passes over on its way. On the path, and beside it up to edges beyond that
// beside it, the height above these planes is the distance from the surface, but for the rounding of edges that go inwards.
#include <array>
#include <span>

#include "server/geometry/surface/contact_surface_data.h"

namespace takt {

/// A piece of a path.
struct FaceStrip {
  static constexpr std::size_t kPlanes = 6;
  double least_m = 0.0;  ///< least height of the element on its way
  std::size_t planes = 0;
  std::array<const ContactPatch*, kPlanes> plane;
  /// From the plane before: 1 at a convex edge, beyond which this plane is the higher one, -1 at an edge that
  /// goes inwards, beyond which it is the lower one, 0 of the first plane.
  std::array<double, kPlanes> side;
  /// To each: the plane beyond an edge that the element may pass beside its path, else null. A strip without it would
  /// press too much beyond a convex edge; beyond a sharp edge that goes inwards it would give way, and the next one would
  /// press again, which adds energy.
  std::array<const ContactPatch*, kPlanes> beside;
  std::array<double, kPlanes> beside_side;  ///< of that edge, as `side`
};

/// An element of the Base at the start of its path.
struct ElementPath {
  Vec3 p_B;
  double reach_m = 0.0;  ///< Targets further away than this at the start are not near
};

/// The face of the Target that is closest to an element, and whether the element is further outside than a margin.
struct NearFace {
  std::int32_t face = -1;  ///< -1: none is near
  bool apart = false;
};

/// Of at most FaceOctree::kBatch elements at one pose.
void find_nearest(const ContactSurface::Data& target, const Pose& X_TB, std::span<const ElementPath> elements,
                  double margin_m, std::span<NearFace> faces);

/// The strip of a straight piece of a path, from x_T to x_T + path_T, and of as much as `beside_m` before and
/// behind it. `face`: the closest one where the strip begins, then the one where the next piece's begins.
void follow_path(const ContactSurface::Data& target, const Vec3& x_T, const Vec3& path_T, double beside_m,
                 std::int32_t& face, FaceStrip& strip);

}  // namespace takt
