#include "server/contact/free_region.h"

#include <algorithm>
#include <cmath>

namespace takt {
namespace {

constexpr std::array<double, 4> kBounds_m{4e-3, 1e-3, 2.5e-4, 6e-5};
/// Planes that the cluster is deeper below than this are of no use to it.
constexpr double kWorth_m = 1e-4;
/// Faces looked at singly before the search is given up: parts of the cluster need less.
constexpr int kPatience = 600;

class Search {
 public:
  Search(const ContactSurface::Data& base, const ContactSurface::Data& target, const ContactCluster& cluster,
         const Pose& X_TB, FreeRegion& region)
      : base_(base),
        target_(target),
        cluster_(cluster),
        region_(region),
        tolerance_(target),
        center_(X_TB * cluster.center_B),
        axes_(X_TB.R * cluster.axes_B),
        abs_axes_(axes_.cwiseAbs()) {
    region.X_TB = X_TB;
    region.center_T = center_;
    region.made = true;
  }

  bool free(double bound_m) {
    region_.count = 0;
    region_.bound_m = bound_m;
    // The nearest faces first: their planes hide most of the others.
    bool full = false, left = false;
    reach(std::min(bound_m, 3e-4));
    if (bound_m > 3e-4 && !add_planes(full, left)) return false;
    left = false;
    reach(bound_m + kDeepest_m);
    if (!add_planes(full, left) || full) return false;
    if (left && !all_below()) return false;
    return outside();
  }

  bool solid() const {
    if (region_.count == 0) return false;
    if (!target_.rims.empty()) {
      const Vec3 half = abs_half_ + Vec3::Constant(base_.largest_fade_m + kDeepest_m);
      const auto enter = [&](const BodyBox& box, std::int32_t) { return touches(box, half); };
      if (!target_.rim_tree.walk(enter, [](std::int32_t) { return false; })) return false;
    }
    int looked = 0;
    const auto enter = [&](const BodyBox& box, std::int32_t label) {
      if (!touches(box, abs_half_) || hidden(box)) return false;
      return !(has(label) && above_others(box, label));
    };
    return target_.face_tree.walk(enter, [&](std::int32_t index) {
      const ContactFace& face = target_.faces[static_cast<std::size_t>(index)];
      const auto corners = target_.corners(face);
      if (beside(corners)) return true;
      if (++looked > kPatience) return false;
      if (has(face.patch) && above_others(corners, face.patch)) return true;
      return below(corners, 2.0 * kDeepest_m);
    });
  }

 private:
  using Corners = std::array<Vec3, 3>;

