#include "server/contact/surface/separating_planes.h"

#include <algorithm>
#include <cmath>

namespace takt {
namespace {

constexpr std::array<double, 4> kBounds_m{4e-3, 1e-3, 2.5e-4, 6e-5};
/// Planes that the cluster is deeper below than this are of no use to it, if the region need not be solid.
constexpr double kWorth_m = 1e-4;
constexpr double kNear_m = 3e-4;
/// Deepest penetration for which a solid region is valid: where the Target is thick, and everywhere.
constexpr double kDeep_m = 2e-3, kDeepest_m = 5e-4;
/// Number of single pieces tested until the search fails: parts of the cluster need fewer.
constexpr int kPatience = 150, kStrangers = 30;

class Search {
 public:
  Search(const ContactSurface::Data& target, const ContactCluster& cluster, const Pose& X_TB,
         SeparatingPlanes& region)
      : target_(target),
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

  /// True if an omitted plane prevents a region that is valid for deeper penetrations.
  bool deeper() const { return deeper_; }
  /// The last one failed for too many faces: less would not do either.
  bool crowded() const { return crowded_; }
  /// Sets the depth for which the regions of further searches must be valid.
  void set_depth(double deepest_m) { region_.deepest_m = deepest_m_ = deepest_m; }

  /// Begins with the planes of the region, which were good for a narrower bound.
  bool free(const Vec3& bound_m, bool solid) {
    region_.bound_m = bound_m;
    worth_m_ = solid ? deepest_m_ : kWorth_m;
    crowded_ = false;
    // The nearest faces first: their planes cover most of the others.
    bool full = false, left = false;
    if (region_.count == 0 && bound_m.maxCoeff() > kNear_m) {
      reach(bound_m.cwiseMin(kNear_m));
      if (!add_planes(full, left)) return false;
    }
    left = false;
    // The closest point may be anywhere around.
    reach(bound_m + Vec3::Constant(deepest_m_));
    if (!add_planes(full, left) || full) {
      crowded_ = true;
      return false;
    }
    if (left && !all_below()) return false;
    return outside();
  }

  bool solid() {
    if (region_.count == 0) return false;
    int looked = 0;
    const auto enter = [&](const BodyBox& box, std::int32_t label) {
      if (!touches(box, abs_half_) || hidden(box)) return false;
      return !(has(label) && above_others(box, label));
    };
    region_.covered = 0;
    for (std::size_t i = 0; i < region_.count; ++i)
      if (covered(region_.planes[i])) region_.covered |= 1U << i;
    return region_.covered != 0 && target_.piece_tree.walk(enter, [&](std::int32_t index) {
      const ContactPiece& piece = target_.pieces[static_cast<std::size_t>(index)];
      if (beside(piece.corner)) return true;
      if (++looked > kPatience) return false;
      const bool own = has(piece.patch);
      return all_of(piece, looked, [&](const Corners& corners) {
        return (own && above_others(corners, piece.patch)) || below(corners, 2.0 * deepest_m_);
      });
    });
  }

 private:
  static constexpr int kRounds = 20;
  using Corners = std::array<Vec3, 4>;

  const ContactPatch& plane(std::int32_t patch) const {
    return target_.patches[static_cast<std::size_t>(patch)];
  }
  bool has(std::int32_t patch) const {
    const auto all = region_.all();
    return patch >= 0 && std::find(all.begin(), all.end(), patch) != all.end();
  }
  /// Sets how far the box of the cluster is grown.
  void reach(const Vec3& by_m) {
    half_ = cluster_.half_m + by_m;
    abs_half_ = abs_axes_ * half_;
  }
  bool touches(const BodyBox& box, const Vec3& half) const {
    for (int k = 0; k < 3; ++k)
      if (std::abs(box.center_B[k] - center_[k]) > box.half_B[k] + half[k]) return false;
    return true;
  }
  /// The piece is beyond one side of the grown box.
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
  bool hidden(const BodyBox& box) const { return below(box, 2.0 * deepest_m_); }
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

  /// Whether a predicate holds for the piece, or else for each of its faces within reach.
  template <typename Holds>
  bool all_of(const ContactPiece& piece, int& looked, const Holds& holds) const {
    if (holds(piece.corner)) return true;
    for (std::uint32_t i = piece.begin; i < piece.end; ++i) {
      const ContactFace& face = target_.faces[static_cast<std::size_t>(target_.piece_faces[i])];
      const auto c = target_.corners(face);
      const Corners corners{c[0], c[1], c[2], c[2]};
      if (beside(corners)) continue;
      if (++looked > kPatience || !holds(corners)) return false;
    }
    return true;
  }

