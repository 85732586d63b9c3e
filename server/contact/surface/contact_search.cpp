#include "server/contact/surface/contact_search.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "server/contact/surface/contact_elements.h"

namespace takt {
namespace {

/// Motion after which the search for a lost region is repeated; doubled after each failure.
constexpr double kAgain_m = 2e-4;
/// Bounds of the motion for which lists are made.
constexpr double kLargestBound_m = 1e-3, kSmallestBound_m = 2e-5;
/// Lists are made where they will serve about this many poses, by the path during the last few.
constexpr double kPosesOfLists = 16.0;
constexpr std::uint32_t kLastPoses = 8;
/// Leaves have no more elements.
constexpr std::size_t kLeaf = 64;
/// Centroids higher above a plane than this are far from where it meets another one.
constexpr double kHigh_m = 1e-6;

/// A search for a region costs as much as this many visits without one; where regions do not last, visits
/// between searches double up to a limit.
constexpr std::uint32_t kWorth = 4, kLongestWait = 1U << 14U;
/// Of faces in contact to each other, along a motion beside both, and the faces of the Target after which the
/// inclination has another sign.
constexpr double kInclined = 0.05, kInclinedFaces = 2.5;
/// Rounding of lengths.
constexpr double kSlack_m = 1e-8;

/// Lists are short if the bound is a fraction of the size of the Target's patches and faces.
double first_bound_m(const ContactSurface::Data& target) {
  const double flat_m = std::sqrt(target.surface_area_m2 / static_cast<double>(target.patches.size()));
  const double face_m = std::sqrt(target.surface_area_m2 / static_cast<double>(target.faces.size()));
  return std::clamp(std::min(0.25 * flat_m, face_m), kSmallestBound_m, kLargestBound_m);
}

}  // namespace

/// Planes of a region at the present pose.
struct ContactSearch::Planes {
  Planes(const SeparatingPlanes& of, const ContactCluster& whose, const ContactSurface::Data& target,
         const Pose& X_TB, const Pose& X_BT)
      : region(&of), cluster(&whose) {
    for (std::size_t i = 0; i < of.count; ++i) {
      const ContactPatch& patch = target.patches[static_cast<std::size_t>(of.planes[i])];
      normal_B[i] = X_BT.R * patch.normal;
      offset_m[i] = patch.offset_m - patch.normal.dot(X_TB.p);
    }
  }
  const SeparatingPlanes* region;
  const ContactCluster* cluster;
  std::array<Vec3, SeparatingPlanes::kMaxPlanes> normal_B;
  std::array<double, SeparatingPlanes::kMaxPlanes> offset_m;

