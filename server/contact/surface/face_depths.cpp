#include "server/contact/surface/face_depths.h"

#include <array>
#include <cmath>

#include "server/contact/surface/contact_elements.h"

namespace takt {

void FaceDepths::find(std::span<const Vec3> p_B, std::span<Depth> depths) {
  std::array<Vec3, FaceOctree::kBatch> x_T;
  std::array<const FaceOctree::Leaf*, FaceOctree::kBatch> leaves;
  const std::size_t count = p_B.size();
  for (std::size_t i = 0; i < count; ++i) x_T[i] = X_TB_ * p_B[i];
  target_.octree.find({x_T.data(), count}, leaves);
  // What the tests will read is on its way before the first one begins.
  const auto listed = [&](std::size_t i) {
    return leaves[i] != nullptr && leaves[i]->kind == FaceOctree::Kind::faces;
  };
  std::array<std::int32_t, FaceOctree::kBatch> first;
  for (std::size_t i = 0; i < count; ++i)
    if (listed(i)) __builtin_prefetch(target_.octree.faces(*leaves[i]).data());
  for (std::size_t i = 0; i < count; ++i) {
    first[i] = listed(i) ? target_.octree.faces(*leaves[i]).front().face : 0;
    const ContactFace* face = &target_.faces[static_cast<std::size_t>(first[i])];
    __builtin_prefetch(face);
    __builtin_prefetch(&face->inward[1]);
  }
  for (std::size_t i = 0; i < count; ++i)
    __builtin_prefetch(
        &target_.patches[static_cast<std::size_t>(target_.faces[static_cast<std::size_t>(first[i])].patch)]);
  for (std::size_t i = 0; i < count; ++i) find(p_B[i], x_T[i], leaves[i], depths[i]);
}

void FaceDepths::find(const Vec3& p_B, const Vec3& x_T, const FaceOctree::Leaf* leaf, Depth& depth) {
  depth.bend = false;
  const FaceOctree& octree = target_.octree;
  if (leaf == nullptr || leaf->kind == FaceOctree::Kind::outside) {
    depth.depth_m = 0.0;
    depth.clear_m = leaf == nullptr
                        ? octree.at_least_m(x_T)
                        : static_cast<double>(leaf->at_least_m) - octree.from_center_m(*leaf, x_T);
    return;
  }
  if (leaf->kind == FaceOctree::Kind::patch) return below_plane(leaf->patch, p_B, depth);
  NearestFace nearest;
  if (leaf->kind == FaceOctree::Kind::faces) {
    const double from_center_m = octree.from_center_m(*leaf, x_T);
    double limit_m = INFINITY;
    for (const FaceOctree::Near& near : octree.faces(*leaf)) {
      if (static_cast<double>(near.at_least_m) - from_center_m > limit_m) break;
      if (target_.take_nearer(near.face, x_T, nearest))
        limit_m = kFurther * std::sqrt(nearest.closest.squared_m2);
    }
  } else {
    nearest = target_.nearest_face(x_T);
  }
  at_face(nearest, p_B, x_T, depth);
}

void FaceDepths::below_plane(std::int32_t patch, const Vec3& p_B, Depth& depth) {
  if (patch != plane_patch_) {
    const ContactPatch& plane = target_.patches[static_cast<std::size_t>(patch)];
    plane_patch_ = patch;
    plane_normal_B_ = X_BT_.R * plane.normal;
    plane_offset_m_ = plane.offset_m - plane.normal.dot(X_TB_.p);
  }
  depth.depth_m = plane_depth(plane_normal_B_.x(), plane_normal_B_.y(), plane_normal_B_.z(), plane_offset_m_,
                              p_B.x(), p_B.y(), p_B.z());
  depth.clear_m = -depth.depth_m;
  if (depth.depth_m > 0.0) depth.normal_B = plane_normal_B_;
}

void FaceDepths::at_face(const NearestFace& nearest, const Vec3& p_B, const Vec3& x_T, Depth& depth) {
  const ContactFace& face = target_.faces[static_cast<std::size_t>(nearest.face)];
  const ClosestOnFace& closest = nearest.closest;
  if (target_.is_flat(face, closest)) return below_plane(face.patch, p_B, depth);
  const double distance = std::sqrt(closest.squared_m2);
  const bool inside = target_.inside(face, closest, x_T);
  depth.depth_m = inside && distance > kOnSurface_m ? distance : 0.0;
  depth.clear_m = inside ? -distance : distance;
  if (!(depth.depth_m > 0.0)) return;
  depth.bend = true;
  depth.normal_B = X_BT_.R * ((closest.q - x_T) / distance);
  depth.edge_B = X_BT_.R * target_.edge_direction(face, closest);
}

}  // namespace takt
