#include "server/contact/surface/contact_depths.h"

#include <algorithm>
#include <cmath>

#include "server/contact/surface/contact_elements.h"

namespace takt {
namespace {

/// Most calls between attempts to bound the length for which a patch stays the closest one, and the calls that pay
/// for an attempt.
constexpr std::uint16_t kLongestWait = 63, kWorth = 2;
/// Rounding of lengths.
constexpr double kSlack_m = 1e-8;

/// Length that x may move (m) while the closest point of the surface stays inside of the patch that has it.
double stays_for_m(const ContactSurface::Data& target, std::span<const ContactCandidates::Near> list,
                   const Vec3& x, double moved_m, const NearestFace& nearest) {
  const std::int32_t patch = target.faces[static_cast<std::size_t>(nearest.face)].patch;
  double other_m = INFINITY;
  for (const ContactCandidates::Near& near : list) {
    if (near.at_least_m - moved_m >= other_m) break;
    const ContactFace& face = target.faces[static_cast<std::size_t>(near.face)];
    if (face.patch == patch) continue;
    other_m =
        std::min(other_m, std::max(near.at_least_m - moved_m, std::sqrt(target.least_squared_m2(face, x))));
  }
  return 0.5 * (other_m - std::sqrt(nearest.closest.squared_m2)) - kSlack_m;
}

}  // namespace

void ContactDepths::prepare(const ContactCandidates& lists) {
  const std::size_t slots = lists.slot_count();
  planes_.resize(lists.patches.size());
  group_depth_.resize(lists.plane_slot.size());
  depth_.assign(slots, 0.0);
  plane_.assign(slots, -1);
  bend_.assign(slots, -1);
  bends_.reserve(lists.singles.size());
  stays_.assign(lists.singles.size(), Stay{});
  hits_.resize(slots);
  hit_count_ = 0;
  for (const auto& group : lists.plane_groups)
    for (std::size_t k = group.begin; k < group.end; ++k)
      plane_[static_cast<std::size_t>(lists.plane_slot[k])] = group.plane;
}

void ContactDepths::find(const ContactSurface::Data& base, const ContactSurface::Data& target,
                         const ContactCandidates& lists, const Pose& X_TB, const Pose& X_BT,
                         double travelled_m) {
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
    for (std::size_t i = 0; i < lists.singles.size(); ++i)
      find_single(base, target, lists, i, X_TB, X_BT, moved_m, travelled_m);
  }

  std::size_t count = 0;
  for (std::size_t i = 0; i < depth_.size(); ++i) {
    hits_[count] = static_cast<std::int32_t>(i);
    count += depth_[i] > 0.0 ? 1 : 0;
  }
  hit_count_ = count;
}

void ContactDepths::put_below(std::size_t slot, std::int32_t plane_number, const Vec3& p) {
  const Plane& plane = planes_[static_cast<std::size_t>(plane_number)];
  const double depth = plane_depth(plane.normal_B.x(), plane.normal_B.y(), plane.normal_B.z(), plane.offset_m,
                                   p.x(), p.y(), p.z());
  quiet_m_ = std::min(quiet_m_, -depth);
  if (!(depth > 0.0)) return;
  depth_[slot] = depth;
  plane_[slot] = plane_number;
}

void ContactDepths::find_single(const ContactSurface::Data& base, const ContactSurface::Data& target,
                                const ContactCandidates& lists, std::size_t number, const Pose& X_TB,
                                const Pose& X_BT, double moved_m, double travelled_m) {
  const ContactCandidates::Single& single = lists.singles[number];
  Stay& stay = stays_[number];
  const auto slot = static_cast<std::size_t>(single.slot);
  const auto e = static_cast<std::size_t>(lists.element[slot]);
  const Vec3 p = base.point(e);
  depth_[slot] = 0.0;
  bend_[slot] = -1;
  if (travelled_m <= stay.until_m) {
    stay.served = std::max<std::uint16_t>(stay.served, static_cast<std::uint16_t>(stay.served + 1));
    return put_below(slot, stay.plane, p);
  }
  const Vec3 x = X_TB * p;
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
    if (stay.left > 0) {
      --stay.left;
    } else {
      const std::span near(lists.near.data() + single.begin, lists.near.data() + single.end);
      stay.plane = plane_of_nearest;
      stay.until_m = travelled_m + stays_for_m(target, near, x, moved_m, nearest);
      const int longer = std::min<int>(2 * stay.wait + 1, kLongestWait);
      stay.wait = stay.served >= kWorth ? 0 : static_cast<std::uint16_t>(longer);
      stay.left = stay.wait;
      stay.served = 0;
    }
    return put_below(slot, plane_of_nearest, p);
  }
  const double distance = std::sqrt(closest.squared_m2);
  const bool inside = target.inside(face, closest, x);
  quiet_m_ = std::min(quiet_m_, inside ? -distance : distance);
  if (!inside || !(distance > kOnSurface_m)) return;
  depth_[slot] = distance;
  bend_[slot] = static_cast<std::int32_t>(bends_.size());
  bends_.push_back({X_BT.R * ((closest.q - x) / distance), X_BT.R * target.edge_direction(face, closest)});
}

}  // namespace takt
