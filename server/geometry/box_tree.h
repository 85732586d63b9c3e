#pragma once
// A hierarchy of boxes over many small things fixed in one body (faces, penetration lines): flat, one thing
// per leaf, built once.
#include <array>
#include <cstdint>
#include <vector>

#include "server/geometry/aabb.h"

namespace takt {

class BoxTree {
 public:
  BoxTree() = default;
  /// One box per thing, in the frame of the body.
  explicit BoxTree(const std::vector<Aabb>& boxes);

  bool empty() const { return nodes_.empty(); }
  /// Around everything. Not to be called if empty.
  const BodyBox& bounds() const { return nodes_.front().box; }

  /// Calls visit(thing) for each thing whose box, grown by `margin`, the segment p-q touches; none is left
  /// out, a few others may come too.
  template <typename Visit>
  void visit_segment(const Vec3& p, const Vec3& q, double margin, const Visit& visit) const {
    if (empty()) return;
    const Segment segment{0.5 * (p + q), 0.5 * (q - p)};
    std::array<std::int32_t, kDepth> stack;
    int size = 0;
    stack[0] = 0;
    size = 1;
    while (size > 0) {
      const std::int32_t index = stack[static_cast<std::size_t>(--size)];
      const Node& node = nodes_[static_cast<std::size_t>(index)];
      if (!segment.touches(node.box, margin)) continue;
      if (node.thing >= 0) {
        visit(node.thing);
      } else {
        stack[static_cast<std::size_t>(size++)] = node.second;
        stack[static_cast<std::size_t>(size++)] = index + 1;
      }
    }
  }

  /// Calls visit(thing) for each of our things whose box, moved to X_OU into the frame of `other` and grown
  /// by `margin`, may touch the box of anything there.
  template <typename Visit>
  void visit_near(const BoxTree& other, const Pose& X_OU, double margin, const Visit& visit) const {
    if (empty() || other.empty()) return;
    collect(0, other, X_OU, X_OU.R.cwiseAbs(), margin, visit);
  }

 private:
  static constexpr std::size_t kDepth = 80;  // halving: 2 per level, of at most 32 levels

  struct Node {
    BodyBox box;
    std::int32_t thing = -1;  ///< of a leaf; -1: the children are the next node and `second`
    std::int32_t second = -1;
  };

  struct Segment {
    Vec3 middle, half;
    bool touches(const BodyBox& box, double margin) const {
      const Vec3 between = (middle - box.center_B).cwiseAbs();
      const Vec3 extent = box.half_B + Vec3::Constant(margin);
      const Vec3 reach = half.cwiseAbs();
      if ((between - extent - reach).maxCoeff() > 0.0) return false;
      // The other separating axes: the segment's direction times the axes.
      const Vec3 turned = half.cross(middle - box.center_B).cwiseAbs();
      return turned.x() <= extent.y() * reach.z() + extent.z() * reach.y() + kTiny &&
             turned.y() <= extent.x() * reach.z() + extent.z() * reach.x() + kTiny &&
             turned.z() <= extent.x() * reach.y() + extent.y() * reach.x() + kTiny;
    }
    static constexpr double kTiny = 1e-18;  // m^2: rounding of the products
  };

  std::int32_t build(const std::vector<Aabb>& boxes, std::vector<std::int32_t>::iterator begin,
                     std::vector<std::int32_t>::iterator end);
  bool any_near(const BodyBox& box, const Pose& X_OU, const Mat3& abs_R, double margin) const;

  template <typename Visit>
  void collect(std::int32_t index, const BoxTree& other, const Pose& X_OU, const Mat3& abs_R, double margin,
               const Visit& visit) const {
    const Node& node = nodes_[static_cast<std::size_t>(index)];
    if (!other.any_near(node.box, X_OU, abs_R, margin)) return;
    if (node.thing >= 0) {
      visit(node.thing);
      return;
    }
    collect(index + 1, other, X_OU, abs_R, margin, visit);
    collect(node.second, other, X_OU, abs_R, margin, visit);
  }

  std::vector<Node> nodes_;
};

}  // namespace takt
