#pragma once
// A hierarchy of boxes over the convex parts of one component (thesis 6.2), so that a query visits only some
// combinations of parts. Built once, in the frame of the component.
#include <cstdint>
#include <vector>

#include "server/geometry/convex/convex_shape.h"

namespace takt {

class ShapeTree {
 public:
  struct Node {
    BodyBox box;              ///< around all parts below
    std::int32_t shape = -1;  ///< a leaf's part; -1: not a leaf, its children are the next node and `second`
    std::int32_t second = -1;
  };

  ShapeTree() = default;
  /// Halves the parts at the median of their centres along the longest side until one is left.
  explicit ShapeTree(const std::vector<ConvexShape>& shapes);

  /// Sets new bounds of a component that has one part.
  void update_single(const BodyBox& box) { nodes_.front().box = box; }

  bool empty() const { return nodes_.empty(); }

  /// Calls visit(i, j) for every combination of a part i of A and a part j of B that may be closer than
  /// `margin`, until it returns true. Returns whether it did. X_AB: pose of B in A. Does not allocate.
  template <typename Visit>
  bool any_near(const ShapeTree& other, const Pose& X_AB, double margin, const Visit& visit) const {
    if (empty() || other.empty()) return false;
    return descend(0, other, 0, X_AB, X_AB.R.cwiseAbs(), margin, visit);
  }

 private:
  std::int32_t build(const std::vector<ConvexShape>& shapes, std::vector<std::int32_t>::iterator begin,
                     std::vector<std::int32_t>::iterator end);

  template <typename Visit>
  bool descend(std::int32_t i, const ShapeTree& other, std::int32_t j, const Pose& X_AB, const Mat3& abs_R,
               double margin, const Visit& visit) const {
    const Node& a = nodes_[static_cast<std::size_t>(i)];
    const Node& b = other.nodes_[static_cast<std::size_t>(j)];
    const Vec3 between = X_AB * b.box.center_B - a.box.center_B;
    const Vec3 limit = a.box.half_B + abs_R * b.box.half_B;
    for (int k = 0; k < 3; ++k)
      if (std::abs(between[k]) > limit[k] + margin) return false;
    if (a.shape >= 0 && b.shape >= 0) return visit(a.shape, b.shape);
    // Open the larger box.
    const bool open_a = b.shape >= 0 || (a.shape < 0 && a.box.half_B.maxCoeff() >= b.box.half_B.maxCoeff());
    if (open_a)
      return descend(i + 1, other, j, X_AB, abs_R, margin, visit) ||
             descend(a.second, other, j, X_AB, abs_R, margin, visit);
    return descend(i, other, j + 1, X_AB, abs_R, margin, visit) ||
           descend(i, other, b.second, X_AB, abs_R, margin, visit);
  }

  std::vector<Node> nodes_;
};

}  // namespace takt
