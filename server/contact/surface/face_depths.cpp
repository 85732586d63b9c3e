#include "server/contact/surface/face_depths.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "server/contact/surface/contact_elements.h"

namespace takt {
namespace {

/// Centroids closer than this to an edge or a vertex have no direction to it: they are on the surface.
constexpr double kOnSurface_m = 1e-12;
/// Faces that are further away than the closest point by more than rounding are skipped.
constexpr double kFurther = 1.0 + 1e-9;

}  // namespace

void FaceDepths::find(std::span<const Vec3> p_B, std::span<Depth> depths) {
  std::array<Vec3, FaceOctree::kBatch> x_T;
  std::array<const FaceOctree::Leaf*, FaceOctree::kBatch> leaves;
  const std::size_t count = p_B.size();
  for (std::size_t i = 0; i < count; ++i) x_T[i] = X_TB_ * p_B[i];
  target_.octree.find({x_T.data(), count}, leaves);
  // What the tests will read is on its way before the first one begins.
  std::array<std::int32_t, FaceOctree::kBatch> first;
  for (std::size_t i = 0; i < count; ++i) {
    const bool listed = leaves[i] != nullptr && leaves[i]->kind == FaceOctree::Kind::faces;
    if (listed) __builtin_prefetch(target_.octree.faces(*leaves[i]).data());
  }
  for (std::size_t i = 0; i < count; ++i) {
    const bool listed = leaves[i] != nullptr && leaves[i]->kind == FaceOctree::Kind::faces;
    first[i] = listed ? target_.octree.faces(*leaves[i]).front().face : 0;
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
  ClosestOnFace best;
  best.squared_m2 = INFINITY;
  std::int32_t nearest = -1;
  const auto test = [&](std::int32_t index) {
    const ContactFace& face = target_.faces[static_cast<std::size_t>(index)];
    if (target_.least_squared_m2(face, x_T) > kFurther * best.squared_m2) return;
    const ClosestOnFace closest = target_.closest_on_face(face, x_T);
    if (!(closest.squared_m2 < best.squared_m2 || (closest.squared_m2 == best.squared_m2 && index < nearest)))
      return;
    best = closest;
    nearest = index;
  };
  if (leaf->kind == FaceOctree::Kind::faces) {
    const double from_center_m = octree.from_center_m(*leaf, x_T);
    double limit_m = INFINITY;
    for (const FaceOctree::Near& near : octree.faces(*leaf)) {
      if (static_cast<double>(near.at_least_m) - from_center_m > limit_m) break;
      const std::int32_t last = nearest;
      test(near.face);
      if (nearest != last) limit_m = kFurther * std::sqrt(best.squared_m2);
    }
  } else {
    double limit2_m2 = INFINITY;
    target_.face_tree.visit_near(x_T, limit2_m2, [&](std::int32_t index) {
      test(index);
      limit2_m2 = kFurther * best.squared_m2;
    });
  }
  at_face(nearest, best, p_B, x_T, depth);
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

void FaceDepths::at_face(std::int32_t index, const ClosestOnFace& closest, const Vec3& p_B, const Vec3& x_T,
                         Depth& depth) {
  using Feature = ClosestOnFace::Feature;
  const ContactFace& face = target_.faces[static_cast<std::size_t>(index)];
  // An edge between two faces of one patch, or a vertex in its middle, is not there.
  const bool flat =
      closest.feature == Feature::inside ||
      (closest.feature == Feature::edge
           ? target_.faces[static_cast<std::size_t>(face.neighbour[closest.number])].patch == face.patch
           : target_.vertex_patch[face.vertex[closest.number]] == face.patch);
  if (flat) return below_plane(face.patch, p_B, depth);
  const double distance = std::sqrt(closest.squared_m2);
  const bool inside = target_.inside(face, closest, x_T);
  depth.depth_m = inside && distance > kOnSurface_m ? distance : 0.0;
  depth.clear_m = inside ? -distance : distance;
  if (!(depth.depth_m > 0.0)) return;
  depth.bend = true;
  depth.normal_B = X_BT_.R * ((closest.q - x_T) / distance);
  depth.edge_B.setZero();
  if (closest.feature == Feature::edge) {
    const std::size_t k = closest.number;
    depth.edge_B =
        X_BT_.R *
        (target_.vertices[face.vertex[(k + 1) % 3]] - target_.vertices[face.vertex[k]]).normalized();
  }
}

}  // namespace takt
