#include "server/geometry/convex/shape_tree.h"

#include <algorithm>
#include <numeric>

namespace takt {

ShapeTree::ShapeTree(const std::vector<ConvexShape>& shapes) {
  if (shapes.empty()) return;
  std::vector<std::int32_t> order(shapes.size());
  std::iota(order.begin(), order.end(), 0);
  nodes_.reserve(2 * shapes.size() - 1);
  build(shapes, order.begin(), order.end());
}

std::int32_t ShapeTree::build(const std::vector<ConvexShape>& shapes,
                              std::vector<std::int32_t>::iterator begin,
                              std::vector<std::int32_t>::iterator end) {
  const auto box_of = [&shapes](std::int32_t i) -> const BodyBox& {
    return shapes[static_cast<std::size_t>(i)].box;
  };
  Vec3 lower = box_of(*begin).center_B - box_of(*begin).half_B;
  Vec3 upper = box_of(*begin).center_B + box_of(*begin).half_B;
  for (auto i = begin; i != end; ++i) {
    lower = lower.cwiseMin(box_of(*i).center_B - box_of(*i).half_B);
    upper = upper.cwiseMax(box_of(*i).center_B + box_of(*i).half_B);
  }
  const auto index = static_cast<std::int32_t>(nodes_.size());
  Node node;
  node.box.center_B = 0.5 * (lower + upper);
  node.box.half_B = 0.5 * (upper - lower);
  nodes_.push_back(node);
  if (end - begin == 1) {
    nodes_.back().shape = *begin;
    return index;
  }
  int axis = 0;
  node.box.half_B.maxCoeff(&axis);
  // Equal centres: by number, so that one set of shapes has one tree.
  const auto middle = begin + (end - begin) / 2;
  std::nth_element(begin, middle, end, [&](std::int32_t a, std::int32_t b) {
    const double ca = box_of(a).center_B[axis], cb = box_of(b).center_B[axis];
    return ca != cb ? ca < cb : a < b;
  });
  build(shapes, begin, middle);
  const std::int32_t second = build(shapes, middle, end);
  nodes_[static_cast<std::size_t>(index)].second = second;
  return index;
}

}  // namespace takt
