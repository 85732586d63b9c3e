#include "server/geometry/box_tree.h"

#include <algorithm>
#include <numeric>

namespace takt {

BoxTree::BoxTree(const std::vector<Aabb>& boxes) {
  if (boxes.empty()) return;
  std::vector<std::int32_t> order(boxes.size());
  std::iota(order.begin(), order.end(), 0);
  nodes_.reserve(2 * boxes.size());
  build(boxes, order.begin(), order.end());
}

std::int32_t BoxTree::build(const std::vector<Aabb>& boxes, std::vector<std::int32_t>::iterator begin,
                            std::vector<std::int32_t>::iterator end) {
  const auto index = static_cast<std::int32_t>(nodes_.size());
  nodes_.emplace_back();
  Aabb bounds = boxes[static_cast<std::size_t>(*begin)];
  Aabb centers{bounds.lower + bounds.upper, bounds.lower + bounds.upper};
  for (auto it = begin; it != end; ++it) {
    const Aabb& box = boxes[static_cast<std::size_t>(*it)];
    bounds.lower = bounds.lower.cwiseMin(box.lower);
    bounds.upper = bounds.upper.cwiseMax(box.upper);
    centers.lower = centers.lower.cwiseMin(box.lower + box.upper);
    centers.upper = centers.upper.cwiseMax(box.lower + box.upper);
  }
  // Half extents are rounded up a little so that no box sticks out of its node.
  const Vec3 half = 0.5 * (bounds.upper - bounds.lower);
  nodes_.back().box = {0.5 * (bounds.lower + bounds.upper),
                       half + Vec3::Constant(1e-15 + 1e-15 * half.maxCoeff())};
  if (end - begin == 1) {
    nodes_.back().thing = *begin;
    return index;
  }
  Eigen::Index axis = 0;
  (centers.upper - centers.lower).maxCoeff(&axis);
  const auto middle = begin + (end - begin) / 2;
  std::nth_element(begin, middle, end, [&](std::int32_t i, std::int32_t k) {
    const Aabb& a = boxes[static_cast<std::size_t>(i)];
    const Aabb& b = boxes[static_cast<std::size_t>(k)];
    const double left = a.lower[axis] + a.upper[axis], right = b.lower[axis] + b.upper[axis];
    return left != right ? left < right : i < k;
  });
  build(boxes, begin, middle);
  const std::int32_t second = build(boxes, middle, end);
  nodes_[static_cast<std::size_t>(index)].second = second;
  return index;
}

void BoxTree::label(const std::vector<std::int32_t>& labels) {
  // Children come after their node.
  for (std::size_t i = nodes_.size(); i-- > 0;) {
    Node& node = nodes_[i];
    if (node.thing >= 0) {
      node.label = labels[static_cast<std::size_t>(node.thing)];
      continue;
    }
    const std::int32_t one = nodes_[i + 1].label, other = nodes_[static_cast<std::size_t>(node.second)].label;
    node.label = one == other ? one : -1;
  }
}

}  // namespace takt
