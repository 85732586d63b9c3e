#include "server/geometry/surface/face_octree.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include "server/geometry/surface/contact_surface_data.h"

namespace takt {
namespace {

/// Rounding; far above it, far below any size of a cell.
constexpr double kSlack_m = 1e-8;
/// Rounding of positions in single precision, as a share of the root.
constexpr double kFloatSlack = 1e-6;
/// Lists of this length are not worth a division.
constexpr std::size_t kShort = 16;
/// Smallest edge of a cell, and depth to which cells are divided, in mean edges of the faces near it.
constexpr double kSmallest = 0.6, kBand = 0.5;
/// Cells outside are divided until the distance of their centre is this many times half of their diagonal.
constexpr double kKnown = 1.5;
/// Entries of lists, expected, beyond which nothing is divided any more: per face, and in all.
constexpr std::size_t kEntriesPerFace = 48, kEntries = 20'000;
/// Entries of parents' lists that the cells of one size look at, beyond which they are not divided: per face, and in all. It bounds
/// time and memory of the construction where many faces are small against the whole, as on a long spindle.
constexpr std::size_t kSearchesPerFace = 1500, kSearches = 20'000'000;
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
    Level level;
    all_.resize(surface_.faces.size());
    for (std::size_t i = 0; i < surface_.faces.size(); ++i) {
      const auto c = surface_.corners(surface_.faces[i]);
      area_m2_[i] = 0.5 * (c[1] - c[0]).cross(c[2] - c[0]).norm();
      const Vec3 middle = (c[0] + c[1] + c[2]) / 3.0;
      const double radius_m =
          std::max({(c[0] - middle).norm(), (c[1] - middle).norm(), (c[2] - middle).norm()});
      const Vec3 at = middle - tree_.lower_;
      all_.put(i, static_cast<float>(at.x()), static_cast<float>(at.y()), static_cast<float>(at.z()),
               static_cast<float>(radius_m));
      level.faces.push_back(static_cast<std::int32_t>(i));
    }
    slack_m_ = static_cast<float>(kFloatSlack * tree_.size_m_ + kSlack_m);
    tree_.children_.assign(1, 0);  // the root, in the place of a child
    level.cells.push_back({{0, 0, 0}, 0, 0, level.faces.size()});
    const std::size_t budget = kEntriesPerFace * surface_.faces.size() + kEntries;
    const std::size_t most_searches = kSearchesPerFace * surface_.faces.size() + kSearches;
    Level next;
    for (std::uint8_t depth = 0; !level.cells.empty(); ++depth) {
      next.cells.clear(), next.faces.clear();
      std::size_t searches = 0;
      for (const Cell& cell : level.cells) searches += cell.end - cell.begin;
      const bool divide = depth < kLevels && searches < most_searches &&
                          tree_.near_.size() + kShort * level.cells.size() < budget;
      for (const Cell& cell : level.cells) {
        // The children of a cell stand together and share its list.
        if (&cell == &level.cells.front() || cell.begin != (&cell - 1)->begin) gather(level, cell);
        add(cell, depth, divide, next);
      }
      std::swap(level, next);
    }
    tree_.near_.shrink_to_fit(), tree_.leaves_.shrink_to_fit(), tree_.children_.shrink_to_fit();
    tree_.make_top();
  }

 private:
  /// Around faces: a ball shows from few bytes that a face is too far away. Its middle is a point of the face, so its
  /// distance bounds that of the face from both sides.
  struct Balls {
    std::vector<float> x, y, z;  ///< of the middle, from the corner of the root (m)
    std::vector<float> radius_m;
    void resize(std::size_t count) {
      x.resize(count), y.resize(count), z.resize(count), radius_m.resize(count);
    }
    void put(std::size_t i, float at_x, float at_y, float at_z, float radius) {
      x[i] = at_x, y[i] = at_y, z[i] = at_z, radius_m[i] = radius;
    }
  };
  struct Cell {
    std::array<std::uint32_t, 3> at;
    std::size_t place;       ///< in `children_`
    std::size_t begin, end;  ///< of its parent's list; no two parents have the same begin
  };
  /// Cells of one size, and the lists of their parents: the faces that may be closest in any of the children.
  struct Level {
    std::vector<Cell> cells;
    std::vector<std::int32_t> faces;
  };
  struct Candidate {
    std::int32_t face;
    double distance_m;  ///< from the centre of the cell, once find_faces() has found it
  };

