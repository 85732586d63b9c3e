#pragma once
// A hierarchy of boxes over many small things fixed in one body (faces, penetration lines): one array of
// nodes, one thing per leaf, built once.
#include <array>
#include <cmath>
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
  /// The box around everything. The tree must not be empty.
  const BodyBox& bounds() const { return nodes_.front().box; }

  /// Calls visit(thing) for each thing whose box, grown by `margin`, the segment p-q touches, and possibly
  /// for a few others.
  template <typename Visit>
  void visit_segment(const Vec3& p, const Vec3& q, double margin, const Visit& visit) const {
    if (empty()) return;
    const Segment segment(p, q, margin);
    if (!segment.touches(nodes_.front().box)) return;
    // Every node on the stack is touched.
    std::array<std::int32_t, kDepth> stack;
    std::size_t size = 0;
    std::int32_t index = 0;
    while (true) {
      const Node& node = nodes_[static_cast<std::size_t>(index)];
      bool first = false;
      if (node.thing >= 0) {
        visit(node.thing);
      } else {
        first = segment.touches(nodes_[static_cast<std::size_t>(index) + 1].box);
        if (segment.touches(nodes_[static_cast<std::size_t>(node.second)].box)) {
          if (first)
            stack[size++] = node.second;
          else
            index = node.second;
          if (!first) continue;
        }
      }
      if (first) {
        ++index;
      } else {
        if (size == 0) return;
        index = stack[--size];
      }
    }
  }

  /// Calls visit(thing) for things whose boxes are no further from p than a limit, nearer boxes roughly
  /// first. `limit2` is squared (m^2); visit may lower it during the walk.
  template <typename Visit>
  void visit_near(const Vec3& p, const double& limit2, const Visit& visit) const {
    if (empty()) return;
    struct Open {
      std::int32_t index;
      double distance2;
    };
    std::array<Open, kDepth> stack;
    std::size_t size = 0;
    stack[size++] = {0, squared_distance(p, nodes_.front().box)};
    while (size > 0) {
      const Open open = stack[--size];
      if (!(open.distance2 <= limit2)) continue;
      const Node& node = nodes_[static_cast<std::size_t>(open.index)];
      if (node.thing >= 0) {
        visit(node.thing);
        continue;
      }
      const Open first{open.index + 1,
                       squared_distance(p, nodes_[static_cast<std::size_t>(open.index) + 1].box)};
      const Open second{node.second, squared_distance(p, nodes_[static_cast<std::size_t>(node.second)].box)};
      const bool first_nearer = first.distance2 <= second.distance2;
      stack[size++] = first_nearer ? second : first;
      stack[size++] = first_nearer ? first : second;
    }
  }

  /// Labels each thing with a number; a node gets the label that all its things share, else -1.
  void label(const std::vector<std::int32_t>& labels);
  /// Descends into nodes for which enter(box, label) is true (label -1: several labels, or unlabelled), and
  /// calls visit(thing) until it returns false. Returns false if visit did.
  template <typename Enter, typename Visit>
  bool walk(const Enter& enter, const Visit& visit) const {
    if (empty()) return true;
    std::array<std::int32_t, kDepth> stack;
    std::size_t size = 0;
    stack[size++] = 0;
    while (size > 0) {
      const std::int32_t index = stack[--size];
      const Node& node = nodes_[static_cast<std::size_t>(index)];
      if (!enter(node.box, node.label)) continue;
      if (node.thing >= 0) {
        if (!visit(node.thing)) return false;
        continue;
      }
      stack[size++] = node.second;
      stack[size++] = index + 1;
    }
    return true;
  }

 private:
  static constexpr std::size_t kDepth = 80;  // halving: 2 per level, of at most 32 levels

  struct Node {
    BodyBox box;
    std::int32_t thing = -1;  ///< of a leaf; -1: the children are the next node and `second`
    std::int32_t second = -1;
    std::int32_t label = -1;
  };

  /// A segment and the width around it.
  struct Segment {
    Segment(const Vec3& p, const Vec3& q, double margin)
        : middle(0.5 * (p + q)), half((0.5 * (q - p)).cwiseAbs()), direction(0.5 * (q - p)), width(margin) {
      // Along an axis, or hardly longer than wide: its box is tight enough.
      const double longest = half.maxCoeff();
      slanted = longest > margin && half.sum() > 1.1 * longest;
    }
    bool touches(const BodyBox& box) const {
      const double x = middle[0] - box.center_B[0], y = middle[1] - box.center_B[1],
                   z = middle[2] - box.center_B[2];
      const double a = box.half_B[0] + width, b = box.half_B[1] + width, c = box.half_B[2] + width;
      if (std::abs(x) > a + half[0] || std::abs(y) > b + half[1] || std::abs(z) > c + half[2]) return false;
      if (!slanted) return true;
      // The other separating axes: the segment's direction times the axes.
      return std::abs(direction[1] * z - direction[2] * y) <= b * half[2] + c * half[1] + kTiny &&
             std::abs(direction[2] * x - direction[0] * z) <= a * half[2] + c * half[0] + kTiny &&
             std::abs(direction[0] * y - direction[1] * x) <= a * half[1] + b * half[0] + kTiny;
    }
    static constexpr double kTiny = 1e-18;  // m^2: rounding of the products
    Vec3 middle, half, direction;
    double width;
    bool slanted;
  };

  static double squared_distance(const Vec3& p, const BodyBox& box) {
    double sum = 0.0;
    for (int k = 0; k < 3; ++k) {
      const double beyond = std::abs(p[k] - box.center_B[k]) - box.half_B[k];
      if (beyond > 0.0) sum += beyond * beyond;
    }
    return sum;
  }

  std::int32_t build(const std::vector<Aabb>& boxes, std::vector<std::int32_t>::iterator begin,
                     std::vector<std::int32_t>::iterator end);

  std::vector<Node> nodes_;
};

}  // namespace takt
