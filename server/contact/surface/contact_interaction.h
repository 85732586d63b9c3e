#pragma once
// Surface contact between the components of a cell (level of detail 3): all pairs that may touch, their
// wrenches and their linearisation. Cost and memory follow the pairs that are near, not those that exist: a broad
// phase finds them, and a pair has a contact only while it is near and may move, or presses.
//
// update() and accept() are the discrete stage, called between accepted steps: they choose the near pairs and
// store the stick springs. A solver may call evaluate() and linearise() any number of times; their results
// depend only on the motion and the result of accept(), for any number of threads and with or without skipped
// calls (thesis 4.5).
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "plant_models/plant_model.h"
#include "server/components/component.h"
#include "server/contact/executor.h"
#include "server/contact/pair_linearisation.h"
#include "server/contact/surface/approach_search.h"
#include "server/contact/surface/contact_model.h"
#include "server/contact/surface/contact_pool.h"
#include "server/contact/surface/contact_sample.h"

namespace takt {

class StateReader;
class StateWriter;

class ContactInteraction {
 public:
  /// `components` and `model` must outlive this.
  ContactInteraction(const std::vector<Component>& components, const ContactModel& model);
  ~ContactInteraction();

  std::size_t pair_count() const { return model_.pairs.size(); }
  /// Sets the acting pairs at the present levels of detail. Pairs that become inactive lose their springs.
  void set_acting(const PairPredicate& acts);
  /// Of two components in either order.
  bool acting(int a, int b) const;
  bool any_acting() const { return acting_count_ > 0; }
  /// Whether a pair of this component acts.
  bool acts_on(int component) const { return degree_[static_cast<std::size_t>(component)] > 0; }

  void reset();
  /// Discards the springs and caches of all pairs of this component, after it was moved.
  void forget(int component);
  /// Saves springs and near pairs. Results of calls and candidate lists are not saved: they change no bit.
  /// Before load(), set_acting() must be called with the saved pairs; load() throws StateError, and the
  /// object must then be reset or discarded.
  void save(StateWriter& out) const;
  void load(StateReader& in);
  /// Discrete: selects pairs whose bounds could meet within `step_s` at about the present speeds, at least 10
  /// m/s. Evaluations visit these pairs alone.
  void update(const CellMotion& motion, double step_s);
  /// Longest step (s), up to `most_s`, in which no body passes through another unnoticed: in it no acting
  /// pair gets deeper than seven sixteenths of its Target's walls, nor moves further than a twentieth if it is deeper than a
  /// quarter.
  double seeing_step_s(const CellMotion& motion, double most_s);
  /// A pair of which one body is about to leave the other on its far side.
  struct Passing {
    int base = -1, target = -1;  ///< component ids; -1: no such pair
    double wall_m = 0.0, depth_m = 0.0;
    double speed_m_per_s = 0.0;  ///< of the base's centre relative to the target
  };
  /// Tests only pairs that an evaluation since the last call found deep.
  Passing passing(const CellMotion& motion);
  /// Discrete, at the start of a step of a solver of `next_s`: holds patches of pairs that may move
  /// (PolygonalContact::hold), until release().
  void hold(const CellMotion& motion, double next_s);
  void release();
  /// Discrete, at an accepted point, directly after evaluate_moving(): for read_peaks(). Without watch_peaks() nothing
  /// is noted.
  void note_peaks(const CellMotion& motion);
  void watch_peaks(bool watch) { watches_peaks_ = watch; }
  bool watches_peaks() const { return watches_peaks_; }
  /// Discrete, at an accepted point: springs of the stick law.
  void accept(const CellMotion& motion);

  /// Discrete: coefficients of friction that depend on temperatures (ContactPairModel::friction_at_K).
  void update_friction(std::span<const BodyHeat> heat);

  /// Before the first step: by component, the Grounds that may move, or whose surface may; empty: none.
  void set_movable_grounds(const std::vector<char>& movable) {
    movable_grounds_ = movable;
    set_asleep(asleep_);
  }
  /// Discrete: sets the sleeping components, which the system leaves out. Pairs of two immobile components
  /// keep their results.
  void set_asleep(const std::vector<char>& asleep);
  bool is_asleep(int component) const { return asleep_[static_cast<std::size_t>(component)] != 0; }
  /// Acting pairs that may meet and have a side that can move, ascending.
  std::span<PairContact* const> moving() const { return moving_; }
  /// Evaluations, linearisations and hold() visit these pairs alone, of the moving ones, with these components at their ends,
  /// until attend_all(). Both lists must last until then.
  void attend(std::span<PairContact* const> pairs, std::span<const int> ends) {
    attended_ = pairs, attended_ends_ = ends, attends_ = true;
  }
  void attend_all() { attends_ = false; }
  /// Number of near pairs beyond which update() allocates.
  std::size_t room() const { return near_.capacity(); }
  /// Of a component that acts.
  const ContactSurface& surface(int component) const {
    return *model_.surfaces[static_cast<std::size_t>(component)];
  }
  /// Whether the bounds of a pair, each grown by half of `margin_m`, meet.
  bool bounds_meet(const PairContact& pair, const CellMotion& motion, double margin_m) const {
    return !(gap_m(pair, motion) > margin_m);
  }
  /// No point of the component's surface is further from its origin (m); 0 without surface.
  double radius_m(int component) const { return approach_.radius_m(component); }

  /// Adds the wrenches of all acting pairs, about p_WBcm of each component, in the order of the pairs.
  void evaluate(const CellMotion& motion, std::span<Wrench> wrenches);
  /// The same for pairs that may move; sums of other components are undefined.
  void evaluate_moving(const CellMotion& motion, std::span<Wrench> wrenches);
  /// Appends the pairs that press and may move.
  void linearise(const CellMotion& motion, Linearisation linearisation,
                 std::vector<PairLinearisation>& pairs);

