#include "server/contact/surface/face_depths.h"

#include <array>
#include <cmath>

#include "server/contact/surface/contact_elements.h"
#include "server/contact/surface/face_batch.h"

namespace takt {

void FaceDepths::find(std::span<const Vec3> p_B, std::span<Depth> depths) {
  FaceBatch batch;
  constexpr std::array<double, FaceOctree::kBatch> kInside{};
  batch.find(target_, X_TB_, p_B, {kInside.data(), p_B.size()});
  for (std::size_t i = 0; i < p_B.size(); ++i) {
    depths[i].bend = false;
    depths[i].depth_m = 0.0;
    depths[i].clear_m = batch.at_least_m[i];
    const FaceOctree::Leaf* leaf = batch.leaf[i];
    if (leaf == nullptr || leaf->kind == FaceOctree::Kind::outside || batch.at_least_m[i] > 0.0) continue;
    find(p_B[i], batch.x_T[i], *leaf, depths[i]);
  }
}

void FaceDepths::find(const Vec3& p_B, const Vec3& x_T, const FaceOctree::Leaf& leaf, Depth& depth) {
  if (leaf.kind == FaceOctree::Kind::patch) return below_plane(leaf.patch, p_B, depth);
  at_face(target_.nearest_face(x_T, leaf), p_B, x_T, depth);
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
