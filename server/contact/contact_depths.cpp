#include "server/contact/contact_depths.h"

#include <algorithm>
#include <cmath>

#include "server/contact/contact_elements.h"
#include "server/geometry/segment_distance.h"

namespace takt {
namespace {

/// Crossings further inside a face than this are on no other.
constexpr double kInside_m = 1e-7;

bool well_inside(const ContactFace& face, const Vec3& x) {
  for (std::size_t k = 0; k < 3; ++k)
    if (!(face.inward[k].dot(x) + face.shift_m[k] > kInside_m)) return false;
  return true;
}

}  // namespace

void ContactDepths::prepare(const ContactSurface::Data& base, const ContactCandidates& lists) {
  const std::size_t slots = lists.slot_count();
  planes_.resize(lists.patches.size());
  group_depth_.resize(lists.plane_slot.size());
  depth_.assign(slots, 0.0);
  fades_.assign(slots, 0);
  area_.resize(slots);
  for (std::size_t i = 0; i < slots; ++i) area_[i] = base.area_m2[static_cast<std::size_t>(lists.element[i])];
  plane_.assign(slots, -1);
  fade_T_.assign(slots, Vec3::Zero());
  hits_.resize(slots);
  known_.assign(slots, Known{});
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
  // One group alone is in the order of slots.
  const bool one = lists.plane_groups.size() == 1 && lists.rays.empty();
  double* const out = one ? depth_.data() : group_depth_.data();
  for (const auto& group : lists.plane_groups) {
    const Plane& plane = planes_[static_cast<std::size_t>(group.plane)];
    const std::size_t at = group.begin;
    plane_depths(plane.normal_B, plane.offset_m, group.end - at, lists.px.data() + at, lists.py.data() + at,
                 lists.pz.data() + at, lists.nx.data() + at, lists.ny.data() + at, lists.nz.data() + at,
                 lists.line_m.data() + at, out + at);
  }
  if (!one)
    for (std::size_t k = 0; k < group_depth_.size(); ++k)
      depth_[static_cast<std::size_t>(lists.plane_slot[k])] = group_depth_[k];
  for (const auto& ray : lists.rays) {
    if (ray.single && follow_known(base, target, lists, ray, X_TB)) continue;
    follow(base, target, lists, ray, X_TB);
    if (ray.single) learn(base, target, lists, ray, X_TB);
  }

  std::size_t count = 0;
  for (std::size_t i = 0; i < depth_.size(); ++i) {
    hits_[count] = static_cast<std::int32_t>(i);
    count += depth_[i] > 0.0 ? 1 : 0;
  }
  hit_count_ = count;
}

void ContactDepths::follow(const ContactSurface::Data& base, const ContactSurface::Data& target,
                           const ContactCandidates& lists, const ContactCandidates::Ray& ray,
                           const Pose& X_TB) {
  const auto slot = static_cast<std::size_t>(ray.slot);
  depth_[slot] = 0.0;
  const auto e = static_cast<std::size_t>(lists.element[slot]);
  const double px = base.px[e], py = base.py[e], pz = base.pz[e];
  const double nx = base.nx[e], ny = base.ny[e], nz = base.nz[e];
  double nearest = base.line_m[e];
  bool met = false, leaves = false;
  std::int32_t region = -1, at_plane = -1;
  Vec3 p, d, met_T = Vec3::Zero();
  bool placed = false;
  for (std::size_t g = ray.group_begin; g < ray.group_end; ++g) {
    const auto& group = lists.face_groups[g];
    const Plane& plane = planes_[static_cast<std::size_t>(group.plane)];
    const Vec3& n = plane.normal_B;
    const double t = plane_depth(n.x(), n.y(), n.z(), plane.offset_m, px, py, pz, nx, ny, nz);
    if (!(t > 0.0 && t <= nearest)) continue;
    const bool out = n.x() * nx + n.y() * ny + n.z() * nz < 0.0;
    // Where it leaves and enters at one point it touches from outside.
    if (met && t == nearest && (out || !leaves)) continue;
    if (!placed) {
      p = X_TB * Vec3(px, py, pz);
      d = -(X_TB.R * Vec3(nx, ny, nz));
      placed = true;
    }
    const Vec3 x = p + t * d;
    for (std::size_t k = group.begin; k < group.end; ++k) {
      const ContactFace& face = target.faces[static_cast<std::size_t>(lists.faces[k])];
      if (!target.pierces(face, p, d, x)) continue;
      met = true;
      leaves = out;
      nearest = t;
      region = face.region;
      at_plane = group.plane;
      met_T = x;
      break;
    }
  }
  if (met && leaves) take(base, target, lists, ray, nearest, at_plane, region, met_T);
}

// The line crosses the surface once: if it is well inside the face of the last time, that is where.
bool ContactDepths::follow_known(const ContactSurface::Data& base, const ContactSurface::Data& target,
                                 const ContactCandidates& lists, const ContactCandidates::Ray& ray,
                                 const Pose& X_TB) {
  const auto slot = static_cast<std::size_t>(ray.slot);
  Known& known = known_[slot];
  if (known.face < 0) return false;
  const auto e = static_cast<std::size_t>(lists.element[slot]);
  const Plane& plane = planes_[static_cast<std::size_t>(known.plane)];
  const Vec3& n = plane.normal_B;
  const double t = plane_depth(n.x(), n.y(), n.z(), plane.offset_m, base.px[e], base.py[e], base.pz[e],
                               base.nx[e], base.ny[e], base.nz[e]);
  const Vec3 p = X_TB * base.point(e), d = -(X_TB.R * base.normal(e));
  const Vec3 x = p + t * d;
  const ContactFace& face = target.faces[static_cast<std::size_t>(known.face)];
  if (!well_inside(face, x)) return false;
  known.at_m = t;
  depth_[slot] = 0.0;
  if (t > 0.0 && t <= base.line_m[e]) take(base, target, lists, ray, t, known.plane, face.region, x);
  return true;
}

void ContactDepths::learn(const ContactSurface::Data& base, const ContactSurface::Data& target,
                          const ContactCandidates& lists, const ContactCandidates::Ray& ray,
                          const Pose& X_TB) {
  const auto slot = static_cast<std::size_t>(ray.slot);
  const auto e = static_cast<std::size_t>(lists.element[slot]);
  const Vec3 p = X_TB * base.point(e), d = -(X_TB.R * base.normal(e));
  known_[slot].face = -1;
  for (std::size_t g = ray.group_begin; g < ray.group_end; ++g) {
    const auto& group = lists.face_groups[g];
    const Plane& plane = planes_[static_cast<std::size_t>(group.plane)];
    const Vec3& n = plane.normal_B;
    const double t = plane_depth(n.x(), n.y(), n.z(), plane.offset_m, base.px[e], base.py[e], base.pz[e],
                                 base.nx[e], base.ny[e], base.nz[e]);
    const Vec3 x = p + t * d;
    for (std::size_t k = group.begin; k < group.end; ++k) {
      if (!well_inside(target.faces[static_cast<std::size_t>(lists.faces[k])], x)) continue;
      known_[slot] = {lists.faces[k], group.plane, t};
      return;
    }
  }
}

// Beginnings above the surface by t along their line are no nearer to it than t cos 60 deg.
double ContactDepths::quiet_m(const ContactCandidates& lists) const {
  if (hit_count_ > 0) return 0.0;
  double nearest_m = INFINITY;
  for (const auto& ray : lists.rays) {
    const Known& known = known_[static_cast<std::size_t>(ray.slot)];
    if (!ray.single || known.face < 0) return 0.0;
    nearest_m = std::min(nearest_m, -known.at_m);
  }
  for (const auto& group : lists.plane_groups) {
    const Plane& plane = planes_[static_cast<std::size_t>(group.plane)];
    const Vec3& n = plane.normal_B;
    for (std::size_t k = group.begin; k < group.end; ++k)
      nearest_m =
          std::min(nearest_m, -plane_depth(n.x(), n.y(), n.z(), plane.offset_m, lists.px[k], lists.py[k],
                                           lists.pz[k], lists.nx[k], lists.ny[k], lists.nz[k]));
  }
  return 0.4 * nearest_m;
}

void ContactDepths::take(const ContactSurface::Data& base, const ContactSurface::Data& target,
                         const ContactCandidates& lists, const ContactCandidates::Ray& ray, double depth_m,
                         std::int32_t plane, std::int32_t region, const Vec3& met_T) {
  const auto slot = static_cast<std::size_t>(ray.slot);
  const auto e = static_cast<std::size_t>(lists.element[slot]);
  depth_[slot] = depth_m;
  plane_[slot] = plane;
  area_[slot] = base.area_m2[e];
  fades_[slot] = 0;
  const double fade_m = base.fade_m[e];
  double distance2 = fade_m * fade_m;
  Vec3 closest = Vec3::Zero();
  for (std::size_t k = ray.rim_begin; k < ray.rim_end; ++k) {
    const ContactRim& rim = target.rims[static_cast<std::size_t>(lists.rims[k])];
    if (rim.region[0] != region && rim.region[1] != region) continue;
    const Vec3 foot = closest_on_segment(met_T, rim.a, rim.b);
    const double squared = (met_T - foot).squaredNorm();
    if (squared < distance2) distance2 = squared, closest = foot;
  }
  if (distance2 >= fade_m * fade_m) return;
  const double distance_m = std::sqrt(distance2);
  const double s = distance_m / fade_m;
  const double weight = rim_weight(s);
  if (!(weight > 0.0)) {
    depth_[slot] = 0.0;
    return;
  }
  area_[slot] = weight * base.area_m2[e];
  fades_[slot] = 1;
  // d(ln w)/ds = (4 - 6 s) / w
  fade_T_[slot] = (4.0 - 6.0 * s) / (weight * fade_m * distance_m) * (met_T - closest);
}

}  // namespace takt