  std::size_t count() const { return region->count; }
  /// Height of the lowest corner of the cluster's box.
  double lowest_m(const ContactCluster& c, std::size_t i) const {
    const Vec3& n = normal_B[i];
    return n.dot(c.center_B) - offset_m[i] - (c.axes_B.transpose() * n).cwiseAbs().dot(c.half_m);
  }
};

/// A leaf with elements near the Target.
struct ContactSearch::Open {
  ContactCandidates lists;
  ContactDepths depths;
  double bound_m = 0.0;
  std::uint64_t uses = 0;  ///< of the present lists
  double until_m = -1.0;   ///< travelled length up to which the lists hold
  // Of poses without lists: their number, the travelled length at the first of them.
  std::uint32_t poses = 0;
  double since_m = 0.0;
};

ContactSearch::ContactSearch(const ContactSurface::Data& base, const ContactSurface::Data& target)
    : base_(base),
      target_(target),
      tolerance_(target),
      regions_(base.clusters.size()),
      states_(base.clusters.size()),
      faces_(target),
      first_bound_m_(first_bound_m(target)),
      opened_(base.clusters.size()) {}

ContactSearch::~ContactSearch() = default;

void ContactSearch::forget() {
  for (SeparatingPlanes& region : regions_) region.made = false;
  std::fill(states_.begin(), states_.end(), State{});
  for (auto& open : opened_)
    if (open != nullptr) open->lists.forget(), open->uses = 0, open->until_m = -1.0, open->poses = 0;
}

bool ContactSearch::find(const Pose& X_TB, const Pose& X_BT) {
  travel(X_TB);
  X_TB_ = X_TB;
  X_BT_ = X_BT;
  made_ = false;
  hits_ = 0;
  normals_.clear(), bends_.clear();
  faces_.at(X_TB, X_BT);
  if (!regions_.empty()) visit(0, nullptr);
  return made_;
}

void ContactSearch::travel(const Pose& X_TB) {
  const double reach_m = base_.radius_m + kSlack_m;
  travelled_m_ += std::sqrt(0.5 * (X_TB.R - X_TB_.R).squaredNorm()) * reach_m +
                  (X_TB * base_.box.center_B - X_TB_ * base_.box.center_B).norm();
}

/// True if an element of the cluster may be below a plane.
bool ContactSearch::left(const ContactCluster& cluster, const Planes& planes) const {
  for (std::size_t i = 0; i < planes.count(); ++i)
    if (!(planes.lowest_m(cluster, i) > tolerance_.clear_m)) return true;
  return false;
}

/// Whether a search for a region is worth its time now.
bool ContactSearch::region_pays(State& state) const {
  if (target_.octree.empty()) return true;
  if (state.uses < state.wait) return false;
  const std::uint32_t longer = state.wait == 0 ? kWorth : std::min(2 * state.wait, kLongestWait);
  state.wait = state.uses >= 4 * std::max(state.wait, kWorth) ? kWorth : longer;
  state.uses = 0;
  return true;
}

void ContactSearch::look(std::size_t index, bool leaf) {
  SeparatingPlanes& region = regions_[index];
  find_free_region(target_, base_.clusters[index], X_TB_, leaf, region);
  made_ = true;
  region.again_m = travelled_m_ + region.again_after_m;
  region.until_m = travelled_m_ + region.least_bound_m();
}

void ContactSearch::visit(std::size_t index, const Planes* from) {
  const ContactCluster& cluster = base_.clusters[index];
  State& state = states_[index];
  if (travelled_m_ <= state.quiet_until_m) return;
  const bool leaf = cluster.second < 0;
  const auto go_down = [&](const Planes* planes) {
    visit(index + 1, planes);
    visit(static_cast<std::size_t>(cluster.second), planes);
  };
  if (from != nullptr) {
    if (!left(cluster, *from)) return;
    if (from->region->kind == SeparatingPlanes::Kind::solid) {
      if (!leaf) return go_down(from);
      if (solid_leaf(cluster, *from)) return;
      // The region of the leaf alone may be valid for deeper penetrations.
    }
  }
  SeparatingPlanes& region = regions_[index];
  ++state.uses;
  bool valid = region.made && travelled_m_ <= region.until_m;
  if (!valid) {
    const double used = region.made ? region.used(cluster, X_TB_) : 2.0;
    valid = used <= 1.0;
    if (valid) region.until_m = travelled_m_ + (1.0 - used) * region.least_bound_m();
  }
  if (!valid || region.kind == SeparatingPlanes::Kind::none) {
    const double clear_m = target_.octree.at_least_m(X_TB_ * cluster.center_B) - cluster.radius_m - kSlack_m;
    if (clear_m > 0.0) {
      state.quiet_until_m = travelled_m_ + clear_m;
      return;
    }
    if (!valid) {
      region.made = false;
      valid = region_pays(state);
      if (valid) {
        region.again_after_m = kAgain_m;
        look(index, leaf);
      }
    }
  }
  const auto without = [&] {
    if (leaf)
      open_leaf(index, from);
    else
      go_down(from);
  };
  if (!valid || region.kind == SeparatingPlanes::Kind::none) return without();
  Planes planes(region, cluster, target_, X_TB_, X_BT_);
  if (!left(cluster, planes)) return;
  if (region.kind == SeparatingPlanes::Kind::free && travelled_m_ > region.again_m && region_pays(state)) {
    // The region includes planes that do not bound it at this pose, such as those of a passed chamfer.
    region.again_after_m *= 2.0;
    look(index, leaf);
    if (region.kind == SeparatingPlanes::Kind::none) return without();
    planes = Planes(region, cluster, target_, X_TB_, X_BT_);
    if (!left(cluster, planes)) return;
  }
  if (!leaf)
    go_down(&planes);
  else if (region.kind != SeparatingPlanes::Kind::solid || !solid_leaf(cluster, planes))
    open_leaf(index, &planes);
}

void ContactSearch::make_room(std::size_t count) {
  if (hits_ + count <= elements_.size()) return;
  const std::size_t size = 2 * (hits_ + count) + 64;
  elements_.resize(size), normal_.resize(size), depths_m_.resize(size);
}

// In a solid region the outside of the Target is the convex set above all planes. A centroid's depth below
// its deepest plane is the distance to that set if the projection onto this plane belongs to the set. False
// if the planes alone do not decide.
bool ContactSearch::solid_leaf(const ContactCluster& cluster, const Planes& planes) {
  std::array<std::size_t, SeparatingPlanes::kMaxPlanes> through, beside;
  std::size_t ways = 0, sides = 0;
  for (std::size_t i = 0; i < planes.count(); ++i) {
    const double low_m = planes.lowest_m(cluster, i);
    const bool covered = (planes.region->covered >> i & 1U) != 0;
    if (!(low_m > kHigh_m)) {
      if (!covered && !(low_m > tolerance_.clear_m)) return false;
      if (covered) through[ways++] = i;
    }
    if (low_m <= planes.region->deepest_m + tolerance_.tie_m) beside[sides++] = i;
  }
  if (ways == 0) return true;
  const std::size_t begin = cluster.begin, count = cluster.end - cluster.begin;
  std::array<double, kLeaf> depth;
  std::array<std::uint8_t, kLeaf> way{};
  const auto depths_below = [&](std::size_t plane, double* out) {
    plane_depths(planes.normal_B[plane], planes.offset_m[plane], count, base_.px.data() + begin,
                 base_.py.data() + begin, base_.pz.data() + begin, out);
  };
  depths_below(through[0], depth.data());
  std::array<double, kLeaf> other;
  for (std::size_t w = 1; w < ways; ++w) {
    depths_below(through[w], other.data());
    for (std::size_t k = 0; k < count; ++k) {
      if (!(other[k] > depth[k])) continue;
      depth[k] = other[k];
      way[k] = static_cast<std::uint8_t>(w);
    }
  }
  double deepest_m = 0.0;
  for (std::size_t k = 0; k < count; ++k) deepest_m = std::max(deepest_m, depth[k]);
  if (deepest_m > planes.region->deepest_m) return false;
  if (!(deepest_m > 0.0)) return true;
  if (sides > 1 || ways > 1) {
    for (std::size_t k = 0; k < count; ++k) {
      if (!(depth[k] > 0.0)) continue;
      const std::size_t own = through[way[k]];
      const Vec3 foot = base_.point(begin + k) + depth[k] * planes.normal_B[own];
      for (std::size_t s = 0; s < sides; ++s) {
        const std::size_t i = beside[s];
        if (i != own && planes.normal_B[i].dot(foot) - planes.offset_m[i] < tolerance_.tie_m) return false;
      }
    }
  }
  make_room(count);
  const auto normal = static_cast<std::int32_t>(normals_.size());
  std::size_t hits = hits_;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t e = begin + k;
    elements_[hits] = static_cast<std::int32_t>(e);
    depths_m_[hits] = depth[k];
    normal_[hits] = normal + static_cast<std::int32_t>(way[k]);
    hits += depth[k] > 0.0 ? 1 : 0;
  }
  if (hits > hits_)
    for (std::size_t w = 0; w < ways; ++w) normals_.push_back(planes.normal_B[through[w]]);
  hits_ = hits;
  return true;
}

