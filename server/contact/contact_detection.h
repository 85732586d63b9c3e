#pragma once
// Which components touch: broad phase by boxes, then Minkowski Portal Refinement on all combinations of
// convex parts (thesis 4.2, Fig. 4.3). A pair of which neither side moved since its last test keeps its
// verdict (thesis 4.5).
#include <cstdint>
#include <vector>

#include "plant_models/plant_model.h"
#include "server/components/component.h"
#include "server/geometry/aabb.h"

namespace takt {

struct DetectionCounts {
  std::uint64_t broad_phase_tests = 0;
  std::uint64_t mpr_calls = 0;
  std::uint64_t mpr_skipped = 0;  ///< calls that repeating the last test of an unmoved pair would have made
};

/// Shape and pose of every component as the collision check sees it at one time. A component's version
/// changes whenever its pose or shape does, bit for bit.
class CollisionWorld {
 public:
  explicit CollisionWorld(const std::vector<Component>& components, double margin_m);

  /// Shape of a component whose geometry changes with time (the grasp volume between a gripper's jaws).
  void set_shape(int component, ConvexShape shape);
  /// Changes only the bounds of a box-shaped component, without allocation.
  void set_box(int component, const Vec3& lower_B, const Vec3& upper_B);
  void set_pose(int component, const Pose& X_WB);

  std::uint64_t version(int component) const { return entries_[static_cast<std::size_t>(component)].version; }
  bool boxes_overlap(int a, int b) const {
    return entries_[static_cast<std::size_t>(a)].aabb.overlaps(entries_[static_cast<std::size_t>(b)].aabb);
  }
  /// All combinations of convex parts until one overlaps; `calls` counts the MPR calls made.
  bool shapes_overlap(int a, int b, std::uint64_t& calls) const;
  /// The same for component `a` at another pose and without margin (jaws looking ahead).
  bool overlaps_at(int a, const Pose& X_WA, int b, std::uint64_t& calls) const;
  double margin() const { return margin_; }

 private:
  struct Entry {
    std::vector<ConvexShape> shapes;
    BodyBox box;
    Pose X_WB;
    Aabb aabb;  ///< grown by half the margin: boxes overlap when the gap is at most the margin
    std::uint64_t version = 1;
  };
  void refresh(Entry& entry) const;
  double margin_;
  std::vector<Entry> entries_;
};

/// The verdict of one pair, kept as long as neither side moves.
struct PairVerdict {
  std::uint64_t version_base = 0, version_target = 0;
  std::uint64_t calls = 0;
  bool touching = false;
};

/// Brings the verdict up to date.
void update_verdict(const CollisionWorld& world, int base, int target, PairVerdict& verdict,
                    DetectionCounts& counts);

}  // namespace takt
