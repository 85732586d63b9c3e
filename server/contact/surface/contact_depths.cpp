#include "server/contact/surface/contact_depths.h"

#include <algorithm>
#include <cmath>

#include "server/contact/surface/contact_elements.h"

namespace takt {
void ContactDepths::prepare(const ContactCandidates& lists) {
  const std::size_t slots = lists.slot_count();
  planes_.resize(lists.patches.size());
  group_depth_.resize(lists.plane_slot.size());
  depth_.assign(slots, 0.0);
  plane_.assign(slots, -1);
  bend_.assign(slots, -1);
  bends_.reserve(lists.singles.size());
  hits_.resize(slots);
  hit_count_ = 0;
  for (const auto& group : lists.plane_groups)
    for (std::size_t k = group.begin; k < group.end; ++k)
      plane_[static_cast<std::size_t>(lists.plane_slot[k])] = group.plane;
}

void ContactDepths::find(const ContactSurface::Data& base, const ContactSurface::Data& target,
                         const ContactCandidates& lists, const Pose& X_TB, const Pose& X_BT) {
  for (std::size_t i = 0; i < planes_.size(); ++i) {
    const ContactPatch& patch = target.patches[static_cast<std::size_t>(lists.patches[i])];
    planes_[i].normal_B = X_BT.R * patch.normal;
    planes_[i].offset_m = patch.offset_m - patch.normal.dot(X_TB.p);
  }
  bends_.clear();
  quiet_m_ = INFINITY;
  // One group alone is in the order of slots.
  const bool one = lists.plane_groups.size() == 1 && lists.singles.empty();
  double* const out = one ? depth_.data() : group_depth_.data();
  for (const auto& group : lists.plane_groups) {
    const Plane& plane = planes_[static_cast<std::size_t>(group.plane)];
    const std::size_t at = group.begin;
    plane_depths(plane.normal_B, plane.offset_m, group.end - at, lists.px.data() + at, lists.py.data() + at,
                 lists.pz.data() + at, out + at);
  }
  const std::size_t in_planes = lists.plane_slot.size();
  for (std::size_t k = 0; k < in_planes; ++k) quiet_m_ = std::min(quiet_m_, -out[k]);
  if (!one)
    for (std::size_t k = 0; k < in_planes; ++k)
      depth_[static_cast<std::size_t>(lists.plane_slot[k])] = group_depth_[k];
  if (!lists.singles.empty()) {
    const double moved_m = lists.moved_m(X_TB);
    for (const auto& single : lists.singles) find_single(base, target, lists, single, X_TB, X_BT, moved_m);
  }

  std::size_t count = 0;
  for (std::size_t i = 0; i < depth_.size(); ++i) {
    hits_[count] = static_cast<std::int32_t>(i);
    count += depth_[i] > 0.0 ? 1 : 0;
  }
  hit_count_ = count;
}

void ContactDepths::find_single(const ContactSurface::Data& base, const ContactSurface::Data& target,
                                const ContactCandidates& lists, const ContactCandidates::Single& single,
                                const Pose& X_TB, const Pose& X_BT, double moved_m) {
  const auto slot = static_cast<std::size_t>(single.slot);
  const auto e = static_cast<std::size_t>(lists.element[slot]);
  const Vec3 p = base.point(e), x = X_TB * p;
  depth_[slot] = 0.0;
  bend_[slot] = -1;
  NearestFace nearest;
  std::int32_t plane_of_nearest = -1;
  double limit_m = INFINITY;
  for (std::size_t k = single.begin; k < single.end; ++k) {
    const ContactCandidates::Near& near = lists.near[k];
    if (near.at_least_m - moved_m > limit_m) break;
    if (!target.take_nearer(near.face, x, nearest)) continue;
    plane_of_nearest = near.plane;
    limit_m = kFurther * std::sqrt(nearest.closest.squared_m2);
  }
  if (nearest.face < 0) return;
  const ContactFace& face = target.faces[static_cast<std::size_t>(nearest.face)];
  const ClosestOnFace& closest = nearest.closest;
  if (target.is_flat(face, closest)) {
    const Plane& plane = planes_[static_cast<std::size_t>(plane_of_nearest)];
    const double depth = plane_depth(plane.normal_B.x(), plane.normal_B.y(), plane.normal_B.z(),
                                     plane.offset_m, p.x(), p.y(), p.z());
    quiet_m_ = std::min(quiet_m_, -depth);
    if (!(depth > 0.0)) return;
    depth_[slot] = depth;
    plane_[slot] = plane_of_nearest;
  } else {
    const double distance = std::sqrt(closest.squared_m2);
    const bool inside = target.inside(face, closest, x);
    quiet_m_ = std::min(quiet_m_, inside ? -distance : distance);
    if (!inside || !(distance > kOnSurface_m)) return;
    depth_[slot] = distance;
    bend_[slot] = static_cast<std::int32_t>(bends_.size());
    bends_.push_back({X_BT.R * ((closest.q - x) / distance), X_BT.R * target.edge_direction(face, closest)});
  }
}

}  // namespace takt
