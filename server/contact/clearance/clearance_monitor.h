#pragma once
// Watches the distances of all checked pairs while a cell runs, and reports when one falls below its limit.
//
// It checks the instants between steps. A pair at distance d cannot fall below its limit until its bodies
// have moved by d - limit together, so it is skipped until then: each body sums a bound of the path of its
// points (translation, and rotation times reach), and each pair waits for a length of both paths. After that
// the monitor evaluates the motion of one body relative to the other, which is much shorter for links of one
// sweeping arm. Only then it computes a distance: in most steps none is computed. The events are the same,
// bit for bit, as with all pairs computed in every step (`ask_always`).
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "plant_models/plant_model.h"
#include "server/components/pair_table.h"
#include "server/contact/clearance/clearance_model.h"
#include "server/contact/holding/component_interaction.h"

namespace takt {

class StateReader;
class StateWriter;

struct ClearanceCounts {
  std::uint64_t pairs_asked = 0;  ///< pairs whose poses were evaluated
  std::uint64_t distances = 0;    ///< distances of two convex shapes computed for them
};

class ClearanceMonitor {
 public:
  /// Default of the depth (m) up to which overlaps count as touching: jaws that hold, parts just released.
  static constexpr double kTouching_m = CheckedPair{}.touching_m;

  /// `model` must outlive the monitor. `base_poses`: X_WR by robot; std::nullopt for a base that moves.
  ClearanceMonitor(const ClearanceModel& model, std::vector<std::optional<Pose>> base_poses,
                   std::size_t component_count, bool ask_always = false);

  /// Resets to the initial state: no distances, no held Parts.
  void reset();

  /// Saves the open pairs with their times, and the holders; distances are computed again. load() throws
  /// StateError, and the monitor must then be reset or discarded.
  void save(StateWriter& out) const;
  void load(StateReader& in);

  /// Sets the pairs of components that act by surface contact from the next update on. Such pairs with a Part
  /// may press on each other: for a Gripper and a Part there are no events, for a Part and a Part or Ground
  /// there are events for depths beyond the elastic layer.
  void set_by_contact(const PairPredicate& acts);

  /// Updates events() for an instant. `moved`: components that may have moved since the last call; `changes`:
  /// Parts with a change of partner after it. Does not allocate.
  void update(double time_s, std::uint64_t step, const CellMotion& motion, std::span<const int> moved,
              std::span<const PartnerChange> changes);

  /// Events of the last update, ordered by pair.
  std::span<const CollisionEvent> events() const { return events_; }
  const ClearanceCounts& counts() const { return counts_; }
  /// Number of pairs closer than their limit.
  std::size_t open_pairs() const { return open_pairs_; }

 private:
  struct Body {
    Pose X;               ///< of a component in W, of a link in its robot's base, or in W where this moves
    ShapeBounds bounds;   ///< of its shapes
    double path_m = 0.0;  ///< upper bound of the path of the body's points since the reset
    double wake_m = 0.0;  ///< at this `path_m` a pair is due
    std::vector<int> pairs;
  };
  struct Pair {
    double asked_spare_m = 0.0;  ///< permitted motion of the pair at the last computed distance
    Pose X_LS;                   ///< pose at that time of the body of shorter reach relative to the other
    double path_a_m = 0.0, path_b_m = 0.0;  ///< paths at the last evaluation
    double spare_m = 0.0;                   ///< permitted motion of both together from there
    double wake_a_m = 0.0, wake_b_m = 0.0;  ///< the pair is due when a path reaches its value
    std::uint64_t looked_at = 0;            ///< number of the update
    bool open = false, overlapping = false;
    double least_m = 0.0, since_s = 0.0;
    Vec3 least_p_W = Vec3::Zero();
  };
  struct Instant {
    double time_s;
    std::uint64_t step;
  };

  void advance(int body, const Pose& X);
  void wake(int body, const Instant& now);
  void look(int pair, const Instant& now, bool ask);
  void judge(int pair, const BodyDistance& found, const Instant& now);
  void close(int pair, const Instant& now);
  void report(CollisionEvent::Kind kind, int pair, double distance_m, const Vec3& p_W, const Instant& now);
  void wait(int pair);
  bool held_by_own_gripper(const CheckedPair& pair) const;
  bool held_together(const CheckedPair& pair) const;
  double touching_m(std::size_t pair) const;
  BodyDistance measure(std::size_t pair) const;
  Pose pose_in_world(int body) const;
  bool rides(const CheckedBody& body) const {
    return body.robot >= 0 && !base_poses_[static_cast<std::size_t>(body.robot)];
  }

  const ClearanceModel& model_;
  std::vector<std::optional<Pose>> base_poses_;
  bool ask_always_;
  std::vector<Body> bodies_;
  std::vector<Pair> pairs_;
  std::vector<char> by_contact_;         ///< by pair; kept by a reset
  bool changed_ = false;                 ///< since the last update
  std::vector<int> body_of_component_;   ///< or -1
  std::vector<int> links_;               ///< bodies that are moving links, by robot
  std::vector<int> robot_of_component_;  ///< grippers: the robot that carries them; else -1
  std::vector<int> partner_;             ///< by component: the holder of the Part, or -1
  std::vector<int> woken_;
  std::vector<CollisionEvent> events_;
  ClearanceCounts counts_;
  std::uint64_t updates_ = 0;
  std::size_t open_pairs_ = 0;
};

}  // namespace takt
