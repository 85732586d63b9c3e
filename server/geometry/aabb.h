#pragma once
// Axis-aligned bounding boxes in the world frame: the broad phase (thesis 4.2, Fig. 4.3).
#include "plant_models/spatial.h"

namespace takt {

struct Aabb {
  Vec3 lower = Vec3::Zero();
  Vec3 upper = Vec3::Zero();

  bool overlaps(const Aabb& o) const {
    return lower.x() <= o.upper.x() && o.lower.x() <= upper.x() && lower.y() <= o.upper.y() &&
           o.lower.y() <= upper.y() && lower.z() <= o.upper.z() && o.lower.z() <= upper.z();
  }
};

/// A box fixed in a body: centre and half extents in B. Its world box at a pose is conservative.
struct BodyBox {
  Vec3 center_B = Vec3::Zero();
  Vec3 half_B = Vec3::Zero();

  /// World box of the body box moved to X_WB and grown by `margin` (m) on every side.
  Aabb at(const Pose& X_WB, double margin) const {
    const Vec3 c = X_WB * center_B;
    const Vec3 h = X_WB.R.cwiseAbs() * half_B + Vec3::Constant(margin);
    return {c - h, c + h};
  }
};

}  // namespace takt
