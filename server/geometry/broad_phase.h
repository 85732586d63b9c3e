#pragma once
// Broad phase whose cost follows the number of moving components: a tree of boxes, each a little larger than
// the component's, so that motion within the box leaves the tree unchanged (dynamic bounding volume tree;
// Ericson, Real-Time Collision Detection, 2005, 6.3.3). Deterministic: the same calls give the same tree.
#include <cstdint>
#include <span>
#include <vector>

#include "server/geometry/aabb.h"

namespace takt {

class BroadPhase {
 public:
  /// Of one component, or the largest of several.
  struct Speed {
    double linear_m_per_s = 0.0, angular_rad_per_s = 0.0;
    double radius_m = 0.0;  ///< no point is further from the component's origin
    bool operator==(const Speed&) const = default;
  };

  explicit BroadPhase(std::size_t component_count);

  /// Builds the tree from these boxes, one per component.
  void build(std::span<const Aabb> boxes);
  /// Sets the component's box. True if it left its large box and got a new one, which may change its
  /// neighbours. Does not allocate.
  bool update(int component, const Aabb& box);
  /// For find_if(); zero after build(). Does not allocate.
  void set_speed(int component, const Speed& speed);

  /// The component's large box.
  const Aabb& large_box(int component) const { return nodes_[static_cast<std::size_t>(component)].box; }
  bool near(int a, int b) const { return large_box(a).overlaps(large_box(b)); }

  /// Appends all components whose large box overlaps `box`.
  void find(const Aabb& box, std::vector<int>& found) {
    find_if([&box](const Aabb& all, const Speed&) { return all.overlaps(box); }, found);
  }
  /// Appends the components that `accept` (large box, speed) accepts. It is asked about groups, too, with the box
  /// around all of a group and its largest speeds, and must accept those that contain a component it accepts.
  template <class Accept>
  void find_if(const Accept& accept, std::vector<int>& found) {
    stack_.clear();
    if (root_ >= 0) stack_.push_back(root_);
    while (!stack_.empty()) {
      const std::int32_t i = stack_.back();
      stack_.pop_back();
      if (!accept(node(i).box, node(i).speed)) continue;
      if (!leaf(i)) {
        stack_.push_back(node(i).left);
        stack_.push_back(node(i).right);
      } else {
        found.push_back(i);
      }
    }
  }

 private:
  // Nodes 0 .. count-1 are the components, the rest inner nodes.
  struct Node {
    Aabb box;
    std::int32_t parent = -1;
    std::int32_t left = -1, right = -1;
    Speed speed;
  };
  Node& node(std::int32_t i) { return nodes_[static_cast<std::size_t>(i)]; }
  bool leaf(std::int32_t i) const { return i < count_; }
  std::int32_t build(std::vector<std::int32_t>::iterator begin, std::vector<std::int32_t>::iterator end);
  void insert(std::int32_t component);
  void remove(std::int32_t component);
  void refit(std::int32_t i);

  std::int32_t count_;
  std::int32_t root_ = -1;
  std::vector<Node> nodes_;
  std::vector<std::int32_t> free_;  ///< inner nodes not in use
  std::vector<std::int32_t> stack_;
};

}  // namespace takt
