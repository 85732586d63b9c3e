#pragma once
// Watches the distances of all checked pairs while a cell runs, and tells when one falls below its limit.
//
// Looked at are the instants between steps. A pair whose distance was found to be d cannot be closer than its
// limit before its bodies have moved by d - limit together, so it is left alone until then: each body adds up
// a bound of the path of its points (translation, and rotation times reach), each pair waits for a length of
// both paths. When that is used up, the motion of one body as seen from the other is looked at, which is much
// less for links of one arm that sweeps. Only then a distance is asked for: in most steps none. What is told
// is the same, bit for bit, as if all pairs were asked in every step (`ask_always`).
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "plant_models/plant_model.h"
#include "server/contact/clearance/clearance_model.h"
#include "server/contact/holding/component_interaction.h"

namespace takt {

class StateReader;
class StateWriter;

struct ClearanceCounts {
  std::uint64_t pairs_asked = 0;  ///< pairs whose poses were looked at
  std::uint64_t distances = 0;    ///< distances of two convex shapes computed for them
};

class ClearanceMonitor {
 public:
  /// Overlaps less deep than this (m) are touching: jaws that hold, parts that were just released. Of pairs
  /// that say nothing else.
  static constexpr double kTouching_m = CheckedPair{}.touching_m;

  /// `model` must outlive the monitor. `base_poses`: X_WR by robot.
  ClearanceMonitor(const ClearanceModel& model, std::vector<Pose> base_poses, std::size_t component_count,
                   bool ask_always = false);

  /// As if nothing had been looked at, and no Part were held.
  void reset();

  /// Which pairs are open, since when, and who holds whom; not what is known of distances, which is asked
  /// anew. load() throws StateError, and leaves a monitor that must be reset or thrown away.
  void save(StateWriter& out) const;
  void load(StateReader& in);

  /// Pairs of components that act by surface contact from the next update on. Where one of the two is a Part,
  /// they are meant to touch and press: of a Gripper and a Part nothing is told, of a Part and a Part or
  /// Ground what is deeper than the layer that gives way.
  void set_by_contact(std::span<const std::pair<int, int>> components);

  /// Brings events() up to date for an instant. `moved`: components that may have moved since the last call;
  /// `changes`: Parts whose partner has changed since. Does not allocate.
  void update(double time_s, std::uint64_t step, const CellMotion& motion, std::span<const int> moved,
              std::span<const PartnerChange> changes);

  /// Of the last update, ordered by pair.
  std::span<const CollisionEvent> events() const { return events_; }
  const ClearanceCounts& counts() const { return counts_; }
  /// Pairs that are at present closer than their limit.
  std::size_t open_pairs() const { return open_pairs_; }

 private:
  struct Body {
    Pose X;               ///< of a component in W, of a link in its robot's base
    ShapeBounds bounds;   ///< of its shapes
    double path_m = 0.0;  ///< no point of the body has moved further since the reset
    double wake_m = 0.0;  ///< some pair must be looked at when `path_m` reaches this
    std::vector<int> pairs;
  };
  struct Pair {
    double asked_spare_m = 0.0;  ///< what the two could move when the distance was last asked
    Pose X_LS;                   ///< at that time: of the body of shorter reach as seen from the other
    double path_a_m = 0.0, path_b_m = 0.0;  ///< paths at the last look
    double spare_m = 0.0;                   ///< what both may move together from there
    double wake_a_m = 0.0, wake_b_m = 0.0;  ///< to be looked at when a path reaches this
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
  void tell(CollisionEvent::Kind kind, int pair, double distance_m, const Vec3& p_W, const Instant& now);
  void wait(int pair);
  bool held_by_own_gripper(const CheckedPair& pair) const;
  bool held_together(const CheckedPair& pair) const;
  double touching_m(std::size_t pair) const;
  BodyDistance measure(std::size_t pair) const;
  Pose pose_in_world(int body) const;

  const ClearanceModel& model_;
  std::vector<Pose> base_poses_;
  bool ask_always_;
  std::vector<Body> bodies_;
  std::vector<Pair> pairs_;
  std::vector<char> by_contact_;         ///< by pair; kept by a reset
  bool changed_ = false;                 ///< since the last update
  std::vector<int> body_of_component_;   ///< or -1
  std::vector<int> links_;               ///< bodies that are moving links, by robot
  std::vector<int> robot_of_component_;  ///< grippers: the robot that carries them; else -1
  std::vector<int> partner_;             ///< by component: what the Part hangs on, or -1
  std::vector<int> woken_;
  std::vector<CollisionEvent> events_;
  ClearanceCounts counts_;
  std::uint64_t updates_ = 0;
  std::size_t open_pairs_ = 0;
};

}  // namespace takt
