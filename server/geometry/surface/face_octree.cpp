#include "server/geometry/surface/face_octree.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/geometry/surface/contact_surface_data.h"

namespace takt {
namespace {

/// Rounding; far above it, far below any size of a cell.
constexpr double kSlack_m = 1e-8;
/// Lists of this length are not worth a division.
constexpr std::size_t kShort = 16;
/// Smallest edge of a cell, and depth to which cells are divided, in mean edges of the faces near it.
constexpr double kSmallest = 0.6, kBand = 0.5;
/// Cells outside are divided until the distance of their centre is this many times half of their diagonal.
constexpr double kKnown = 1.5;
/// Entries of lists, expected, beyond which nothing is divided any more: per face, and in all.
constexpr std::size_t kEntriesPerFace = 48, kEntries = 20'000;
constexpr std::uint32_t kMostTopLevels = 5;

float rounded_down(double x) {
  return std::nextafter(static_cast<float>(x), -std::numeric_limits<float>::infinity());
}

}  // namespace

class FaceOctree::Builder {
 public:
  Builder(const ContactSurface::Data& surface, FaceOctree& tree) : surface_(surface), tree_(tree) {}

  void build() {
    area_m2_.resize(surface_.faces.size());
    balls_.resize(surface_.faces.size());
    Level level;
    for (std::size_t i = 0; i < surface_.faces.size(); ++i) {
      const auto c = surface_.corners(surface_.faces[i]);
      area_m2_[i] = 0.5 * (c[1] - c[0]).cross(c[2] - c[0]).norm();
      const Vec3 middle = (c[0] + c[1] + c[2]) / 3.0;
      const double radius_m =
          std::max({(c[0] - middle).norm(), (c[1] - middle).norm(), (c[2] - middle).norm()});
      balls_[i] = {middle, radius_m + kSlack_m};
      level.lists.push_back({static_cast<std::int32_t>(i), 0.0});
    }
    tree_.children_.assign(1, 0);  // the root, in the place of a child
    level.cells.push_back({{0, 0, 0}, 0, 0, level.lists.size()});
    const std::size_t budget = kEntriesPerFace * surface_.faces.size() + kEntries;
    Level next;
    for (std::uint8_t depth = 0; !level.cells.empty(); ++depth) {
      next.cells.clear(), next.lists.clear();
      const bool divide = depth < kLevels && tree_.near_.size() + kShort * level.cells.size() < budget;
      for (const Cell& cell : level.cells) add(level, cell, depth, divide, next);
      std::swap(level, next);
    }
    tree_.near_.shrink_to_fit(), tree_.leaves_.shrink_to_fit(), tree_.children_.shrink_to_fit();
    make_top();
  }

 private:
  struct Candidate {
    std::int32_t face;
    double distance_m;  ///< from the centre of the parent
  };
  /// Around a face: most faces of a list are too far away, which this shows from half a line of the cache.
  struct Ball {
    Vec3 middle;
    double radius_m;
  };
  struct Cell {
    std::array<std::uint32_t, 3> at;
    std::size_t place;       ///< in `children_`
    std::size_t begin, end;  ///< of its parent's list
  };
  /// Cells of one size, and the lists of their parents.
  struct Level {
    std::vector<Cell> cells;
    std::vector<Candidate> lists;
  };

  std::int32_t patch(std::int32_t face) const { return surface_.faces[static_cast<std::size_t>(face)].patch; }

