#include "server/contact/collision/collision_world.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace takt {
namespace {

std::uint64_t mixed(std::uint64_t z) {
  z = (z ^ z >> 30U) * 0xBF58476D1CE4E5B9ULL;
  return z ^ z >> 32U;
}

std::uint64_t both(std::int32_t first, std::int32_t second) {
  return static_cast<std::uint64_t>(static_cast<std::uint32_t>(first)) << 32U |
         static_cast<std::uint32_t>(second);
}

}  // namespace

DetectionCounts& DetectionCounts::operator+=(const DetectionCounts& other) {
  broad_phase_tests += other.broad_phase_tests;
  mpr_calls += other.mpr_calls;
  mpr_skipped += other.mpr_skipped;
  answered.by_hint += other.answered.by_hint;
  answered.by_search += other.answered.by_search;
  answered.by_mpr += other.answered.by_mpr;
  return *this;
}

CollisionWorld::CollisionWorld(const std::vector<Component>& components, double margin_m, bool remember)
    : margin_(margin_m), remember_(remember) {
  entries_.resize(components.size());
  moved_.reserve(components.size());
  std::size_t shapes = 0;
  for (std::size_t i = 0; i < components.size(); ++i) {
    entries_[i].parts = components[i].convex;
    entries_[i].box = components[i].convex.box();
    entries_[i].radius = entries_[i].box.half_B.norm();
    refresh(static_cast<int>(i));
    shapes += components[i].convex.size();
  }
  hints_.resize(std::bit_ceil(std::clamp<std::size_t>(16 * shapes, 64 * kHintLanes, 32768)));
}

void CollisionWorld::refresh(int component) {
  Entry& e = entry(component);
  e.aabb = e.box.at(e.X_WB, 0.5 * margin_);
  ++e.version;
  if (e.moved) return;
  e.moved = true;
  moved_.push_back(component);
}

void CollisionWorld::clear_moved() {
  for (const int component : moved_) entry(component).moved = false;
  moved_.clear();
}

void CollisionWorld::set_shape(int component, ConvexShape shape) {
  Entry& e = entry(component);
  e.box = shape.box;
  e.radius = shape.radius;
  e.own.assign(1, std::move(shape));
  e.own_tree = ShapeTree(e.own);
  ++e.shape_version;
  refresh(component);
}

void CollisionWorld::set_box(int component, const Vec3& lower_B, const Vec3& upper_B) {
  Entry& e = entry(component);
  ConvexShape& shape = e.own.front();
  if (shape.vertices.front() == lower_B && shape.vertices.back() == upper_B) return;
  shape.become_box(lower_B, upper_B);
  e.own_tree.update_single(shape.box);
  e.box = shape.box;
  e.radius = shape.radius;
  ++e.shape_version;
  refresh(component);
}

bool CollisionWorld::set_pose(int component, const Pose& X_WB) {
  Entry& e = entry(component);
  if (e.X_WB == X_WB) return true;
  if (!is_finite(X_WB)) return false;
  e.X_WB = X_WB;
  refresh(component);
  return true;
}

std::size_t CollisionWorld::hint_lane(int a) {
  // Neighbours in number are often neighbours in place: their shared data stays in one core's cache.
  return (static_cast<std::size_t>(a) / 4) % kHintLanes;
}

ConvexHint& CollisionWorld::hint(const HintKey& key) {
  const std::uint64_t z = mixed(both(key.a, key.b) ^ both(key.shape_a, key.shape_b) * 0x9E3779B97F4A7C15ULL);
  const std::size_t lane_size = hints_.size() / kHintLanes;
  Hint& slot = hints_[hint_lane(key.a) * lane_size + (static_cast<std::size_t>(z) & (lane_size - 1))];
  if (!(slot.key == key)) slot = {key, {}};
  return slot.hint;
}

bool CollisionWorld::overlap(int a, const Pose& X_WA, int b, double margin, DetectionCounts& counts) {
  const Entry& A = entry(a);
  const Entry& B = entry(b);
  const auto overlap_of = [&](std::int32_t i, std::int32_t j) {
    const ConvexShape& shape_a = A.shapes()[static_cast<std::size_t>(i)];
    const ConvexShape& shape_b = B.shapes()[static_cast<std::size_t>(j)];
    ++counts.mpr_calls;
    if (!remember_) {
      ++counts.answered.by_mpr;
      return convex_overlap(shape_a, X_WA, shape_b, B.X_WB, margin);
    }
    ConvexHint& remembered = hint({a, b, i, j, A.shape_version, B.shape_version});
    return convex_overlap(shape_a, X_WA, shape_b, B.X_WB, margin, remembered, counts.answered);
  };
  if (A.shapes().size() == 1 && B.shapes().size() == 1) return overlap_of(0, 0);
  const Mat3 R_AW = X_WA.R.transpose();
  const Pose X_AB{R_AW * B.X_WB.R, R_AW * (B.X_WB.p - X_WA.p)};
  // convex_overlap() counts distances slightly above the margin as touching: boxes must not exclude them.
  return A.tree().any_near(B.tree(), X_AB, margin + 1e-7 * (A.radius + B.radius + margin), overlap_of);
}

bool CollisionWorld::shapes_overlap(int a, int b, DetectionCounts& counts) {
  return overlap(a, entry(a).X_WB, b, margin_, counts);
}

bool CollisionWorld::overlaps_at(int a, const Pose& X_WA, int b, DetectionCounts& counts) {
  const Entry& A = entry(a);
  const Entry& B = entry(b);
  if (!A.box.at(X_WA, 0.0).overlaps(B.box.at(B.X_WB, 0.0))) return false;
  return overlap(a, X_WA, b, 0.0, counts);
}

bool CollisionWorld::touches_at(int a, const Pose& X_WA, int b, DetectionCounts& counts) {
  if (!entry(a).box.at(X_WA, 0.5 * margin_).overlaps(entry(b).aabb)) return false;
  return overlap(a, X_WA, b, margin_, counts);
}

bool begin_verdict(const CollisionWorld& world, int base, int target, PairVerdict& verdict,
                   DetectionCounts& counts) {
  const std::uint64_t version_base = world.version(base);
  const std::uint64_t version_target = world.version(target);
  if (verdict.version_base == version_base && verdict.version_target == version_target) return false;
  verdict.version_base = version_base;
  verdict.version_target = version_target;
  verdict.touching = false;
  verdict.calls = 0;
  ++counts.broad_phase_tests;
  return true;
}

void query_verdict(CollisionWorld& world, int base, int target, PairVerdict& verdict,
                   DetectionCounts& counts) {
  const std::uint64_t before = counts.mpr_calls;
  verdict.touching = world.shapes_overlap(base, target, counts);
  verdict.calls = counts.mpr_calls - before;
}

bool update_verdict(CollisionWorld& world, int base, int target, PairVerdict& verdict,
                    DetectionCounts& counts) {
  if (!begin_verdict(world, base, target, verdict, counts)) return false;
  if (world.boxes_overlap(base, target)) query_verdict(world, base, target, verdict, counts);
  return true;
}

}  // namespace takt
