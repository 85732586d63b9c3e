#include "server/geometry/broad_phase.h"

#include <algorithm>
#include <numeric>

namespace takt {
namespace {

constexpr double kGrowth = 0.05;  // of the diagonal, on every side

Aabb grown(const Aabb& box) {
  const Vec3 by = Vec3::Constant(kGrowth * (box.upper - box.lower).norm());
  return {box.lower - by, box.upper + by};
}

Aabb united(const Aabb& a, const Aabb& b) {
  return {a.lower.cwiseMin(b.lower), a.upper.cwiseMax(b.upper)};
}

bool contains(const Aabb& outer, const Aabb& inner) {
  return (outer.lower.array() <= inner.lower.array()).all() &&
         (outer.upper.array() >= inner.upper.array()).all();
}

BroadPhase::Speed larger(const BroadPhase::Speed& a, const BroadPhase::Speed& b) {
  return {std::max(a.linear_m_per_s, b.linear_m_per_s), std::max(a.angular_rad_per_s, b.angular_rad_per_s),
          std::max(a.radius_m, b.radius_m)};
}

double area(const Aabb& box) {
  const Vec3 s = box.upper - box.lower;
  return s.x() * s.y() + s.y() * s.z() + s.z() * s.x();
}

}  // namespace

BroadPhase::BroadPhase(std::size_t component_count)
    : count_(static_cast<std::int32_t>(component_count)), nodes_(2 * component_count) {
  free_.reserve(component_count);
  stack_.reserve(nodes_.size());
}

void BroadPhase::build(std::span<const Aabb> boxes) {
  free_.clear();
  for (auto i = static_cast<std::int32_t>(nodes_.size()) - 1; i >= count_; --i) free_.push_back(i);
  for (std::int32_t i = 0; i < count_; ++i) {
    node(i) = {};
    node(i).box = grown(boxes[static_cast<std::size_t>(i)]);
  }
  std::vector<std::int32_t> order(static_cast<std::size_t>(count_));
  std::iota(order.begin(), order.end(), 0);
  root_ = order.empty() ? -1 : build(order.begin(), order.end());
  if (root_ >= 0) node(root_).parent = -1;
}

std::int32_t BroadPhase::build(std::vector<std::int32_t>::iterator begin,
                               std::vector<std::int32_t>::iterator end) {
  if (end - begin == 1) return *begin;
  Aabb all = node(*begin).box;
  for (auto i = begin; i != end; ++i) all = united(all, node(*i).box);
  int axis = 0;
  (all.upper - all.lower).maxCoeff(&axis);
  const auto middle = begin + (end - begin) / 2;
  std::nth_element(begin, middle, end, [&](std::int32_t a, std::int32_t b) {
    const double ca = node(a).box.lower[axis] + node(a).box.upper[axis];
    const double cb = node(b).box.lower[axis] + node(b).box.upper[axis];
    return ca != cb ? ca < cb : a < b;
  });
  const std::int32_t index = free_.back();
  free_.pop_back();
  const std::int32_t left = build(begin, middle);
  const std::int32_t right = build(middle, end);
  node(index) = {all, -1, left, right, {}};
  node(left).parent = node(right).parent = index;
  return index;
}

bool BroadPhase::update(int component, const Aabb& box) {
  if (contains(node(component).box, box)) return false;
  remove(component);
  node(component).box = grown(box);
  insert(component);
  return true;
}

void BroadPhase::refit(std::int32_t i) {
  for (; i >= 0; i = node(i).parent) {
    const Node &left = node(node(i).left), &right = node(node(i).right);
    node(i).box = united(left.box, right.box);
    node(i).speed = larger(left.speed, right.speed);
  }
}

void BroadPhase::set_speed(int component, const Speed& speed) {
  if (node(component).speed == speed) return;
  node(component).speed = speed;
  for (std::int32_t i = node(component).parent; i >= 0; i = node(i).parent) {
    const Speed of_both = larger(node(node(i).left).speed, node(node(i).right).speed);
    if (node(i).speed == of_both) return;
    node(i).speed = of_both;
  }
}

void BroadPhase::remove(std::int32_t component) {
  const std::int32_t parent = node(component).parent;
  if (parent < 0) {
    root_ = -1;
    return;
  }
  const std::int32_t sibling = node(parent).left == component ? node(parent).right : node(parent).left;
  const std::int32_t above = node(parent).parent;
  node(sibling).parent = above;
  free_.push_back(parent);
  if (above < 0) {
    root_ = sibling;
    return;
  }
  (node(above).left == parent ? node(above).left : node(above).right) = sibling;
  refit(above);
}

void BroadPhase::insert(std::int32_t component) {
  node(component).parent = -1;
  if (root_ < 0) {
    root_ = component;
    return;
  }
  // Down to where the boxes on the way grow least.
  const Aabb& box = node(component).box;
  std::int32_t at = root_;
  while (!leaf(at)) {
    const double here = area(united(node(at).box, box));
    const double inherited = here - area(node(at).box);
    const auto cost = [&](std::int32_t child) {
      const double together = area(united(node(child).box, box));
      return inherited + (leaf(child) ? together : together - area(node(child).box));
    };
    const double left = cost(node(at).left);
    const double right = cost(node(at).right);
    if (here < left && here < right) break;
    at = left <= right ? node(at).left : node(at).right;
  }
  const std::int32_t above = node(at).parent;
  const std::int32_t parent = free_.back();
  free_.pop_back();
  node(parent) = {united(node(at).box, box), above, at, component,
                  larger(node(at).speed, node(component).speed)};
  node(at).parent = node(component).parent = parent;
  if (above < 0)
    root_ = parent;
  else
    (node(above).left == at ? node(above).left : node(above).right) = parent;
  refit(above);
}

}  // namespace takt
