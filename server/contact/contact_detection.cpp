#include "server/contact/contact_detection.h"

#include <utility>

namespace takt {

CollisionWorld::CollisionWorld(const std::vector<Component>& components, double margin_m)
    : margin_(margin_m) {
  entries_.resize(components.size());
  for (std::size_t i = 0; i < components.size(); ++i) {
    entries_[i].shapes = components[i].convex;
    entries_[i].box = components[i].box;
    refresh(entries_[i]);
  }
}

void CollisionWorld::refresh(Entry& entry) const {
  entry.aabb = entry.box.at(entry.X_WB, 0.5 * margin_);
  ++entry.version;
}

void CollisionWorld::set_shape(int component, ConvexShape shape) {
  Entry& entry = entries_[static_cast<std::size_t>(component)];
  entry.box = shape.box;
  entry.shapes.assign(1, std::move(shape));
  refresh(entry);
}

void CollisionWorld::set_box(int component, const Vec3& lower_B, const Vec3& upper_B) {
  Entry& entry = entries_[static_cast<std::size_t>(component)];
  ConvexShape& shape = entry.shapes.front();
  if (shape.vertices.front() == lower_B && shape.vertices.back() == upper_B) return;
  shape.become_box(lower_B, upper_B);
  entry.box = shape.box;
  refresh(entry);
}

void CollisionWorld::set_pose(int component, const Pose& X_WB) {
  Entry& entry = entries_[static_cast<std::size_t>(component)];
  if (entry.X_WB == X_WB) return;
  entry.X_WB = X_WB;
  refresh(entry);
}

bool CollisionWorld::shapes_overlap(int a, int b, std::uint64_t& calls) const {
  const Entry& A = entries_[static_cast<std::size_t>(a)];
  const Entry& B = entries_[static_cast<std::size_t>(b)];
  const bool many = A.shapes.size() * B.shapes.size() > 1;
  for (const ConvexShape& shape_a : A.shapes) {
    const Aabb box_a = many ? shape_a.box.at(A.X_WB, margin_) : A.aabb;
    if (many && !box_a.overlaps(B.aabb)) continue;
    for (const ConvexShape& shape_b : B.shapes) {
      if (many && !box_a.overlaps(shape_b.box.at(B.X_WB, 0.0))) continue;
      ++calls;
      if (convex_overlap(shape_a, A.X_WB, shape_b, B.X_WB, margin_)) return true;
    }
  }
  return false;
}

bool CollisionWorld::overlaps_at(int a, const Pose& X_WA, int b, std::uint64_t& calls) const {
  const Entry& A = entries_[static_cast<std::size_t>(a)];
  const Entry& B = entries_[static_cast<std::size_t>(b)];
  for (const ConvexShape& shape_a : A.shapes) {
    const Aabb box_a = shape_a.box.at(X_WA, 0.0);
    for (const ConvexShape& shape_b : B.shapes) {
      if (!box_a.overlaps(shape_b.box.at(B.X_WB, 0.0))) continue;
      ++calls;
      if (convex_overlap(shape_a, X_WA, shape_b, B.X_WB, 0.0)) return true;
    }
  }
  return false;
}

void update_verdict(const CollisionWorld& world, int base, int target, PairVerdict& verdict,
                    DetectionCounts& counts) {
  const std::uint64_t version_base = world.version(base);
  const std::uint64_t version_target = world.version(target);
  if (verdict.version_base == version_base && verdict.version_target == version_target) {
    counts.mpr_skipped += verdict.calls;
    return;
  }
  verdict.version_base = version_base;
  verdict.version_target = version_target;
  verdict.calls = 0;
  ++counts.broad_phase_tests;
  verdict.touching = world.boxes_overlap(base, target) && world.shapes_overlap(base, target, verdict.calls);
  counts.mpr_calls += verdict.calls;
}

}  // namespace takt
