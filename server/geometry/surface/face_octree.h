#pragma once
// An octree over the space around a closed surface, made once: each leaf lists the faces that may be closest
// to a point in it, and bounds the distance of its points from the surface. One descent and a few faces give
// the distance of a point, for any pose and at a bounded cost.
//
// A point is no closer to the surface than it is high above the plane of the face that is closest to it; so each
// leaf has one plane below those of all faces that may be closest, within the leaf.
//
// A face may be closest to a point of a cell with the centre c and half the diagonal r only if its distance
// from c is at most that of the closest face plus 2 r.
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/geometry/surface/contact_surface.h"

namespace takt {

class FaceOctree {
 public:
  enum class Kind : std::uint8_t {
    outside,  ///< no point is inside of the surface; near it, the faces that may be closest are listed
    patch,    ///< the closest point of each point is on one flat patch, and not on its border
    faces,    ///< the faces that may be closest are listed
    many,     ///< as before, but too many to list
  };
  struct Near {
    std::int32_t face;
    float at_least_m;  ///< lower bound of its distance from the centre of the leaf
  };
  struct Leaf {
    Kind kind = Kind::outside;
    std::uint8_t level = 0;   ///< halvings of the root
    float at_least_m = 0.0F;  ///< lower bound of the signed distance of the centre
    std::int32_t patch = -1;  ///< of Kind::patch
    std::uint32_t begin = 0, end = 0;
    /// A point of the leaf is no closer to the surface than it is high above this plane; a point inside is below it.
    std::array<float, 3> normal{};
    float offset_m = std::numeric_limits<float>::infinity();
  };

  FaceOctree() = default;
  /// Uses vertices, faces, patches, normals and box of the surface.
  explicit FaceOctree(const ContactSurface::Data& surface);

  bool empty() const { return leaves_.empty(); }

  /// All of it, for machines with the byte order of this one.
  std::string bytes() const;
  /// What bytes() has returned, of a surface with so many faces and patches; std::nullopt for any other bytes.
  static std::optional<FaceOctree> from_bytes(std::string_view bytes, std::size_t faces, std::size_t patches);

  /// Most faces of a list: a longer one costs more than a walk through the hierarchy of faces.
  static constexpr std::size_t kLong = 64;
  /// Points of one call of find().
  static constexpr std::size_t kBatch = 64;
  /// The leaf that has each point (m); null beside the root, where all is outside of the surface. All points
  /// go down together: the memory that one of them waits for does not stop the others.
  void find(std::span<const Vec3> points, std::span<const Leaf*, kBatch> leaves) const;
  const Leaf* find(const Vec3& x) const {
    std::array<std::uint32_t, 3> cell;
    return locate(x, cell) ? &leaf(cell) : nullptr;
  }
  static bool has_list(const Leaf& leaf) { return leaf.begin < leaf.end; }
  /// In the order of their lower bounds.
  std::span<const Near> faces(const Leaf& leaf) const {
    return {near_.data() + leaf.begin, near_.data() + leaf.end};
  }
  /// Distance of x, a point of the leaf, from its centre (m).
  double from_center_m(const Leaf& leaf, const Vec3& x) const {
    const double edge_m = size_m_ / static_cast<double>(1U << leaf.level);
    double sum = 0.0;
    for (Eigen::Index k = 0; k < 3; ++k) {
      const double u = (x[k] - lower_[k]) / edge_m;
      const double beside = u - static_cast<double>(static_cast<std::uint32_t>(u)) - 0.5;
      sum += beside * beside;
    }
    return std::sqrt(sum) * edge_m;
  }
  /// Where it is positive, a lower bound of the distance of x, a point of the leaf, from the surface (m); else x may be inside.
  double at_least_m(const Leaf& leaf, const Vec3& x) const {
    const double height = static_cast<double>(leaf.normal[0]) * x.x() +
                          static_cast<double>(leaf.normal[1]) * x.y() +
                          static_cast<double>(leaf.normal[2]) * x.z() - static_cast<double>(leaf.offset_m);
    return std::max(height, static_cast<double>(leaf.at_least_m) - from_center_m(leaf, x));
  }
  /// Lower bound of the signed distance of x from the surface (m); minus infinity of an empty tree.
  double at_least_m(const Vec3& x) const;

 private:
  class Builder;
  void make_top();  ///< from the nodes
  bool is_consistent(std::size_t faces, std::size_t patches) const;
  static constexpr std::uint32_t kLevels = 20;  ///< most halvings

  /// Of a node that is a leaf.
  static std::size_t leaf_index(std::int32_t node) { return static_cast<std::size_t>(-1 - node); }
  bool locate(const Vec3& x, std::array<std::uint32_t, 3>& cell) const {
    constexpr double kCells = 1U << kLevels;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<Eigen::Index>(k);
      const double u = (x[axis] - lower_[axis]) * cells_per_m_;
      if (!(u >= 0.0 && u < kCells)) return false;
      cell[k] = static_cast<std::uint32_t>(u);
    }
    return true;
  }
  std::int32_t top(const std::array<std::uint32_t, 3>& cell) const {
    const std::uint32_t shift = kLevels - top_levels_;
    return top_[((cell[0] >> shift) << (2 * top_levels_)) | ((cell[1] >> shift) << top_levels_) |
                cell[2] >> shift];
  }
  /// Of an inner node; `shift`: levels below it.
  std::int32_t child(std::int32_t node, const std::array<std::uint32_t, 3>& cell, std::uint32_t shift) const {
    const std::uint32_t octant =
        (cell[0] >> shift & 1U) | (cell[1] >> shift & 1U) << 1U | (cell[2] >> shift & 1U) << 2U;
    return children_[static_cast<std::size_t>(node) + octant];
  }
  const Leaf& leaf(const std::array<std::uint32_t, 3>& cell) const {
    std::int32_t node = top(cell);
    for (std::uint32_t shift = kLevels - top_levels_; node >= 0;) node = child(node, cell, --shift);
    return leaves_[leaf_index(node)];
  }

  Vec3 lower_ = Vec3::Zero();
  double size_m_ = 0.0, cells_per_m_ = 0.0;
  Aabb bounds_;
  std::uint32_t top_levels_ = 0;
  std::vector<std::int32_t> top_;  ///< nodes of the level `top_levels_`
  /// Of each inner node eight nodes: the place of its children, or -1 less the index of its leaf.
  std::vector<std::int32_t> children_;
  std::vector<Leaf> leaves_;
  std::vector<Near> near_;
};

}  // namespace takt