void ContactSearch::open_leaf(std::size_t index, const Planes* planes) {
  auto& open = opened_[index];
  if (open == nullptr) {
    open = std::make_unique<Open>();
    open->bound_m = first_bound_m_;
  }
  const ContactCluster& cluster = base_.clusters[index];
  if (use_lists(*open, cluster, planes))
    add_from_lists(*open, states_[index]);
  else
    add_from_faces(cluster, states_[index]);
}

/// False where lists would expire too soon.
bool ContactSearch::use_lists(Open& open, const ContactCluster& cluster, const Planes* planes) {
  ContactCandidates& lists = open.lists;
  bool rebuild = false;
  if (!(travelled_m_ <= open.until_m)) {
    rebuild = !lists.cover(X_TB_);
    if (rebuild && !target_.octree.empty()) {
      if (open.poses == 0) open.since_m = travelled_m_;
      if (++open.poses <= kLastPoses) return false;
      const bool slow = kPosesOfLists * (travelled_m_ - open.since_m) < kLastPoses * open.bound_m;
      open.poses = 0;
      if (!slow) return false;
    }
    open.until_m = travelled_m_ + lists.bound_m() - lists.moved_m(X_TB_);
  }
  if (rebuild) {
    if (open.uses > 0 && open.uses < 32 && target_.octree.empty())
      open.bound_m = std::min(2.0 * open.bound_m, kLargestBound_m);
  } else if (++open.uses % 256 == 0 && open.bound_m > kSmallestBound_m &&
             lists.slot_count() > 2 * open.depths.hits().size() + 4) {
    open.bound_m = std::max(0.5 * open.bound_m, kSmallestBound_m);
    rebuild = true;
  }
  if (!rebuild) return true;
  // The set above all planes is outside while the region is valid.
  std::span<const std::int32_t> above;
  if (planes != nullptr &&
      open.bound_m < (1.0 - planes->region->used(*planes->cluster, X_TB_)) * planes->region->least_bound_m())
    above = planes->region->all();
  lists.rebuild(base_, target_, cluster, X_TB_, open.bound_m, above, work_);
  open.depths.prepare(lists);
  open.uses = 1;
  open.until_m = travelled_m_ + lists.bound_m();
  made_ = true;
  return true;
}

