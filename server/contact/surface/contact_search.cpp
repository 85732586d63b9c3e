#include "server/contact/surface/contact_search.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "server/contact/surface/contact_elements.h"

namespace takt {
namespace {

constexpr double kLargestBound_m = 1e-3, kSmallestBound_m = 2e-5;
/// Motion after which the search for a lost region is repeated; doubled after each failure.
constexpr double kAgain_m = 2e-4;
/// Leaves have no more elements.
constexpr std::size_t kLeaf = 64;
/// Centroids higher above a plane than this are far from where it meets another one.
constexpr double kHigh_m = 1e-6;

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

struct ContactSearch::Open {
  ContactCandidates lists;
  ContactDepths depths;
  double bound_m = 0.0;
  std::uint64_t uses = 0;  ///< of the present lists
  // Travelled length up to which the lists hold, and up to which no element is in contact.
  double until_m = -1.0, quiet_until_m = -1.0;
};

ContactSearch::ContactSearch(const ContactSurface::Data& base, const ContactSurface::Data& target)
    : base_(base),
      target_(target),
      tolerance_(target),
      first_bound_m_(first_bound_m(target)),
      regions_(base.clusters.size()),
      opened_(base.clusters.size()) {}

ContactSearch::~ContactSearch() = default;

void ContactSearch::forget() {
  for (SeparatingPlanes& region : regions_) region.made = false;
  for (auto& open : opened_)
    if (open != nullptr) open->lists.forget(), open->uses = 0, open->until_m = open->quiet_until_m = -1.0;
}

bool ContactSearch::find(const Pose& X_TB, const Pose& X_BT) {
  travel(X_TB);
  X_TB_ = X_TB;
  X_BT_ = X_BT;
  made_ = false;
  hits_ = 0;
  normals_.clear(), bends_.clear();
  if (!regions_.empty()) visit(0, nullptr);
  return made_;
}

void ContactSearch::travel(const Pose& X_TB) {
  const double reach_m = base_.radius_m + kLargestBound_m;
  travelled_m_ += std::sqrt(0.5 * (X_TB.R - X_TB_.R).squaredNorm()) * reach_m +
                  (X_TB * base_.box.center_B - X_TB_ * base_.box.center_B).norm();
}

/// True if an element of the cluster may be below a plane.
bool ContactSearch::left(const ContactCluster& cluster, const Planes& planes) const {
  for (std::size_t i = 0; i < planes.count(); ++i)
    if (!(planes.lowest_m(cluster, i) > tolerance_.clear_m)) return true;
  return false;
}

void ContactSearch::visit(std::size_t index, const Planes* from) {
  const ContactCluster& cluster = base_.clusters[index];
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
  const auto look = [&] {
    find_free_region(base_, target_, cluster, X_TB_, leaf, region);
    made_ = true;
    region.again_m = travelled_m_ + region.again_after_m;
  };
  if (!(region.made && travelled_m_ <= region.until_m)) {
    double used = region.made ? region.used(cluster, X_TB_) : 2.0;
    if (!(used <= 1.0)) {
      region.again_after_m = kAgain_m;
      look();
      used = 0.0;
    }
    region.until_m = travelled_m_ + (1.0 - used) * region.least_bound_m();
  }
  const auto without = [&] {
    if (leaf)
      open_leaf(index, from);
    else
      go_down(from);
  };
  if (region.kind == SeparatingPlanes::Kind::none) return without();
  Planes planes(region, cluster, target_, X_TB_, X_BT_);
  if (!left(cluster, planes)) return;
  if (region.kind == SeparatingPlanes::Kind::free && travelled_m_ > region.again_m) {
    // The region includes planes that do not bound it at this pose, such as those of a passed chamfer.
    region.again_after_m *= 2.0;
    look();
    region.until_m = travelled_m_ + region.least_bound_m();
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
  const ContactCluster& cluster = base_.clusters[index];
  auto& open = opened_[index];
  if (open == nullptr) {
    open = std::make_unique<Open>();
    open->bound_m = first_bound_m_;
  }
  if (travelled_m_ <= open->quiet_until_m) return;
  ContactCandidates& lists = open->lists;
  bool rebuild = false;
  if (!(travelled_m_ <= open->until_m)) {
    rebuild = !lists.cover(X_TB_);
    open->until_m = travelled_m_ + lists.bound_m() - lists.moved_m(X_TB_);
  }
  if (rebuild) {
    if (open->uses > 0 && open->uses < 32) open->bound_m = std::min(2.0 * open->bound_m, kLargestBound_m);
  } else if (++open->uses % 256 == 0 && open->bound_m > kSmallestBound_m &&
             lists.slot_count() > 2 * open->depths.hits().size() + 4) {
    open->bound_m = std::max(0.5 * open->bound_m, kSmallestBound_m);
    rebuild = true;
  }
  if (rebuild) {
    // The set above all planes is outside while the region is valid.
    std::span<const std::int32_t> above;
    if (planes != nullptr && open->bound_m < (1.0 - planes->region->used(*planes->cluster, X_TB_)) *
                                                 planes->region->least_bound_m())
      above = planes->region->all();
    lists.rebuild(base_, target_, cluster, X_TB_, open->bound_m, above, work_);
    open->depths.prepare(lists);
    open->uses = 1;
    open->until_m = travelled_m_ + lists.bound_m();
    made_ = true;
  }
  open->depths.find(base_, target_, lists, X_TB_, X_BT_);
  open->quiet_until_m = -1.0;
  if (open->depths.hits().empty()) {
    const double quiet_m = std::min(0.999 * open->depths.quiet_m(), lists.bound_m() - lists.moved_m(X_TB_));
    if (quiet_m > 0.0) open->quiet_until_m = travelled_m_ + quiet_m;
    return;
  }
  make_room(open->depths.hits().size());
  for (const std::int32_t hit : open->depths.hits()) {
    const auto slot = static_cast<std::size_t>(hit);
    elements_[hits_] = lists.element[slot];
    depths_m_[hits_] = open->depths.depth_m(slot);
    normal_[hits_] = static_cast<std::int32_t>(normals_.size());
    normals_.push_back(open->depths.normal_B(slot));
    if (const ContactDepths::Bend* bend = open->depths.bend(slot)) bends_.push_back({hits_, bend->edge_B});
    ++hits_;
  }
}

}  // namespace takt
