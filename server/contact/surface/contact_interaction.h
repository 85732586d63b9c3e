#pragma once
// Surface contact between the components of a cell (level of detail 3): all pairs that may touch, their
// wrenches and their linearisation.
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
#include "server/contact/surface/contact_model.h"
#include "server/contact/surface/contact_sample.h"
#include "server/contact/surface/polygonal_contact.h"

namespace takt {

class StateReader;
class StateWriter;

/// Calls of the contact algorithm since the last reset, as in Table 5.4.
struct ContactCallCounts {
  std::uint64_t made = 0, skipped = 0;
  std::uint64_t boxes_apart = 0;  ///< pairs skipped because their bounds are apart
  std::uint64_t rebuilds = 0;     ///< of candidate lists
  std::uint64_t elements = 0;     ///< elements with force, over all calls
};

class ContactInteraction {
 public:
  /// `components` and `model` must outlive this.
  ContactInteraction(const std::vector<Component>& components, const ContactModel& model);
  ~ContactInteraction();

  std::size_t pair_count() const { return model_.pairs.size(); }
  const ContactPairModel& pair(std::size_t i) const { return model_.pairs[i]; }
  /// Sets the acting pairs at the present levels of detail, by pair. Pairs that become inactive lose their
  /// springs.
  void set_acting(const std::vector<char>& acting);
  bool acting(std::size_t i) const { return acting_[i] != 0; }
  bool any_acting() const { return any_acting_; }

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
  /// pair moves further than a quarter of its Target's walls beyond the place where their bounds meet, or a
  /// twentieth if it is deeper than that quarter.
  double seeing_step_s(const CellMotion& motion, double most_s);
  /// A pair of which one body is about to leave the other on its far side.
  struct Passing {
    int base = -1, target = -1;  ///< component ids; -1: no such pair
    double wall_m = 0.0, depth_m = 0.0;
    double speed_m_per_s = 0.0;  ///< of the base's centre relative to the target
  };
  /// Tests only pairs that an evaluation since the last call found deep.
  Passing passing(const CellMotion& motion);
  /// Whether solvers hold patches (PolygonalContact::hold).
  void set_holding(bool holding);
  bool holding() const { return holding_; }
  /// Discrete, at the start of a step of a solver of `next_s`: holds patches of pairs that may move.
  void hold(const CellMotion& motion, double next_s);
  /// Discrete, at an accepted point: springs of the stick law.
  void accept(const CellMotion& motion);

  /// Discrete: coefficients of friction that depend on temperatures (ContactPairModel::friction_at_K).
  void update_friction(std::span<const BodyHeat> heat);

  /// Discrete: sets the sleeping components, which the system leaves out. Pairs of two immobile components
  /// keep their results.
  void set_asleep(const std::vector<char>& asleep);
  /// Acting pairs that may meet, ascending: as of update(), those asleep as of their falling asleep.
  std::span<const std::size_t> near() const { return near_; }
  /// Whether the bounds of a pair, each grown by half of `margin_m`, meet.
  bool bounds_meet(std::size_t pair, const CellMotion& motion, double margin_m) const {
    return !boxes_apart(model_.pairs[pair], motion, margin_m);
  }
  /// No point of the component's surface is further from its origin (m); 0 without surface.
  double radius_m(int component) const { return radius_m_[static_cast<std::size_t>(component)]; }

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
  /// Adds the contact force on each component (N, by component), in the same way.
  void add_forces(const CellMotion& motion, std::span<Vec3> forces_W);
  /// The component that presses most upon this one, or -1.
  int heaviest_on(int component, const CellMotion& motion);
  /// All pairs with pressure; allocates if their number exceeds all earlier ones.
  void read(const CellMotion& motion, std::vector<ContactSample>& samples);
  std::vector<ElementPressure> pressures(std::size_t pair, const CellMotion& motion);
  /// The components that this component pushes along a direction (of length 1) at this motion, ascending: the
  /// pair exerts at least half of its force in that direction.
  void list_pushed(const CellMotion& motion, int component, const Vec3& direction_W,
                   std::vector<int>& others);

  ContactCallCounts counts() const;
  void set_executor(Executor* executor) { executor_ = executor; }

 private:
  struct Pair;
  struct Work {
    ContactInteraction* self;
    const CellMotion* motion;
  };
  static void run_task(std::size_t task, void* context);
  void list_near();
  void wake_all();
  void evaluate_all(const CellMotion& motion);
  void add_wrenches(const Pair& pair, const CellMotion& motion, std::span<Wrench> wrenches) const;
  void evaluate_pair(Pair& pair, const CellMotion& motion) const;
  void look_at_pair(Pair& pair, const CellMotion& motion) const;
  RelativeMotion motion_of(const ContactPairModel& pair, const CellMotion& motion) const;
  bool boxes_apart(const ContactPairModel& pair, const CellMotion& motion, double margin_m) const;
  /// Between the bounds of a pair, along the axis on which they are furthest apart; negative: they meet.
  double gap_m(const ContactPairModel& pair, const CellMotion& motion) const;
  /// No point of the Base is faster relative to the Target.
  double speed_m_per_s(const ContactPairModel& pair, const CellMotion& motion) const;

  const std::vector<Component>& components_;
  const ContactModel& model_;
  std::vector<Pair> pairs_;
  std::vector<char> acting_;
  bool any_acting_ = false;
  std::vector<char> asleep_;         ///< by component
  std::vector<double> radius_m_;     ///< by component
  std::vector<char> still_;          ///< by pair: neither side can move
  std::vector<char> is_near_;        ///< by pair
  std::vector<std::size_t> near_;    ///< acting pairs that may meet, ascending
  std::vector<std::size_t> moving_;  ///< near pairs with at least one mobile component
  bool holding_ = false;
  Executor* executor_ = nullptr;
};

}  // namespace takt