  /// Adds planes of near faces with the cluster above them. `left`: other faces remain.
  bool add_planes(bool& full, bool& left) {
    int looked = 0, strangers = 0;
    const auto enter = [&](const BodyBox& box, std::int32_t label) {
      return touches(box, abs_half_) && !has(label) && !below(box, -tolerance_.flat_m);
    };
    return target_.piece_tree.walk(enter, [&](std::int32_t index) {
      const ContactPiece& piece = target_.pieces[static_cast<std::size_t>(index)];
      if (has(piece.patch) || beside(piece.corner) || below(piece.corner, -tolerance_.flat_m)) return true;
      if (++looked > kPatience) return false;
      const ContactPatch& p = plane(piece.patch);
      const double reach_m = (axes_.transpose() * p.normal).cwiseAbs().dot(cluster_.half_m);
      if (p.normal.dot(center_) - p.offset_m - reach_m < -worth_m_) {
        left = true;
        deeper_ = deeper_ || p.normal.dot(center_) - p.offset_m - reach_m >= -kDeep_m;
        return ++strangers <= kStrangers;
      } else if (region_.count == SeparatingPlanes::kMaxPlanes) {
        full = true;
        return false;
      } else {
        region_.planes[region_.count++] = piece.patch;
      }
      return true;
    });
  }

  bool all_below() const {
    const auto enter = [&](const BodyBox& box, std::int32_t label) {
      return touches(box, abs_half_) && !has(label) && !below(box, -tolerance_.flat_m);
    };
    int looked = 0;
    return target_.piece_tree.walk(enter, [&](std::int32_t index) {
      const ContactPiece& piece = target_.pieces[static_cast<std::size_t>(index)];
      if (has(piece.patch) || beside(piece.corner)) return true;
      return ++looked <= kPatience && all_of(piece, looked, [&](const Corners& corners) {
        return below(corners, -tolerance_.flat_m);
      });
    });
  }

  /// Moves y above all planes, onto `on` if that is one, and keeps it within reach. False: not found.
  bool above_all(std::int32_t on, Vec3& y, int rounds) const {
    const double above_m = 4.0 * tolerance_.clear_m;
    for (int i = 0; i < rounds; ++i) {
      bool good = true;
      for (const std::int32_t patch : region_.all()) {
        const ContactPatch& p = plane(patch);
        const double height = p.normal.dot(y) - p.offset_m;
        if (patch == on) {
          good = good && std::abs(height) < 1e-10;
          y -= height * p.normal;
        } else if (height < above_m) {
          good = false;
          y += (1.5 * above_m - height) * p.normal;
        }
      }
      for (int k = 0; k < 3; ++k) {
        const Vec3 axis = axes_.col(k);
        const double x = axis.dot(y - center_), room_m = half_[k] - above_m;
        if (std::abs(x) <= half_[k]) continue;
        good = false;
        y += (std::copysign(room_m, x) - x) * axis;
      }
      if (good) return true;
    }
    return false;
  }
  /// Whether a point above all planes, within reach, is outside of the Target.
  bool outside() {
    // A point from a narrower reach is valid too.
    if (known_ && above_all(-1, outside_, 1)) return true;
    outside_ = center_;
    known_ = above_all(-1, outside_, kRounds) && target_.signed_distance_m(outside_) > 0.0;
    deeper_ = deeper_ || (!known_ && region_.count == 0);
    return known_;
  }
  /// Whether the patch covers the facet that its plane contributes to the set above all planes. The edges of
  /// the faces are then below one of the other planes, so that one point decides for all.
  bool covered(std::int32_t patch) const {
    Vec3 y = center_;
    if (!above_all(patch, y, kRounds)) return false;
    bool there = false;
    target_.face_tree.visit_segment(y, y, 1e-8, [&](std::int32_t index) {
      const ContactFace& face = target_.faces[static_cast<std::size_t>(index)];
      bool inside = !there && face.patch == patch;
      for (std::size_t k = 0; inside && k < 3; ++k)
        inside = face.inward[k].dot(y) + face.shift_m[k] >= -kEdgeWidth_m;
      there = there || inside;
    });
    return there;
  }