  std::int32_t patch(std::int32_t face) const { return surface_.faces[static_cast<std::size_t>(face)].patch; }

  /// The list of the cell's parent, and the balls of it side by side.
  void gather(const Level& level, const Cell& cell) {
    list_ = {level.faces.data() + cell.begin, cell.end - cell.begin};
    balls_.resize(list_.size());
    for (std::size_t i = 0; i < list_.size(); ++i) {
      const auto face = static_cast<std::size_t>(list_[i]);
      balls_.put(i, all_.x[face], all_.y[face], all_.z[face], all_.radius_m[face]);
    }
  }

  /// Distances of the middles of the list's balls from the centre of a cell, and the least of them.
  std::size_t find_middles(const Vec3& center) {
    using Floats = Eigen::Map<const Eigen::ArrayXf>;
    const auto count = static_cast<Eigen::Index>(list_.size());
    const auto part = [&](const std::vector<float>& all) { return Floats(all.data(), count); };
    const Eigen::Vector3f c = (center - tree_.lower_).cast<float>();
    middle_m_.resize(static_cast<std::size_t>(count)), least_m_.resize(static_cast<std::size_t>(count));
    Eigen::Map<Eigen::ArrayXf> middle_m(middle_m_.data(), count), least_m(least_m_.data(), count);
    middle_m = ((part(balls_.x) - c.x()).square() + (part(balls_.y) - c.y()).square() +
                (part(balls_.z) - c.z()).square())
                   .sqrt();
    least_m = middle_m - part(balls_.radius_m) - slack_m_;
    const float closest_m = middle_m.minCoeff();
    return static_cast<std::size_t>(std::find(middle_m_.begin(), middle_m_.end(), closest_m) -
                                    middle_m_.begin());
  }

  ClosestOnFace closest_on(std::int32_t face, const Vec3& x) const {
    return surface_.closest_on_face(surface_.faces[static_cast<std::size_t>(face)], x);
  }

  NearestFace find_nearest(std::size_t first, const Vec3& center) const {
    const std::int32_t guess = list_[first];
    NearestFace nearest{guess, closest_on(guess, center)};
    auto limit_m = static_cast<float>(std::sqrt(nearest.closest.squared_m2));
    for (std::size_t i = 0; i < middle_m_.size(); ++i) {
      if (least_m_[i] > limit_m) continue;
      const std::int32_t face = list_[i];
      const ClosestOnFace on = closest_on(face, center);
      if (!(on.squared_m2 < nearest.closest.squared_m2)) continue;
      nearest = {face, on};
      limit_m = static_cast<float>(std::sqrt(on.squared_m2));
    }
    return nearest;
  }

  /// Puts the faces into `found_` whose balls are within `limit_m`, and returns how many of them are so for certain.
  std::size_t find_balls(double limit_m) {
    found_.clear();
    const auto limit = static_cast<float>(limit_m);
    std::size_t certain = 0;
    for (std::size_t i = 0; i < least_m_.size(); ++i) {
      if (least_m_[i] > limit) continue;
      found_.push_back({list_[i], 0.0});
      if (middle_m_[i] + slack_m_ < limit) ++certain;
    }
    return certain;
  }

  /// Leaves those in `found_` that are within `limit_m`, with their distances.
  std::size_t find_faces(const Vec3& center, double limit_m) {
    for (Candidate& c : found_) c.distance_m = std::sqrt(closest_on(c.face, center).squared_m2);
    std::erase_if(found_, [&](const Candidate& c) { return c.distance_m > limit_m; });
    return found_.size();
  }

  bool on_one_patch() const {
    const std::int32_t first = patch(found_.front().face);
    return std::all_of(found_.begin(), found_.end(),
                       [&](const Candidate& c) { return patch(c.face) == first; });
  }

  /// Mean edge of the faces in `found_` (m).
  double face_m() const {
    double area_m2 = 0.0;
    for (const Candidate& c : found_) area_m2 += area_m2_[static_cast<std::size_t>(c.face)];
    return std::sqrt(2.0 * area_m2 / static_cast<double>(found_.size()));
  }

