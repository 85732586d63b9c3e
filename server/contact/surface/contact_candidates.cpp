#include "server/contact/surface/contact_candidates.h"

#include <algorithm>
#include <cmath>

namespace takt {
namespace {

/// Rounding; far above it, far below any bound.
constexpr double kSlack_m = 1e-8;

double square(double x) {
  return x * x;
}

}  // namespace

struct ContactCandidates::Build {
  const ContactSurface::Data& base;
  const ContactSurface::Data& target;
  const Pose& X_TB;
  double bound_m;  ///< with slack
  Work& work;
  // The last point of which the distance is known: its neighbours are nearer to the surface by no more than they are
  // apart, and begin their walk at its closest face.
  Vec3 known_T = Vec3::Zero();
  double known_m = -INFINITY;
  NearestFace nearest{};

  double signed_distance_m(const Vec3& x) {
    known_T = x;
    return known_m = target.signed_distance_m(x, nearest);
  }
  bool is_apart(const Vec3& x) const { return known_m - (x - known_T).norm() > bound_m + kSlack_m; }
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
  bound_m_ = bound_m;
  reach_m_ = cluster.radius_m + kSlack_m;
  center_B_ = cluster.center_B;
  center_T_ = X_TB * center_B_;
  X_TB_ = X_TB;
  element.clear(), patches.clear(), plane_groups.clear(), plane_slot.clear();
  px.clear(), py.clear(), pz.clear();
  singles.clear(), near.clear();
  // One allocation each where a cluster needs lists for the first time.
  const std::size_t size = cluster.end - cluster.begin;
  element.reserve(size), plane_slot.reserve(size), singles.reserve(size), near.reserve(8 * size);
  px.reserve(size), py.reserve(size), pz.reserve(size), patches.reserve(size), plane_groups.reserve(size);
  work.simple_.clear();
  work.local_.resize(target.patches.size(), -1);
  Build build{base, target, X_TB_, bound_m_ + kSlack_m, work};
  const double clear_m =
      target.octree.empty() ? build.signed_distance_m(center_T_) : target.octree.at_least_m(center_T_);
  if (clear_m <= reach_m_ + build.bound_m) {
    for (std::uint32_t e = cluster.begin; e < cluster.end; ++e) {
      const Vec3 p = X_TB * base.point(e);
      bool may = above.empty();
      for (const std::int32_t patch : above) {
        const ContactPatch& plane = target.patches[static_cast<std::size_t>(patch)];
        may = may || plane.normal.dot(p) - plane.offset_m <= build.bound_m;
      }
      if (may) add_element(build, static_cast<std::int32_t>(e));
    }
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

void ContactCandidates::add_element(Build& build, std::int32_t index) {
  const ContactSurface::Data& target = build.target;
  const auto e = static_cast<std::size_t>(index);
  const Vec3 p = build.X_TB * build.base.point(e);
  for (int k = 0; k < 3; ++k)
    if (std::abs(p[k] - target.box.center_B[k]) > target.box.half_B[k] + build.bound_m) return;

  if (build.is_apart(p) || target.octree.at_least_m(p) > build.bound_m) return;
  // All faces within the bound; without any, the sign of the closest one gives the side.
  const double signed_m = build.signed_distance_m(p);
  if (signed_m > build.bound_m) return;
  // Later the depth is at most deepest_m, and p has moved by the bound.
  const double deepest_m = build.bound_m - signed_m;
  double reach2 = square(deepest_m + build.bound_m);
  auto& found = build.work.found_;
  found.clear();
  target.face_tree.visit_near(p, reach2, [&](std::int32_t face) {
    const double squared = target.closest_on_face(target.faces[static_cast<std::size_t>(face)], p).squared_m2;
    if (squared <= reach2) found.push_back({std::sqrt(squared), face});
  });
  const auto slot = static_cast<std::int32_t>(element.size());
  element.push_back(index);
  // If all are of one patch the closest point stays inside of it, and the sign of its plane distance gives
  // the side.
  const auto patch_of = [&](const Work::Found& f) {
    return target.faces[static_cast<std::size_t>(f.face)].patch;
  };
  const std::int32_t patch = patch_of(found.front());
  if (std::all_of(found.begin(), found.end(), [&](const auto& f) { return patch_of(f) == patch; })) {
    build.work.simple_.push_back({local_patch(build, patch), slot});
    return;
  }
  std::sort(found.begin(), found.end(), [](const Work::Found& a, const Work::Found& b) {
    return a.distance_m != b.distance_m ? a.distance_m < b.distance_m : a.face < b.face;
  });
  Single single{slot, near.size(), near.size()};
  for (const Work::Found& f : found)
    near.push_back({f.face, local_patch(build, patch_of(f)), f.distance_m - kSlack_m});
  single.end = near.size();
  singles.push_back(single);
}

}  // namespace takt
