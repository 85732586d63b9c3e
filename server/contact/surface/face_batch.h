#pragma once
// Points of the Base in the Target's frame, each with the leaf of the Target's octree that has it.
#include <array>
#include <cstddef>
#include <span>

#include "server/geometry/surface/contact_surface_data.h"

namespace takt {

struct FaceBatch {
  std::array<Vec3, FaceOctree::kBatch> x_T;
  std::array<const FaceOctree::Leaf*, FaceOctree::kBatch> leaf;  ///< null: beside the octree, outside
  /// Lower bound of the signed distance from the surface.
  std::array<double, FaceOctree::kBatch> at_least_m;

  /// Of at most FaceOctree::kBatch points. What tests of faces will read for points that may be no further outside
  /// than `reach_m` is on its way before the first one begins.
  void find(const ContactSurface::Data& target, const Pose& X_TB, std::span<const Vec3> p_B,
            std::span<const double> reach_m);
};

}  // namespace takt