  const ContactPatch& plane(std::int32_t patch) const {
    return target_.patches[static_cast<std::size_t>(patch)];
  }
  bool has(std::int32_t patch) const {
    const auto all = region_.all();
    return patch >= 0 && std::find(all.begin(), all.end(), patch) != all.end();
  }
  /// Sets how far the box of the cluster is grown.
  void reach(double by_m) {
    half_ = cluster_.half_m + Vec3::Constant(by_m);
    abs_half_ = abs_axes_ * half_;
  }
  bool touches(const BodyBox& box, const Vec3& half) const {
    for (int k = 0; k < 3; ++k)
      if (std::abs(box.center_B[k] - center_[k]) > box.half_B[k] + half[k]) return false;
    return true;
  }
  /// The face is beyond one side of the grown box.
  bool beside(const Corners& corners) const {
    for (int k = 0; k < 3; ++k) {
      const Vec3 axis = axes_.col(k);
      double least = INFINITY, most = -INFINITY;
      for (const Vec3& c : corners) {
        const double x = axis.dot(c - center_);
        least = std::min(least, x), most = std::max(most, x);
      }
      if (least > half_[k] || most < -half_[k]) return true;
    }
    return false;
  }
  bool below(const Corners& corners, double by_m) const {
    for (const std::int32_t patch : region_.all()) {
      const ContactPatch& p = plane(patch);
      double most = -INFINITY;
      for (const Vec3& c : corners) most = std::max(most, p.normal.dot(c) - p.offset_m);
      if (most <= -by_m) return true;
    }
    return false;
  }
  bool below(const BodyBox& box, double by_m) const {
    for (const std::int32_t patch : region_.all()) {
      const ContactPatch& p = plane(patch);
      if (p.normal.dot(box.center_B) - p.offset_m + p.normal.cwiseAbs().dot(box.half_B) <= -by_m) return true;
    }
    return false;
  }
  bool hidden(const BodyBox& box) const { return below(box, 2.0 * kDeepest_m); }
  bool above_others(const Corners& corners, std::int32_t own) const {
    for (const std::int32_t patch : region_.all()) {
      if (patch == own) continue;
      const ContactPatch& p = plane(patch);
      for (const Vec3& c : corners)
        if (p.normal.dot(c) - p.offset_m < -tolerance_.flat_m) return false;
    }
    return true;
  }
  bool above_others(const BodyBox& box, std::int32_t own) const {
    for (const std::int32_t patch : region_.all()) {
      if (patch == own) continue;
      const ContactPatch& p = plane(patch);
      if (p.normal.dot(box.center_B) - p.offset_m - p.normal.cwiseAbs().dot(box.half_B) < -tolerance_.flat_m)
        return false;
    }
    return true;
  }

  /// Planes of faces near that the cluster is above. `left`: there are others.
  bool add_planes(bool& full, bool& left) {
    int looked = 0;
    const auto enter = [&](const BodyBox& box, std::int32_t label) {
      return touches(box, abs_half_) && !has(label) && !below(box, -tolerance_.flat_m);
    };
    return target_.face_tree.walk(enter, [&](std::int32_t index) {
      const ContactFace& face = target_.faces[static_cast<std::size_t>(index)];
      const auto corners = target_.corners(face);
      if (beside(corners) || below(corners, -tolerance_.flat_m)) return true;
      if (++looked > kPatience) return false;
      const ContactPatch& p = plane(face.patch);
      const double reach_m = (axes_.transpose() * p.normal).cwiseAbs().dot(cluster_.half_m);
      if (p.normal.dot(center_) - p.offset_m - reach_m < -kWorth_m) {
        left = true;
      } else if (region_.count == FreeRegion::kMaxPlanes) {
        full = true;
        return false;
      } else {
        region_.planes[region_.count++] = face.patch;
      }
      return true;
    });
  }

  bool all_below() const {
    const auto enter = [&](const BodyBox& box, std::int32_t label) {
      return touches(box, abs_half_) && !has(label) && !below(box, -tolerance_.flat_m);
    };
    int looked = 0;
    return target_.face_tree.walk(enter, [&](std::int32_t index) {
      const auto corners = target_.corners(target_.faces[static_cast<std::size_t>(index)]);
      return ++looked <= kPatience && (beside(corners) || below(corners, -tolerance_.flat_m));
    });
  }

  /// Whether a point above all planes, within reach, is outside of the Target.
  bool outside() const {
    Vec3 y = center_;
    const double above_m = 2.0 * tolerance_.clear_m;
    bool good = false;
    for (int i = 0; i < 8 && !good; ++i) {
      good = true;
      for (const std::int32_t patch : region_.all()) {
        const ContactPatch& p = plane(patch);
        const double height = p.normal.dot(y) - p.offset_m;
        if (height >= above_m) continue;
        good = false;
        y += (1.5 * above_m - height) * p.normal;
      }
    }
    if (!good) return false;
    for (int k = 0; k < 3; ++k)
      if (std::abs(axes_.col(k).dot(y - center_)) > half_[k]) return false;
    return beyond_surface(y);
  }

