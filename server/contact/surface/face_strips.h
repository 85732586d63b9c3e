#pragma once
// The Target along the path of an element of the Base: the plane of the face closest to the element, and those
// of the faces that it passes over on its way. On the path, and beside it as far as the same faces are closest,
// the height above these planes is the distance from the surface, but for the rounding of edges that go inwards.
#include <array>
#include <span>

#include "server/geometry/surface/contact_surface_data.h"

namespace takt {

struct FaceStrip {
  static constexpr std::size_t kPlanes = 6;
  bool near = false;  ///< on its way the element is inside, or no further outside than its margin
  std::array<Vec3, kPlanes> normal_T;
  std::array<double, kPlanes> offset_m{};
  /// From the plane before: 1 at a convex edge, beyond which this plane is the higher one, -1 at an edge that
  /// goes inwards, beyond which it is the lower one, 0 where there is no further plane.
  std::array<double, kPlanes> side{};
};

/// An element of the Base at the start of its path.
struct ElementPath {
  Vec3 p_B;
  Vec3 path_B = Vec3::Zero();  ///< of a straight motion relative to the Target (m)
  double reach_m = 0.0;        ///< Targets further away than this at the start are not near
};

/// Strips of at most FaceOctree::kBatch elements at one pose. `margin_m`: see FaceStrip::near.
void find_strips(const ContactSurface::Data& target, const Pose& X_TB, std::span<const ElementPath> elements,
                 double margin_m, std::span<FaceStrip> strips);

}  // namespace takt