  void add(const Level& level, const Cell& cell, std::uint8_t depth, bool divide, Level& next) {
    const double edge_m = tree_.size_m_ / static_cast<double>(1U << depth);
    const Vec3 center = tree_.lower_ + edge_m * Vec3(cell.at[0] + 0.5, cell.at[1] + 0.5, cell.at[2] + 0.5);
    const double r = 0.5 * std::sqrt(3.0) * edge_m + kSlack_m;
    // The list of the parent has every face that may be closest in any of its children, the closest one to
    // its own centre first.
    found_.clear();
    NearestFace nearest;
    double limit_m = INFINITY;
    for (std::size_t i = cell.begin; i < cell.end; ++i) {
      const Candidate& candidate = level.lists[i];
      // The centre of the parent is r away.
      if (depth > 0 && candidate.distance_m - r > limit_m) continue;
      const Ball& ball = balls_[static_cast<std::size_t>(candidate.face)];
      const double reach_m = limit_m + ball.radius_m;
      if ((ball.middle - center).squaredNorm() > reach_m * reach_m) continue;
      const ContactFace& face = surface_.faces[static_cast<std::size_t>(candidate.face)];
      if (surface_.least_squared_m2(face, center) > limit_m * limit_m) continue;
      const ClosestOnFace on = surface_.closest_on_face(face, center);
      const double distance_m = std::sqrt(on.squared_m2);
      if (distance_m > limit_m) continue;
      found_.push_back({candidate.face, distance_m});
      if (!(on.squared_m2 < nearest.closest.squared_m2)) continue;
      nearest = {candidate.face, on};
      limit_m = distance_m + 2.0 * r;
    }
    const double distance_m = std::sqrt(nearest.closest.squared_m2);
    const bool inside =
        surface_.inside(surface_.faces[static_cast<std::size_t>(nearest.face)], nearest.closest, center);
    std::erase_if(found_, [&](const Candidate& c) { return c.distance_m > limit_m; });
    std::iter_swap(found_.begin(), std::find_if(found_.begin(), found_.end(),
                                                [&](const Candidate& c) { return c.face == nearest.face; }));

    Leaf leaf;
    leaf.level = depth;
    leaf.at_least_m = rounded_down((inside ? -distance_m : distance_m) - kSlack_m);
    double area_m2 = 0.0;
    for (const Candidate& c : found_) area_m2 += area_m2_[static_cast<std::size_t>(c.face)];
    const double face_m = std::sqrt(2.0 * area_m2 / static_cast<double>(found_.size()));
    const bool small = !divide || edge_m < kSmallest * face_m;
    if (!inside && distance_m > r) {
      if (!small && distance_m < kKnown * r) return divide_cell(cell, next);
      leaf.kind = Kind::outside;
      put_plane_below(cell, edge_m, leaf);
      if (distance_m - r < kBand * face_m && found_.size() <= kLong) list_faces(leaf);
      return finish(cell, leaf);
    }
    const std::int32_t first = patch(found_.front().face);
    if (std::all_of(found_.begin(), found_.end(),
                    [&](const Candidate& c) { return patch(c.face) == first; })) {
      leaf.kind = Kind::patch;
      leaf.patch = first;
      return finish(cell, leaf);
    }
    const bool deep = inside && distance_m - r > kBand * face_m;
    if (found_.size() > kShort && !small && !deep) return divide_cell(cell, next);
    if (found_.size() > kLong) {
      leaf.kind = Kind::many;
      return finish(cell, leaf);
    }
    leaf.kind = Kind::faces;
    put_plane_below(cell, edge_m, leaf);
    list_faces(leaf);
    finish(cell, leaf);
  }

  void put_plane_below(const Cell& cell, double edge_m, Leaf& leaf) const {
    if (found_.size() > kLong) return;
    const auto plane = [&](const Candidate& c) -> const ContactPatch& {
      return surface_.patches[static_cast<std::size_t>(patch(c.face))];
    };
    Vec3 sum = Vec3::Zero();
    for (const Candidate& c : found_) sum += plane(c).normal;
    for (Eigen::Index k = 0; k < 3; ++k)
      leaf.normal[static_cast<std::size_t>(k)] = static_cast<float>(sum[k] / sum.norm());
    const Vec3 normal(leaf.normal[0], leaf.normal[1], leaf.normal[2]);
    if (!normal.allFinite()) {
      leaf.normal = {};
      return;
    }
    double offset_m = -INFINITY;
    for (std::uint32_t corner = 0; corner < 8; ++corner) {
      const Vec3 x =
          tree_.lower_ + edge_m * Vec3(cell.at[0] + (corner & 1U), cell.at[1] + (corner >> 1U & 1U),
                                       cell.at[2] + (corner >> 2U & 1U));
      for (const Candidate& c : found_)
        offset_m = std::max(offset_m, normal.dot(x) - (plane(c).normal.dot(x) - plane(c).offset_m));
    }
    leaf.offset_m = -rounded_down(-(offset_m + kSlack_m));
  }