  bool beyond_surface(const Vec3& y) const {
    for (int k = 0; k < 3; ++k)
      if (std::abs(y[k] - target_.box.center_B[k]) > target_.box.half_B[k]) return true;
    // Directions that are along nothing in particular; the first surface met tells the side, if met squarely.
    const std::array<Vec3, 3> directions{Vec3(0.31, 0.53, 0.79), Vec3(-0.67, 0.29, -0.68),
                                         Vec3(0.23, -0.89, 0.39)};
    for (const Vec3& direction : directions) {
      const Vec3 d = direction.normalized();
      double nearest = 4.0 * target_.radius_m;
      const double all_m = nearest;
      bool sure = true, out = true;
      target_.face_tree.visit_segment(y, y + all_m * d, 1e-8, [&](std::int32_t index) {
        const ContactFace& face = target_.faces[static_cast<std::size_t>(index)];
        const ContactPatch& p = plane(face.patch);
        const double along = p.normal.dot(d);
        if (std::abs(along) < 1e-12) return;
        const double t = (p.offset_m - p.normal.dot(y)) / along;
        if (!(t > -1e-9 && t <= nearest + 1e-9)) return;
        const Vec3 x = y + t * d;
        double margin = INFINITY;
        for (std::size_t k = 0; k < 3; ++k)
          margin = std::min(margin, face.inward[k].dot(x) + face.shift_m[k]);
        if (margin < -1e-8) return;
        // Inside a patch it does not matter which face it is.
        bool edge = margin < 1e-8;
        if (edge) {
          edge = false;
          for (std::size_t k = 0; k < 3; ++k)
            edge = edge || (face.inward[k].dot(x) + face.shift_m[k] < 1e-8 &&
                            target_.faces[static_cast<std::size_t>(face.neighbour[k])].patch != face.patch);
        }
        const bool squarely = !edge && std::abs(along) > 0.01 && t > 1e-9;
        if (t > nearest - 1e-8 && nearest < all_m) {
          // About as far as the other one: they must agree.
          sure = sure && squarely && out == (along < 0.0);
          nearest = std::min(nearest, t);
        } else {
          sure = squarely;
          out = along < 0.0;
          nearest = t;
        }
      });
      if (sure) return out;
    }
    return false;
  }

  const ContactSurface::Data& base_;
  const ContactSurface::Data& target_;
  const ContactCluster& cluster_;
  FreeRegion& region_;
  PlaneTolerance tolerance_;
  Vec3 center_;
  Mat3 axes_, abs_axes_;
  Vec3 half_ = Vec3::Zero(), abs_half_ = Vec3::Zero();
};

}  // namespace

double FreeRegion::used(const ContactCluster& cluster, const Pose& pose) const {
  // See ContactCandidates::cover.
  const double turn = std::sqrt(0.5 * (pose.R - X_TB.R).squaredNorm()) * cluster.radius_m;
  return (turn + (pose * cluster.center_B - center_T).norm()) / bound_m;
}

void find_free_region(const ContactSurface::Data& base, const ContactSurface::Data& target,
                      const ContactCluster& cluster, const Pose& X_TB, bool solid, FreeRegion& region) {
  Search search(base, target, cluster, X_TB, region);
  // Regions of large clusters with small bounds are looked for too often; those of their parts hold longer.
  const double least_m = 0.05 * cluster.radius_m;
  if (solid)
    for (const double bound_m : kBounds_m)
      if (bound_m >= least_m && search.free(bound_m) && search.solid()) {
        region.kind = FreeRegion::Kind::solid;
        return;
      }
  for (const double bound_m : kBounds_m)
    if (bound_m >= least_m && search.free(bound_m)) {
      region.kind = !solid && search.solid() ? FreeRegion::Kind::solid : FreeRegion::Kind::free;
      return;
    }
  region.kind = FreeRegion::Kind::none;
  region.count = 0;
  region.bound_m = std::clamp(0.25 * cluster.radius_m, 1e-4, 2e-3);
}

}  // namespace takt