  void add(const Cell& cell, std::uint8_t depth, bool divide, Level& next) {
    const double edge_m = tree_.size_m_ / static_cast<double>(1U << depth);
    const Vec3 center = tree_.lower_ + edge_m * Vec3(cell.at[0] + 0.5, cell.at[1] + 0.5, cell.at[2] + 0.5);
    const double r = 0.5 * std::sqrt(3.0) * edge_m + kSlack_m;
    const std::size_t first = find_middles(center);
    const NearestFace nearest = find_nearest(first, center);
    const double distance_m = std::sqrt(nearest.closest.squared_m2);
    const bool inside =
        surface_.inside(surface_.faces[static_cast<std::size_t>(nearest.face)], nearest.closest, center);
    const double limit_m = distance_m + 2.0 * r;
    const std::size_t certain = find_balls(limit_m);

    Leaf leaf;
    leaf.level = depth;
    leaf.at_least_m = rounded_down((inside ? -distance_m : distance_m) - kSlack_m);
    const double mean_m = face_m();
    const bool small = !divide || edge_m < kSmallest * mean_m;
    if (!inside && distance_m > r) {
      if (!small && distance_m < kKnown * r) return divide_cell(cell, next);
      leaf.kind = Kind::outside;
      if (certain <= kLong && find_faces(center, limit_m) <= kLong) {
        put_plane_below(center, edge_m, leaf);
        if (distance_m - r < kBand * mean_m) list_faces(leaf);
      }
      return finish(cell, leaf);
    }
    const bool deep = inside && distance_m - r > kBand * mean_m;
    const bool worth_dividing = !small && !deep;
    bool one_patch = on_one_patch();
    if (!one_patch && worth_dividing && certain > kShort) return divide_cell(cell, next);
    if (!one_patch && certain <= kLong) {
      find_faces(center, limit_m);
      one_patch = on_one_patch();
    }
    if (one_patch) {
      leaf.kind = Kind::patch;
      leaf.patch = patch(found_.front().face);
      return finish(cell, leaf);
    }
    if (found_.size() > kShort && worth_dividing) return divide_cell(cell, next);
    if (found_.size() > kLong) {
      leaf.kind = Kind::many;
      return finish(cell, leaf);
    }
    leaf.kind = Kind::faces;
    put_plane_below(center, edge_m, leaf);
    list_faces(leaf);
    finish(cell, leaf);
  }

  /// Of the faces in `found_`, whose distances are exact.
  void put_plane_below(const Vec3& center, double edge_m, Leaf& leaf) const {
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
    // The difference of two planes is linear: it is largest at a corner of the cell.
    double offset_m = -std::numeric_limits<double>::infinity();
    for (const Candidate& c : found_) {
      const Vec3 difference = normal - plane(c).normal;
      offset_m = std::max(offset_m,
                          difference.dot(center) + 0.5 * edge_m * difference.lpNorm<1>() + plane(c).offset_m);
    }
    leaf.offset_m = -rounded_down(-(offset_m + kSlack_m));
  }

  /// Of the faces in `found_`, whose distances are exact.
  void list_faces(Leaf& leaf) {
    std::sort(found_.begin(), found_.end(), [](const Candidate& a, const Candidate& b) {
      return a.distance_m != b.distance_m ? a.distance_m < b.distance_m : a.face < b.face;
    });
    leaf.begin = static_cast<std::uint32_t>(tree_.near_.size());
    for (const Candidate& c : found_) tree_.near_.push_back({c.face, rounded_down(c.distance_m - kSlack_m)});
    leaf.end = static_cast<std::uint32_t>(tree_.near_.size());
  }

  void finish(const Cell& cell, const Leaf& leaf) {
    tree_.children_[cell.place] = -1 - static_cast<std::int32_t>(tree_.leaves_.size());
    tree_.leaves_.push_back(leaf);
  }

  void divide_cell(const Cell& cell, Level& next) {
    const std::size_t place = tree_.children_.size();
    tree_.children_[cell.place] = static_cast<std::int32_t>(place);
    tree_.children_.resize(place + 8, 0);
    const std::size_t begin = next.faces.size();
    for (const Candidate& c : found_) next.faces.push_back(c.face);
    for (std::uint32_t octant = 0; octant < 8; ++octant)
      next.cells.push_back({{2 * cell.at[0] + (octant & 1U), 2 * cell.at[1] + (octant >> 1U & 1U),
                             2 * cell.at[2] + (octant >> 2U & 1U)},
                            place + octant,
                            begin,
                            next.faces.size()});
  }