void ContactSearch::add_from_lists(Open& open, State& state) {
  const ContactCandidates& lists = open.lists;
  open.depths.find(base_, target_, lists, X_TB_, X_BT_, travelled_m_);
  if (open.depths.hits().empty()) {
    const double quiet_m = std::min(0.999 * open.depths.quiet_m(), lists.bound_m() - lists.moved_m(X_TB_));
    if (quiet_m > 0.0) state.quiet_until_m = travelled_m_ + quiet_m;
    return;
  }
  make_room(open.depths.hits().size());
  for (const std::int32_t hit : open.depths.hits()) {
    const auto slot = static_cast<std::size_t>(hit);
    elements_[hits_] = lists.element[slot];
    depths_m_[hits_] = open.depths.depth_m(slot);
    normal_[hits_] = static_cast<std::int32_t>(normals_.size());
    normals_.push_back(open.depths.normal_B(slot));
    if (const ContactDepths::Bend* bend = open.depths.bend(slot)) bends_.push_back({hits_, bend->edge_B});
    ++hits_;
  }
}

void ContactSearch::add_from_faces(const ContactCluster& cluster, State& state) {
  const std::size_t count = cluster.end - cluster.begin, first = hits_;
  make_room(count);
  std::array<Vec3, kLeaf> points;
  std::array<FaceDepths::Depth, kLeaf> depths;
  for (std::size_t i = 0; i < count; ++i) points[i] = base_.point(cluster.begin + i);
  faces_.find({points.data(), count}, {depths.data(), count});
  double quiet_m = INFINITY;
  for (std::size_t i = 0; i < count; ++i) {
    const FaceDepths::Depth& found = depths[i];
    quiet_m = std::min(quiet_m, found.clear_m);
    if (!(found.depth_m > 0.0)) continue;
    elements_[hits_] = static_cast<std::int32_t>(cluster.begin + i);
    depths_m_[hits_] = found.depth_m;
    normal_[hits_] = static_cast<std::int32_t>(normals_.size());
    normals_.push_back(found.normal_B);
    if (found.bend) bends_.push_back({hits_, found.edge_B});
    ++hits_;
  }
  if (hits_ == first && quiet_m > kSlack_m) state.quiet_until_m = travelled_m_ + 0.999 * quiet_m - kSlack_m;
}