  /// Pairs with pressure at this motion, in the order of the pairs, up to the size of `samples`; returns
  /// their number. The call counters and the calls that a solver makes afterwards are unaffected.
  std::size_t read(const CellMotion& motion, std::span<ContactSample> samples);
  /// Adds the contact force on each component (N, by component), in the same way; of those that sleep, incomplete sums.
  void add_forces(const CellMotion& motion, std::span<Vec3> forces_W);
  /// The component that presses most upon this one, or -1.
  int heaviest_on(int component, const CellMotion& motion);
  /// All pairs with pressure; allocates if their number exceeds all earlier ones.
  void read(const CellMotion& motion, std::vector<ContactSample>& samples);
  /// Of all pairs that have pressed since the last update(), the largest normal forces: here, at a point of note_peaks(), or
  /// between such points (ForceHistory), where forces and pressure are those of the point before in proportion.
  void read_peaks(const CellMotion& motion, std::vector<ContactPeak>& peaks);
  std::vector<ElementPressure> pressures(std::size_t pair, const CellMotion& motion);
  /// The components that this component pushes along a direction (of length 1) at this motion, ascending: the
  /// pair exerts at least half of its force in that direction.
  void list_pushed(const CellMotion& motion, int component, const Vec3& direction_W,
                   std::vector<int>& others);

  ContactCallCounts counts() const;
  /// What is kept, for tests: it follows the near pairs.
  struct Size {
    std::size_t near_pairs = 0, contacts = 0, contacts_with_buffers = 0;
  };
  Size size() const { return {near_.size(), pool_.size(), pool_.with_buffers()}; }
  void set_executor(Executor* executor) { executor_ = executor; }

 private:
  struct Near {
    std::size_t number;  ///< of the pair
    int base, target;
    bool still;            ///< neither side can move
    PairContact* contact;  ///< nullptr: both sides lie still, and do not press
  };
  struct Work {
    ContactInteraction* self;
    const CellMotion* motion;
  };
  static const BodyMotion& body(const CellMotion& motion, int component) {
    return motion.bodies[static_cast<std::size_t>(component)];
  }
  /// Of a wrench about the target's origin in its axes; about the same point.
  static Wrench to_world(const Wrench& F_T, const Mat3& R_WT) { return {R_WT * F_T.f, R_WT * F_T.t}; }
  static void run_task(std::size_t task, void* context);
  void wake_all();
  void clear_near();
  void find_near(const CellMotion& motion, double step_s);
  void replace_moving();
  void take_contacts();
  void list_contacts();
  void settle(const CellMotion& motion);
  void count_apart();
  std::size_t pairs_among_counted() const;
  bool immobile(int component) const {
    const auto c = static_cast<std::size_t>(component);
    if (components_[c].type == ComponentType::ground)
      return movable_grounds_.empty() || movable_grounds_[c] == 0;
    return is_asleep(component);
  }
  std::span<PairContact* const> visited() const { return attends_ ? attended_ : std::span(moving_); }
  void evaluate_all(const CellMotion& motion);
  void add_wrenches(const PairContact& pair, const CellMotion& motion, std::span<Wrench> wrenches) const;
  void find_boxes(const CellMotion& motion);
  bool boxes_apart(const PairContact& pair) const;
  static ContactSample sample_of(const PairContact& pair, const ContactResult& result, const Pose& X_WT);
  void evaluate_near(PairContact& pair, const CellMotion& motion) const;
  void evaluate_pair(PairContact& pair, const CellMotion& motion) const;
  void look_at_pair(PairContact& pair, const CellMotion& motion) const;
  RelativeMotion motion_of(int base, int target, const CellMotion& motion) const;
  /// Between the bounds of a pair, along the axis on which they are furthest apart; negative: they meet.
  double gap_m(const PairContact& pair, const CellMotion& motion) const;
  /// No point of the Base is faster relative to the Target.
  double speed_m_per_s(int base, int target, const CellMotion& motion) const;

  const std::vector<Component>& components_;
  const ContactModel& model_;
  std::vector<char> acting_;  ///< by pair
  std::size_t acting_count_ = 0;
  std::vector<std::uint32_t> degree_;  ///< by component: its acting pairs
  std::vector<char> asleep_;           ///< by component
  std::vector<char> movable_grounds_;  ///< by component; or empty
  std::vector<int> mobile_;            ///< components that can move, ascending
  std::vector<char> counted_;          ///< by component, while pairs are counted
  std::vector<int> ends_;              ///< components of the moving pairs
  std::vector<char> listed_;           ///< by component: it is one of these
  std::vector<Aabb> boxes_;            ///< of these, world boxes at the motion of the last evaluation
  bool all_moved_ = true;              ///< places and bounds of all components must be set again
  bool unsettled_ = false;             ///< pairs have come to lie still
  std::size_t movable_count_ = 0;      ///< acting pairs with a side that can move
  bool movable_known_ = false;
  std::uint64_t boxes_apart_ = 0;
  std::uint64_t updates_ = 0;
  bool watches_peaks_ = false;
  ApproachSearch approach_;
  ContactPool pool_;
  std::vector<Near> near_;  ///< acting pairs that may meet, ascending; those asleep as of falling asleep
  std::vector<Near> found_, next_;          ///< while they are found
  std::vector<PairContact*> moving_;        ///< near pairs with a side that can move, ascending
  std::vector<PairContact*> present_;       ///< all near pairs with a contact, ascending
  std::span<PairContact* const> attended_;  ///< of these, the ones to visit
  std::span<const int> attended_ends_;
  bool attends_ = false;
  Executor* executor_ = nullptr;
};

}  // namespace takt