  const ContactSurface::Data& surface_;
  FaceOctree& tree_;
  std::vector<double> area_m2_;
  Balls all_;                           ///< of each face
  std::span<const std::int32_t> list_;  ///< see gather()
  Balls balls_;
  float slack_m_ = 0.0F;  ///< of distances from balls
  std::vector<float> middle_m_,
      least_m_;  ///< of a cell's list: distance of the middle, lower bound of the face's
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

void FaceOctree::make_top() {
  top_levels_ = 0;
  while (top_levels_ < kMostTopLevels && (8U << (3 * top_levels_)) <= leaves_.size()) ++top_levels_;
  const std::uint32_t count = 1U << top_levels_;
  top_.clear();
  top_.reserve(std::size_t{count} * count * count);
  for (std::uint32_t x = 0; x < count; ++x)
    for (std::uint32_t y = 0; y < count; ++y)
      for (std::uint32_t z = 0; z < count; ++z) {
        std::int32_t node = children_.front();
        for (std::uint32_t shift = top_levels_; shift > 0 && node >= 0;)
          node = child(node, {x, y, z}, --shift);
        top_.push_back(node);
      }
}

namespace {

template <typename T>
void append(std::string& bytes, const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}
template <typename T>
void append(std::string& bytes, const std::vector<T>& values) {
  static_assert(std::is_trivially_copyable_v<T>);
  append(bytes, std::uint64_t{values.size()});
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}
template <typename T>
bool take(std::string_view& bytes, T& value) {
  if (bytes.size() < sizeof(value)) return false;
  std::memcpy(&value, bytes.data(), sizeof(value));
  bytes.remove_prefix(sizeof(value));
  return true;
}
template <typename T>
bool take(std::string_view& bytes, std::vector<T>& values) {
  std::uint64_t count = 0;
  if (!take(bytes, count) || count > bytes.size() / sizeof(T)) return false;
  values.resize(count);
  if (count > 0) std::memcpy(values.data(), bytes.data(), count * sizeof(T));
  bytes.remove_prefix(count * sizeof(T));
  return true;
}

}  // namespace

std::string FaceOctree::bytes() const {
  std::string bytes;
  for (const Vec3* v : {&lower_, &bounds_.lower, &bounds_.upper})
    for (const double x : *v) append(bytes, x);
  append(bytes, size_m_);
  append(bytes, children_), append(bytes, leaves_), append(bytes, near_);
  return bytes;
}

std::optional<FaceOctree> FaceOctree::from_bytes(std::string_view bytes, std::size_t faces,
                                                 std::size_t patches) {
  FaceOctree tree;
  bool whole = true;
  for (Vec3* v : {&tree.lower_, &tree.bounds_.lower, &tree.bounds_.upper})
    for (double& x : *v) whole = whole && take(bytes, x);
  whole = whole && take(bytes, tree.size_m_) && take(bytes, tree.children_) && take(bytes, tree.leaves_) &&
          take(bytes, tree.near_) && bytes.empty();
  if (!whole || !tree.is_consistent(faces, patches)) return std::nullopt;
  tree.cells_per_m_ = static_cast<double>(1U << kLevels) / tree.size_m_;
  tree.make_top();
  return tree;
}

// Whatever the bytes are, a search ends and stays within the lists.
bool FaceOctree::is_consistent(std::size_t faces, std::size_t patches) const {
  if (!(size_m_ > 0.0) || children_.size() % 8 != 1) return false;
  // Nodes come behind their parents, so that no way goes around, and none is longer than a descent.
  std::vector<std::uint8_t> depth(children_.size(), 0);
  for (std::size_t i = 0; i < children_.size(); ++i) {
    const std::int32_t node = children_[i];
    if (node < 0) {
      if (leaf_index(node) >= leaves_.size()) return false;
      continue;
    }
    const auto place = static_cast<std::size_t>(node);
    if (place <= i || place + 8 > children_.size() || depth[i] == kLevels) return false;
    for (std::size_t k = place; k < place + 8; ++k)
      depth[k] = std::max(depth[k], static_cast<std::uint8_t>(depth[i] + 1));
  }
  for (const Leaf& leaf : leaves_) {
    if (leaf.kind > Kind::many || leaf.level > kLevels || leaf.begin > leaf.end || leaf.end > near_.size() ||
        leaf.end - leaf.begin > kLong)
      return false;
    if (leaf.kind == Kind::patch && (leaf.patch < 0 || static_cast<std::size_t>(leaf.patch) >= patches))
      return false;
  }
  return std::all_of(near_.begin(), near_.end(), [&](const Near& near) {
    return near.face >= 0 && static_cast<std::size_t>(near.face) < faces;
  });
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
        const Leaf* leaf = &leaves_[leaf_index(at.node)];
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
