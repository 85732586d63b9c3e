#pragma once
// Penetrations of single elements of the Base at one pose: the distance of a centroid inside of the Target
// from the closest point of the Target's surface. Of equally close faces the lowest number counts.
#include <cstdint>
#include <span>

#include "server/geometry/surface/contact_surface_data.h"

namespace takt {

class FaceDepths {
 public:
  struct Depth {
    double depth_m = 0.0;  ///< not positive: outside
    double clear_m = 0.0;  ///< outside: lower bound of the distance from the surface
    Vec3 normal_B;         ///< outward normal of the Target at the closest point, if inside
    bool bend = false;     ///< the closest point is on an edge, or on a vertex (edge_B zero)
    Vec3 edge_B;           ///< direction of the edge, if inside on a bend
  };

  explicit FaceDepths(const ContactSurface::Data& target) : target_(target) {}

  /// `X_BT`: pose of the Target in the Base, the inverse of X_TB.
  void at(const Pose& X_TB, const Pose& X_BT) {
    X_TB_ = X_TB;
    X_BT_ = X_BT;
    plane_patch_ = -1;
  }
  /// Of at most FaceOctree::kBatch points of the Base.
  void find(std::span<const Vec3> p_B, std::span<Depth> depths);

 private:
  void find(const Vec3& p_B, const Vec3& x_T, const FaceOctree::Leaf& leaf, Depth& depth);
  void below_plane(std::int32_t patch, const Vec3& p_B, Depth& depth);
  void at_face(const NearestFace& nearest, const Vec3& p_B, const Vec3& x_T, Depth& depth);

  const ContactSurface::Data& target_;
  Pose X_TB_, X_BT_;
  std::int32_t plane_patch_ = -1;  ///< whose plane follows, in the frame of the Base
  Vec3 plane_normal_B_ = Vec3::Zero();
  double plane_offset_m_ = 0.0;
};

}  // namespace takt