  void list_faces(Leaf& leaf) {
    std::sort(found_.begin(), found_.end(), [](const Candidate& a, const Candidate& b) {
      return a.distance_m != b.distance_m ? a.distance_m < b.distance_m : a.face < b.face;
    });
    leaf.begin = static_cast<std::uint32_t>(tree_.near_.size());
    for (const Candidate& c : found_) tree_.near_.push_back({c.face, rounded_down(c.distance_m - kSlack_m)});
    leaf.end = static_cast<std::uint32_t>(tree_.near_.size());
  }

  void finish(const Cell& cell, const Leaf& leaf) {
    tree_.children_[cell.place] = ~static_cast<std::int32_t>(tree_.leaves_.size());
    tree_.leaves_.push_back(leaf);
  }

  void divide_cell(const Cell& cell, Level& next) {
    const std::size_t place = tree_.children_.size();
    tree_.children_[cell.place] = static_cast<std::int32_t>(place);
    tree_.children_.resize(place + 8, 0);
    const std::size_t begin = next.lists.size();
    next.lists.insert(next.lists.end(), found_.begin(), found_.end());
    for (std::uint32_t octant = 0; octant < 8; ++octant)
      next.cells.push_back({{2 * cell.at[0] + (octant & 1U), 2 * cell.at[1] + (octant >> 1U & 1U),
                             2 * cell.at[2] + (octant >> 2U & 1U)},
                            place + octant,
                            begin,
                            next.lists.size()});
  }

  void make_top() {
    std::uint32_t levels = 0;
    while (levels < kMostTopLevels && (8U << (3 * levels)) <= tree_.leaves_.size()) ++levels;
    tree_.top_levels_ = levels;
    const std::uint32_t count = 1U << levels;
    tree_.top_.clear();
    tree_.top_.reserve(std::size_t{count} * count * count);
    for (std::uint32_t x = 0; x < count; ++x)
      for (std::uint32_t y = 0; y < count; ++y)
        for (std::uint32_t z = 0; z < count; ++z) {
          std::int32_t node = tree_.children_.front();
          for (std::uint32_t shift = levels; shift > 0 && node >= 0;)
            node = tree_.child(node, {x, y, z}, --shift);
          tree_.top_.push_back(node);
        }
  }

  const ContactSurface::Data& surface_;
  FaceOctree& tree_;
  std::vector<double> area_m2_;
  std::vector<Ball> balls_;
  std::vector<Candidate> found_;
};

FaceOctree::FaceOctree(const ContactSurface::Data& surface) : bounds_(surface.bounds) {
  if (surface.faces.empty()) return;
  // A little larger than the surface, whose points are then all inside of the root.
  const double half_m = 1.001 * surface.box.half_B.maxCoeff() + kSlack_m;
  lower_ = surface.box.center_B - Vec3::Constant(half_m);
  size_m_ = 2.0 * half_m;
  cells_per_m_ = static_cast<double>(1U << kLevels) / size_m_;
  Builder(surface, *this).build();
}

void FaceOctree::find(std::span<const Vec3> points, std::span<const Leaf*, kBatch> leaves) const {
  struct Open {
    std::array<std::uint32_t, 3> cell;
    std::int32_t node;
    std::uint32_t point;
  };
  std::array<Open, kBatch> open;
  std::size_t count = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    leaves[i] = nullptr;
    Open& at = open[count];
    if (!locate(points[i], at.cell)) continue;
    at.node = top(at.cell);
    at.point = static_cast<std::uint32_t>(i);
    ++count;
  }
  for (std::uint32_t shift = kLevels - top_levels_; count > 0; --shift) {
    std::size_t left = 0;
    for (std::size_t i = 0; i < count; ++i) {
      Open& at = open[i];
      if (at.node < 0) {
        const Leaf* leaf = &leaves_[static_cast<std::size_t>(~at.node)];
        __builtin_prefetch(leaf);
        leaves[at.point] = leaf;
        continue;
      }
      at.node = child(at.node, at.cell, shift - 1);
      open[left++] = at;
    }
    count = left;
  }
}

double FaceOctree::at_least_m(const Vec3& x) const {
  if (empty()) return -std::numeric_limits<double>::infinity();
  if (const Leaf* leaf = find(x)) return static_cast<double>(leaf->at_least_m) - from_center_m(*leaf, x);
  double sum = 0.0;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const double beyond = std::max({bounds_.lower[k] - x[k], x[k] - bounds_.upper[k], 0.0});
    sum += beyond * beyond;
  }
  return std::sqrt(sum);
}

}  // namespace takt
