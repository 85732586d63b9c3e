#pragma once
// Contacts of components: broad phase by boxes, then Minkowski Portal Refinement on all combinations of
// convex parts (thesis 4.2, Fig. 4.3). A pair without motion since its last test keeps its verdict (thesis
// 4.5); small motions are mostly answered from hints (geometry/convex/query.h), and a hierarchy of boxes
// excludes combinations of distant convex parts (thesis 6.2). These shortcuts change no verdict.
#include <cstdint>
#include <vector>

#include "plant_models/plant_model.h"
#include "server/components/component.h"
#include "server/geometry/aabb.h"
#include "server/geometry/convex/query.h"

namespace takt {

struct DetectionCounts {
  std::uint64_t broad_phase_tests = 0;
  std::uint64_t mpr_calls = 0;    ///< queries of pairs of convex parts, by any method
  std::uint64_t mpr_skipped = 0;  ///< calls that repeating the last test of an unmoved pair would have made
  QueryCounts answered;           ///< number by method

  DetectionCounts& operator+=(const DetectionCounts& other);
};

/// Shape and pose of every component for the collision check. A component's version changes with every change
/// of its pose or shape, bit for bit.
class CollisionWorld {
 public:
  /// `remember`: use hints of earlier queries. The verdicts are the same.
  CollisionWorld(const std::vector<Component>& components, double margin_m, bool remember = true);

  /// Shape of a component whose geometry changes with time (the grasp volume between a gripper's jaws).
  void set_shape(int component, ConvexShape shape);
  /// Changes only the bounds of a box-shaped component, without allocation.
  void set_box(int component, const Vec3& lower_B, const Vec3& upper_B);
  /// False for a pose that is not finite; the component then keeps its pose.
  bool set_pose(int component, const Pose& X_WB);

  std::uint64_t version(int component) const { return entry(component).version; }
  const Aabb& aabb(int component) const { return entry(component).aabb; }
  /// Bounds of a component at another pose.
  Aabb aabb_at(int component, const Pose& X_WB) const { return entry(component).box.at(X_WB, margin_); }
  bool boxes_overlap(int a, int b) const { return entry(a).aabb.overlaps(entry(b).aabb); }
  /// Tests combinations of convex parts until one overlaps; counts the calls.
  bool shapes_overlap(int a, int b, DetectionCounts& counts);
  /// The same for component `a` at another pose and without margin (look-ahead of jaws).
  bool overlaps_at(int a, const Pose& X_WA, int b, DetectionCounts& counts);
  /// With margin: whether component `a` at another pose touches `b`.
  bool touches_at(int a, const Pose& X_WA, int b, DetectionCounts& counts);
  double margin() const { return margin_; }
  const std::vector<ConvexShape>& shapes(int component) const { return entry(component).shapes(); }
  const Pose& pose(int component) const { return entry(component).X_WB; }

  /// Hints of pairs are stored in this many lanes, by pair. Different threads may treat pairs of different
  /// lanes at the same time, but not those of one lane.
  static constexpr std::size_t kHintLanes = 16;
  static std::size_t hint_lane(int a);

  /// Components whose version changed since the last clear_moved(), each once, in the order of their change.
  const std::vector<int>& moved() const { return moved_; }
  void clear_moved();

 private:
  struct Entry {
    ConvexParts parts;
    /// In place of `parts` where the geometry changes with time.
    std::vector<ConvexShape> own;
    ShapeTree own_tree;
    BodyBox box;
    double radius = 0.0;  ///< half diagonal of `box`
    Pose X_WB;
    Aabb aabb;  ///< grown by half the margin: boxes overlap when the gap is at most the margin
    std::uint64_t version = 1;
    std::uint32_t shape_version = 1;
    bool moved = false;

    const std::vector<ConvexShape>& shapes() const { return own.empty() ? parts.shapes() : own; }
    const ShapeTree& tree() const { return own.empty() ? parts.tree() : own_tree; }
  };
  /// The pair of a hint.
  struct HintKey {
    std::int32_t a = -1, b = -1, shape_a = -1, shape_b = -1;
    std::uint32_t version_a = 0, version_b = 0;
    bool operator==(const HintKey&) const = default;
  };
  struct Hint {
    HintKey key;
    ConvexHint hint;
  };
  const Entry& entry(int component) const { return entries_[static_cast<std::size_t>(component)]; }
  Entry& entry(int component) { return entries_[static_cast<std::size_t>(component)]; }
  void refresh(int component);
  bool overlap(int a, const Pose& X_WA, int b, double margin, DetectionCounts& counts);
  ConvexHint& hint(const HintKey& key);

  double margin_;
  bool remember_;
  std::vector<Entry> entries_;
  std::vector<int> moved_;
  /// By lane, then one slot per hash; a newer pair replaces an older one. A lost hint costs time, never a
  /// verdict.
  std::vector<Hint> hints_;
};

/// The verdict of one pair, kept as long as neither side moves.
struct PairVerdict {
  std::uint64_t version_base = 0, version_target = 0;
  std::uint64_t calls = 0;
  bool touching = false;
};

/// False if neither side moved since the verdict; else the verdict must be updated for the present poses:
bool begin_verdict(const CollisionWorld& world, int base, int target, PairVerdict& verdict,
                   DetectionCounts& counts);
/// by a query of the convex parts if the boxes overlap. Other pairs are apart without a call.
void query_verdict(CollisionWorld& world, int base, int target, PairVerdict& verdict,
                   DetectionCounts& counts);
/// Both steps; false if neither side had moved.
bool update_verdict(CollisionWorld& world, int base, int target, PairVerdict& verdict,
                    DetectionCounts& counts);

}  // namespace takt