void ContactSearch::find(const HeldMotion& motion, HeldPatch& patch) const {
  patch.clear();
  if (base_.clusters.empty()) return;
  HeldPath path;
  for (std::size_t i = 0; i <= motion.pieces; ++i)
    path.X_TB[i] = motion.pose(static_cast<double>(i) * motion.piece_s, base_.box.center_B);
  const Mat3 R_BT = motion.X_TB.R.transpose();
  path.way_B.w = motion.horizon_s * (R_BT * motion.w_T);
  path.way_B.v = motion.horizon_s * (R_BT * motion.v_T) - path.way_B.w.cross(base_.box.center_B);
  path.pieces = motion.pieces;
  path.least_pieces = motion.least_pieces;
  path.margin_m = motion.margin_m;
  path.most_inclined_m = kInclinedFaces * target_.face_size_m();
  visit(0, path, patch);
}

void ContactSearch::visit(std::size_t index, HeldPath& path, HeldPatch& patch) const {
  const ContactCluster& cluster = base_.clusters[index];
  const Pose& X_TB = path.X_TB.front();
  // Surfaces that touch face each other: an element comes closer along its own normal, and by what the Target's
  // faces are inclined to it.
  const auto reach_m = [&path](double closer_m, double way_m) {
    return path.margin_m + std::max(0.0, closer_m) + kInclined * std::min(way_m, path.most_inclined_m);
  };
  const Vec3 way_of_center_B = path.way_B.at(cluster.center_B);
  const double differs_m = path.way_B.w.norm() * cluster.radius_m;
  const double longest_m = way_of_center_B.norm() + differs_m;
  const double cone_sin = std::sqrt(std::max(0.0, 1.0 - cluster.cone_cos * cluster.cone_cos));
  const double closer_m = cluster.cone_cos > 0.0
                              ? way_of_center_B.dot(cluster.axes_B.col(2)) + way_of_center_B.norm() * cone_sin
                              : way_of_center_B.norm();
  const double clear_m = target_.octree.at_least_m(X_TB * cluster.center_B) - cluster.radius_m;
  if (clear_m > reach_m(closer_m + differs_m, longest_m)) return;
  if (cluster.second >= 0) {
    visit(index + 1, path, patch);
    return visit(static_cast<std::size_t>(cluster.second), path, patch);
  }
  const std::size_t count = cluster.end - cluster.begin;
  std::array<ElementPath, kLeaf> elements;
  std::array<NearFace, kLeaf> faces;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t e = cluster.begin + i;
    elements[i].p_B = base_.point(e);
    const Vec3 way_B = path.way_B.at(elements[i].p_B);
    elements[i].reach_m = reach_m(way_B.dot(base_.normal(e)), way_B.norm());
  }
  find_nearest(target_, X_TB, {elements.data(), count}, path.margin_m, {faces.data(), count});
  FaceStrip strip;
  for (std::size_t i = 0; i < count; ++i) {
    if (faces[i].face < 0) continue;
    const std::size_t e = cluster.begin + i;
    Vec3 x_T = X_TB * elements[i].p_B;
    for (std::size_t piece = 0; piece < path.pieces; ++piece) {
      const Vec3 next_T = path.X_TB[piece + 1] * elements[i].p_B;
      follow_path(target_, x_T, next_T - x_T, path.margin_m, faces[i].face, strip);
      if (strip.least_m <= path.margin_m) {
        // Faces that are followed from afar need not be the closest ones.
        if (faces[i].apart && piece > 0) {
          elements[i].reach_m = (next_T - x_T).norm() + path.margin_m;
          find_nearest(target_, path.X_TB[piece], {&elements[i], 1}, path.margin_m, {&faces[i], 1});
          if (faces[i].face < 0) break;
          follow_path(target_, x_T, next_T - x_T, path.margin_m, faces[i].face, strip);
        }
        if (strip.least_m <= path.margin_m)
          patch.add(piece, static_cast<std::int32_t>(e), elements[i].p_B, base_.area_m2[e], strip);
      }
      if (strip.least_m < -path.margin_m)
        path.pieces = std::min(path.pieces, std::max(piece, path.least_pieces));
      x_T = next_T;
    }
  }
}

}  // namespace takt
