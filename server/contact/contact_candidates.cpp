#include "server/contact/contact_candidates.h"

#include <algorithm>
#include <cmath>

#include "server/geometry/segment_distance.h"

namespace takt {
namespace {

/// Rounding and the width of edges; far above both, far below any bound.
constexpr double kSlack_m = 1e-8;
/// A plane is met for certain only by lines that are not too oblique to it.
constexpr double kSteep = 0.5;

/// Pieces of lines on which the surface near a beginning lies, in bounds: 2 (1 + tan 60 deg), see local().
constexpr double kLocal = 6.0;

double square(double x) {
  return x * x;
}

/// The segment a-b stays farther than `reach_m` on one side of the plane.
bool beyond(const ContactPatch& plane, const Vec3& a, const Vec3& b, double reach_m) {
  const double at_a = plane.normal.dot(a) - plane.offset_m, at_b = plane.normal.dot(b) - plane.offset_m;
  return (at_a > reach_m && at_b > reach_m) || (at_a < -reach_m && at_b < -reach_m);
}

/// The segment a-b stays farther than `reach_m` from the plane or beyond one edge of the face: most of what a
/// hierarchy of boxes lets through, at a fraction of the cost of a distance.
bool apart(const ContactPatch& plane, const ContactFace& face, const Vec3& a, const Vec3& b, double reach_m) {
  if (beyond(plane, a, b, reach_m)) return true;
  for (std::size_t k = 0; k < 3; ++k)
    if (face.inward[k].dot(a) + face.shift_m[k] < -reach_m &&
        face.inward[k].dot(b) + face.shift_m[k] < -reach_m)
      return true;
  return false;
}

}  // namespace

struct ContactCandidates::Build {
  const ContactSurface::Data& base;
  const ContactSurface::Data& target;
  const Pose& X_TB;
  double bound_m;  ///< with slack
  Work& work;
};

double ContactCandidates::moved_m(const Pose& X_TB) const {
  // A point at r from the centre moves by at most |dp| + |dR|_2 |r|; the 2-norm of the difference of two
  // rotations is its Frobenius norm over sqrt(2).
  const double turn2 = 0.5 * (X_TB.R - X_TB_.R).squaredNorm() * square(reach_m_);
  const double shift2 = (X_TB * center_B_ - center_T_).squaredNorm();
  return std::sqrt(turn2) + std::sqrt(shift2);
}

void ContactCandidates::rebuild(const ContactSurface::Data& base, const ContactSurface::Data& target,
                                const ContactCluster& cluster, const Pose& X_TB, double bound_m,
                                std::span<const std::int32_t> above, Work& work) {
  double longest_m = 0.0;
  for (std::size_t e = cluster.begin; e < cluster.end; ++e) longest_m = std::max(longest_m, base.line_m[e]);
  bound_m_ = std::min(bound_m, kLargestTurn * (cluster.radius_m + longest_m));
  reach_m_ = cluster.radius_m + longest_m + 4.0 * bound_m_ + kSlack_m;
  center_B_ = cluster.center_B;
  center_T_ = X_TB * center_B_;
  X_TB_ = X_TB;
  element.clear(), patches.clear(), plane_groups.clear(), plane_slot.clear();
  px.clear(), py.clear(), pz.clear(), nx.clear(), ny.clear(), nz.clear(), line_m.clear();
  rays.clear(), face_groups.clear(), faces.clear(), rims.clear();
  work.simple_.clear();
  work.local_.resize(target.patches.size(), -1);
  const Build build{base, target, X_TB_, bound_m_ + kSlack_m, work};
  for (std::uint32_t e = cluster.begin; e < cluster.end; ++e) {
    const Vec3 p = X_TB * base.point(e);
    bool near = above.empty();
    for (const std::int32_t patch : above) {
      const ContactPatch& plane = target.patches[static_cast<std::size_t>(patch)];
      near = near || plane.normal.dot(p) - plane.offset_m <= build.bound_m;
    }
    if (near) add_element(build, static_cast<std::int32_t>(e));
  }
  finish(base, work);
  for (const std::int32_t patch : patches) work.local_[static_cast<std::size_t>(patch)] = -1;
}

void ContactCandidates::finish(const ContactSurface::Data& base, Work& work) {
  using Simple = Work::Simple;
  std::sort(work.simple_.begin(), work.simple_.end(), [](const Simple& a, const Simple& b) {
    return a.plane != b.plane ? a.plane < b.plane : a.slot < b.slot;
  });
  for (const Simple& s : work.simple_) {
    if (plane_groups.empty() || plane_groups.back().plane != s.plane)
      plane_groups.push_back({s.plane, plane_slot.size(), plane_slot.size()});
    ++plane_groups.back().end;
    const auto e = static_cast<std::size_t>(element[static_cast<std::size_t>(s.slot)]);
    plane_slot.push_back(s.slot);
    px.push_back(base.px[e]), py.push_back(base.py[e]), pz.push_back(base.pz[e]);
    nx.push_back(base.nx[e]), ny.push_back(base.ny[e]), nz.push_back(base.nz[e]);
    line_m.push_back(base.line_m[e]);
  }
  valid_ = true;
}

std::int32_t ContactCandidates::local_patch(const Build& build, std::int32_t patch) {
  std::int32_t& place = build.work.local_[static_cast<std::size_t>(patch)];
  if (place < 0) {
    place = static_cast<std::int32_t>(patches.size());
    patches.push_back(patch);
  }
  return place;
}

void ContactCandidates::add_element(const Build& build, std::int32_t index) {
  const auto e = static_cast<std::size_t>(index);
  Line line;
  line.p = build.X_TB * build.base.point(e);
  line.d = -(build.X_TB.R * build.base.normal(e));
  line.length_m = build.base.line_m[e];
  line.fade_m = build.base.fade_m[e];

  bool steep = true;
  std::int32_t sure = start_patch(build, line, steep);
  if (sure >= 0 && simple(build, line, sure)) {
    build.work.simple_.push_back({local_patch(build, sure), static_cast<std::int32_t>(element.size())});
    element.push_back(index);
    return;
  }
  if (sure != kNothing && steep && local(build, line)) {
    const double length_m = std::min(line.length_m, kLocal * build.bound_m);
    gather(build, line, length_m);
    add_ray(build, line, index, length_m, true);
    return;
  }
  gather(build, line, line.length_m);
  if (build.work.near_.empty()) return;
  if (sure == kNothing) {
    bool outside = false;
    sure = first_patch(build, line, outside);
    // What begins outside and stays away from the surface is never in contact: the line can only enter.
    if (outside) return;
    if (sure >= 0 && simple(build, line, sure)) {
      build.work.simple_.push_back({local_patch(build, sure), static_cast<std::int32_t>(element.size())});
      element.push_back(index);
      return;
    }
  }
  add_ray(build, line, index, line.length_m, false);
}

// The patch that alone is near the beginning of the line; kNothing if none is, kSeveral if several are.
// `steep` becomes false if one of them is oblique or would be entered.
std::int32_t ContactCandidates::start_patch(const Build& build, const Line& line, bool& steep) const {
  const ContactSurface::Data& target = build.target;
  std::int32_t sure = kNothing;
  target.face_tree.visit_segment(line.p, line.p, build.bound_m, [&](std::int32_t face) {
    const ContactFace& f = target.faces[static_cast<std::size_t>(face)];
    if (sure == f.patch) return;
    const ContactPatch& plane = target.patches[static_cast<std::size_t>(f.patch)];
    if (apart(plane, f, line.p, line.p, build.bound_m)) return;
    if (point_triangle_squared_distance(line.p, target.corners(f)) > square(build.bound_m)) return;
    steep = steep && plane.normal.dot(line.d) >= kSteep;
    sure = sure == kNothing ? f.patch : kSeveral;
  });
  return sure;
}

// Where all faces around the beginning are steep to the line, the surface is a height above a plane across
// the line, and a beginning within the bound of it is outside, or below it by no more than (1 + tan 60 deg)
// times the bound, and twice that after both have moved. What is further along is not met first.
bool ContactCandidates::local(const Build& build, const Line& line) const {
  const ContactSurface::Data& target = build.target;
  const Vec3 reach = kLocal * build.bound_m * line.d;
  const double width_m = 2.0 * build.bound_m;
  bool steep = true;
  target.face_tree.visit_segment(line.p - reach, line.p + reach, width_m, [&](std::int32_t face) {
    if (!steep) return;
    const ContactFace& f = target.faces[static_cast<std::size_t>(face)];
    const ContactPatch& plane = target.patches[static_cast<std::size_t>(f.patch)];
    if (plane.normal.dot(line.d) >= kSteep || apart(plane, f, line.p - reach, line.p + reach, width_m))
      return;
    steep = segment_triangle_squared_distance(line.p - reach, line.p + reach, target.corners(f)) >
            square(width_m);
  });
  return steep;
}

/// Faces that the line may meet within `length_m`, by patch.
void ContactCandidates::gather(const Build& build, const Line& line, double length_m) const {
  const ContactSurface::Data& target = build.target;
  const Vec3 end = line.p + length_m * line.d;
  build.work.near_.clear();
  target.face_tree.visit_segment(line.p, end, build.bound_m, [&](std::int32_t face) {
    const ContactFace& f = target.faces[static_cast<std::size_t>(face)];
    if (apart(target.patches[static_cast<std::size_t>(f.patch)], f, line.p, end, build.bound_m)) return;
    if (segment_triangle_squared_distance(line.p, end, target.corners(f)) > square(build.bound_m)) return;
    build.work.near_.push_back({face, f.patch});
  });
  std::sort(build.work.near_.begin(), build.work.near_.end(), [](const Work::Near& a, const Work::Near& b) {
    return a.patch != b.patch ? a.patch < b.patch : a.face < b.face;
  });
}

// Of a line that begins far from the surface: the patch that it meets first. `outside` if it is entered
// there.
std::int32_t ContactCandidates::first_patch(const Build& build, const Line& line, bool& outside) const {
  const ContactSurface::Data& target = build.target;
  double nearest = line.length_m;
  std::int32_t first = kNothing;
  for (const Work::Near& n : build.work.near_) {
    const ContactFace& face = target.faces[static_cast<std::size_t>(n.face)];
    const ContactPatch& patch = target.patches[static_cast<std::size_t>(n.patch)];
    const double along = patch.normal.dot(line.d);
    if (along == 0.0) continue;
    const double t = (patch.offset_m - patch.normal.dot(line.p)) / along;
    const Vec3 x = line.p + t * line.d;
    if (!(t > 0.0 && t <= nearest) || !target.pierces(face, line.p, line.d, x)) continue;
    nearest = t;
    first = n.patch;
    // Not to be mistaken: neither near an edge nor oblique.
    outside = along < -0.01;
    for (std::size_t k = 0; k < 3; ++k) {
      const bool flat = target.faces[static_cast<std::size_t>(face.neighbour[k])].patch == face.patch;
      outside = outside && (flat || face.inward[k].dot(x) + face.shift_m[k] > 1e-6);
    }
  }
  return first;
}

/// With the faces of gather().
void ContactCandidates::add_ray(const Build& build, const Line& line, std::int32_t index, double length_m,
                                bool single) {
  const ContactSurface::Data& target = build.target;
  const auto slot = static_cast<std::int32_t>(element.size());
  element.push_back(index);
  Ray ray{slot, face_groups.size(), face_groups.size(), rims.size(), rims.size(), single};
  for (const Work::Near& n : build.work.near_) {
    const std::int32_t plane = local_patch(build, n.patch);
    if (face_groups.size() == ray.group_begin || face_groups.back().plane != plane)
      face_groups.push_back({plane, faces.size(), faces.size()});
    faces.push_back(n.face);
    face_groups.back().end = faces.size();
  }
  ray.group_end = face_groups.size();
  const double reach_m = build.bound_m + line.fade_m;
  const Vec3 end = line.p + length_m * line.d;
  if (!target.rims.empty())
    target.face_tree.visit_segment(line.p, end, reach_m, [&](std::int32_t face) {
      for (const std::int32_t rim : target.faces[static_cast<std::size_t>(face)].rim) {
        if (rim < 0) continue;
        const ContactRim& edge = target.rims[static_cast<std::size_t>(rim)];
        if (segment_segment_squared_distance(line.p, end, edge.a, edge.b) <= square(reach_m))
          rims.push_back(rim);
      }
    });
  const auto first = rims.begin() + static_cast<std::ptrdiff_t>(ray.rim_begin);
  std::sort(first, rims.end());
  rims.erase(std::unique(first, rims.end()), rims.end());
  ray.rim_end = rims.size();
  rays.push_back(ray);
}

// Where the line may cross the plane while everything moves by the bound is within the bound of a piece of
// the line. If no other patch is that near to this piece, extended to the beginning of the line, then the
// crossing is inside the patch, nothing is met before it, and a beginning above the plane is outside of the
// Target.
bool ContactCandidates::simple(const Build& build, const Line& line, std::int32_t patch) const {
  const ContactSurface::Data& target = build.target;
  const ContactPatch& plane = target.patches[static_cast<std::size_t>(patch)];
  const double along = plane.normal.dot(line.d);
  if (along < kSteep) return false;
  const double t = (plane.offset_m - plane.normal.dot(line.p)) / along;
  const double spread_m = build.bound_m / along;
  const Vec3 from = line.p + std::min(0.0, t - spread_m) * line.d;
  const Vec3 to = line.p + std::max(0.0, t + spread_m) * line.d;
  const Vec3 x = line.p + t * line.d;
  const double rim_reach_m = build.bound_m + line.fade_m;
  bool inside = false, alone = true;
  const std::int32_t region = target.patch_region[static_cast<std::size_t>(patch)];
  target.face_tree.visit_segment(
      from, to, target.rims.empty() ? build.bound_m : rim_reach_m, [&](std::int32_t face) {
        if (!alone) return;
        const ContactFace& f = target.faces[static_cast<std::size_t>(face)];
        if (f.patch == patch) {
          bool here = !inside;
          for (std::size_t k = 0; here && k < 3; ++k)
            here = f.inward[k].dot(x) + f.shift_m[k] >= -kEdgeWidth_m;
          inside = inside || here;
        } else if (!apart(target.patches[static_cast<std::size_t>(f.patch)], f, from, to, build.bound_m) &&
                   segment_triangle_squared_distance(from, to, target.corners(f)) <= square(build.bound_m)) {
          alone = false;
        }
        for (const std::int32_t rim : f.rim) {
          if (rim < 0) continue;
          const ContactRim& edge = target.rims[static_cast<std::size_t>(rim)];
          if (edge.region[0] != region && edge.region[1] != region) continue;
          if (segment_segment_squared_distance(from, to, edge.a, edge.b) <= square(rim_reach_m))
            alone = false;
        }
      });
  return inside && alone;
}

}  // namespace takt