  const ContactSurface::Data& target_;
  const ContactCluster& cluster_;
  SeparatingPlanes& region_;
  PlaneTolerance tolerance_;
  Vec3 center_;
  Mat3 axes_, abs_axes_;
  double deepest_m_ = kDeepest_m, worth_m_ = kWorth_m;
  bool deeper_ = false, crowded_ = false;
  Vec3 half_ = Vec3::Zero(), abs_half_ = Vec3::Zero();
  Vec3 outside_ = Vec3::Zero();
  bool known_ = false;
};

}  // namespace

double SeparatingPlanes::used(const ContactCluster& cluster, const Pose& pose) const {
  // See ContactCandidates::cover.
  const double turn = std::sqrt(0.5 * (pose.R - X_TB.R).squaredNorm()) * cluster.radius_m;
  const Vec3 shift = cluster.axes_B.transpose() * (X_TB.R.transpose() * (pose * cluster.center_B - center_T));
  return std::max({(turn + std::abs(shift[0])) / bound_m[0], (turn + std::abs(shift[1])) / bound_m[1],
                   (turn + std::abs(shift[2])) / bound_m[2]});
}

void find_free_region(const ContactSurface::Data& target, const ContactCluster& cluster, const Pose& X_TB,
                      bool solid, SeparatingPlanes& region) {
  const SeparatingPlanes::Kind last = region.kind;
  const Vec3 last_bound_m = region.bound_m;
  Search search(target, cluster, X_TB, region);
  // Regions of large clusters with small bounds would be searched too often; those of their parts last
  // longer.
  const double least_m = 0.05 * cluster.radius_m;
  using Kind = SeparatingPlanes::Kind;
  const auto good = [&](const Vec3& bound_m, bool need_solid) {
    return search.free(bound_m, need_solid) && (!need_solid || search.solid());
  };
  const auto widest = [&](bool need_solid) {
    // Starts with the width of the last region, of which the new one is often the continuation.
    if (last == (need_solid ? Kind::solid : Kind::free)) {
      region.count = 0;
      if (good(last_bound_m, need_solid)) {
        SeparatingPlanes best = region;
        for (int k = 0; k < 3; ++k) {
          Vec3 wider = best.bound_m;
          wider[k] = std::min(4.0 * wider[k], kBounds_m.front());
          if (wider == best.bound_m) continue;
          if (good(wider, need_solid))
            best = region;
          else
            region = best;
        }
        return true;
      }
    }
    // Most clusters without a region fail at the narrowest width, which is a cheap test.
    region.count = 0;
    double narrowest_m = 0.0;
    for (const double bound_m : kBounds_m)
      if (bound_m >= least_m) narrowest_m = bound_m;
    if (narrowest_m == 0.0 || !good(Vec3::Constant(narrowest_m), need_solid)) return false;
    SeparatingPlanes best = region;
    const auto better = [&](const Vec3& bound_m) {
      if (good(bound_m, need_solid))
        best = region;
      else
        region = best;
      return region.bound_m == bound_m;
    };
    for (const double wider_m : kBounds_m)
      if (wider_m <= narrowest_m || better(Vec3::Constant(wider_m))) break;
    // Further in the directions in which the surface is straight.
    for (int k = 0; k < 3; ++k)
      for (const double wider_m : kBounds_m) {
        Vec3 wider = best.bound_m;
        if (wider_m <= wider[k]) break;
        wider[k] = wider_m;
        if (better(wider)) break;
      }
    return true;
  };
  search.set_depth(kDeepest_m);
  bool found = solid && widest(true);
  const bool hopeless = solid && !found && search.crowded();
  if (solid && !found && !hopeless && search.deeper()) {
    search.set_depth(kDeep_m);
    found = widest(true);
    if (!found) search.set_depth(kDeepest_m);
  }
  if (found) {
    region.kind = Kind::solid;
  } else if (!hopeless && widest(false)) {
    region.kind = !solid && good(region.bound_m, true) ? Kind::solid : Kind::free;
  } else {
    region.kind = Kind::none;
    region.count = 0;
    region.bound_m.setConstant(std::clamp(0.5 * cluster.radius_m, 2e-4, 4e-3));
  }
  if (region.kind == Kind::solid && region.deepest_m < kDeep_m) {
    const SeparatingPlanes shallow = region;
    search.set_depth(kDeep_m);
    if (!good(region.bound_m, true)) region = shallow;
  }
}

}  // namespace takt
