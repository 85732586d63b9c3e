#pragma once
// All plant models of a cell as one system x' = f(t, x). The state vector is the concatenation of the models'
// segments; its length is fixed from load to reset.
#include <limits>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "plant_models/force_element.h"
#include "plant_models/plant_model.h"
#include "server/contact/holding/component_interaction.h"
#include "server/contact/surface/contact_interaction.h"

namespace takt {

class Islands;

class OdeSystem {
 public:
  /// Models in the order robots, grippers, Grounds, Parts. The interaction is read only. `contacts`: surface
  /// contact, or nullptr if no pair acts by it.
  OdeSystem(std::vector<PlantModel*> models, const ComponentInteraction& interaction, std::size_t body_count,
            std::size_t arm_count, ContactInteraction* contacts = nullptr);

  /// Additional forces, added in this order; they must outlive the system. With an empty list the wrenches
  /// keep their bits.
  void set_force_elements(std::vector<const ForceElement*> elements) { elements_ = std::move(elements); }

  int state_count() const { return state_count_; }

  /// Restricts motion to these Parts (component ids, ascending), robots and grippers. All other Parts keep
  /// states and motion; the caller guarantees that the next step would leave their states unchanged, bit for
  /// bit (exact_sleeping.h) or within a bound (threshold_sleeping.h).
  void set_awake(std::span<const int> parts);
  /// All models again, Grounds included.
  void wake_all();
  /// Within a step: restricts states, motion and forces to these segments with states (ascending), models without states,
  /// and these pairs of surface contact with these ends, until attend_all(). All arguments must last until then; `islands`
  /// watches the motions.
  void attend(std::span<const std::size_t> segments, std::span<PairContact* const> pairs,
              std::span<const int> ends, Islands& islands);
  /// Motion within a step that a solver has found already: of each model the cubic through its states and their derivatives
  /// at the beginning and at the end.
  struct Courses {
    struct Span {
      double begin_s = 0.0, length_s = 0.0;
    };
    std::vector<Span> spans;         ///< by segment
    std::vector<double> x[2], f[2];  ///< by state, at either end
  };
  /// After attend(): these models with states, which are not attended, follow their courses until the next attend() or
  /// attend_all().
  void follow(const Courses* courses, std::span<const std::size_t> segments);
  bool follows(std::size_t segment) const { return follows_[segment] != 0; }
  void attend_all();
  /// Number of Parts that may move.
  std::size_t awake_count() const { return awake_.size(); }
  /// A range of the state vector.
  struct Range {
    std::size_t begin = 0, end = 0;
  };
  /// The states that may change, ascending.
  std::span<const Range> active_states() const { return active_states_; }
  /// Components whose motion may change, with the Parts among them last.
  std::span<const int> active_bodies() const { return active_bodies_; }

  void initial_state(std::span<double> x) const;

  /// Motion of everything that may move at (t, x).
  void update_motion(double t, std::span<const double> x);
  const CellMotion& motion() const { return motion_; }
  /// Wrenches of all pairs at the present motion, summed per component, resting Parts included.
  std::span<const Wrench> update_wrenches();

  /// x' = f(t, x): motion, wrenches, derivatives. Pure in (t, x) for the connections of this step.
  void derivatives(double t, std::span<const double> x, std::span<double> xdot);
  /// The same directly after update_motion(t, x).
  void derivatives_at_motion(double t, std::span<const double> x, std::span<double> xdot);

  /// Discrete, at the start of a solver's step of `next_s`, directly after update_motion(t, x): holds the patches
  /// of surface contact, which derivatives() uses near the motion from (t, x) on (ContactInteraction::hold).
  void hold_contacts(double next_s);
  /// Discrete, directly after derivatives() at an accepted point: the largest forces of surface contacts.
  void note_peaks();
  bool watches_peaks() const;

  // Modes of the plant models (see plant_model.h). All of these bring the motion and the wrenches to (t, x).

  int indicator_count() const { return indicator_count_; }
  void indicators(double t, std::span<const double> x, std::span<double> g);
  /// Discrete, at an accepted point. True if a mode or a state changed.
  bool switch_modes(double t, std::span<double> x);
  double next_time_event(double t) const;

  /// One entry of the approximate Jacobian d xdot / d x; all others are zero (treated explicitly).
  struct Entry {
    int row = 0, column = 0;
  };
  /// Sorted by segment, as the models list them; constant from load to reset.
  std::span<const Entry> jacobian_pattern() const { return pattern_; }
  /// Values in the order of the pattern, at the motion of the last update_motion(t, x).
  void jacobian(double t, std::span<const double> x, std::span<double> values) const;

  /// Approximate partial derivative of x' by t, at the motion of the last update_motion(t, x).
  void time_derivative(double t, std::span<const double> x, std::span<double> rate) const;

  /// How the wrenches at the present motion change with it, pair by pair, for the models that may move.
  void linearise(Linearisation of_friction, std::vector<PairLinearisation>& pairs) const {
    pairs.clear();
    interaction_.linearise(motion_, awake_, of_friction, pairs);
    if (has_contacts()) contacts_->linearise(motion_, of_friction, pairs);
  }
  /// All closed connections.
  std::span<const PairConnection> connections() const { return interaction_.connections(); }
  std::span<const ForceElement* const> force_elements() const { return elements_; }
  const ContactInteraction* contacts() const { return contacts_; }
  /// Wrenches of the last derivatives() or update_wrenches().
  std::span<const Wrench> wrenches() const { return wrenches_; }
  /// Updates the motion at time t of models without states (kinematic robots and grippers).
  void update_stateless_motion(double t);

  /// True if the pairs are too stiff for an explicit treatment (surface contact). The matrices of solvers are
  /// then coupled (SolverParameters::matrix).
  bool has_stiff_pairs() const { return stiff_pairs_; }
  void set_stiff_pairs(bool stiff) { stiff_pairs_ = stiff; }

  /// A model with its place in the state vector.
  struct Segment {
    PlantModel* model;
    std::size_t begin;
    std::size_t count;
    std::size_t first_indicator = 0, first_entry = 0;
  };
  std::span<const Segment> segments() const { return segments_; }
  /// Segments whose states may change at present, ascending.
  std::span<const std::size_t> active_segments() const { return active_; }
  std::size_t body_count() const { return wrenches_.size(); }

  /// The states of one model that has any.
  struct Block {
    Range states;
    int body = -1;  ///< component whose states they are, or -1 if they move several
  };
  std::span<const Block> blocks() const { return blocks_; }
  /// True if pairs act by surface contact: they are stiff, and couple models beyond the connections.
  bool has_contacts() const { return contacts_ != nullptr && contacts_->any_acting(); }
  /// Before the first motion: room for the motion of surfaces (CellMotion::surfaces).
  void allow_surfaces() { motion_.surfaces.resize(motion_.bodies.size()); }
  /// The same for the accelerations of Grounds that robots stand on (CellMotion::accelerations).
  void allow_accelerations() { motion_.accelerations.resize(motion_.bodies.size()); }
  /// The component that holds this one at present, or -1.
  int partner(int body) const { return interaction_.partner(body); }
  /// Typical sizes of all states.
  void state_scales(std::span<double> scales) const;

  std::uint64_t evaluations() const { return evaluations_; }
  /// Time spent on wrenches, where a clock (seconds) is set.
  double forces_s() const { return forces_s_; }
  void set_clock(double (*now_s)()) { clock_ = now_s; }
  void reset_counts() { evaluations_ = 0, forces_s_ = 0.0; }
  /// For a solver that counts several evaluations as one.
  void set_evaluations(std::uint64_t count) { evaluations_ = count; }

 private:
  void activate(std::span<const int> parts, bool fixed_bodies);
  void evaluate_wrenches();
  void follow_courses(double t);

  std::vector<Segment> segments_;
  std::vector<std::size_t> fixed_;  ///< segments of bodies without states
  std::vector<Block> blocks_;
  std::vector<int> segment_of_body_;   ///< of bodies that may rest; else -1
  std::vector<int> stateless_bodies_;  ///< component ids of Grippers and Grounds
  std::vector<int> part_bodies_;       ///< component ids of the models with states
  std::vector<std::size_t> active_;    ///< segments, in order
  std::vector<Range> active_states_;
  std::vector<int> active_bodies_;
  std::vector<int> awake_;      ///< component ids of the Parts among them
  Islands* islands_ = nullptr;  ///< while an island is attended
  // Of all islands, meanwhile.
  std::vector<std::size_t> all_active_;
  std::vector<Range> all_states_;
  std::vector<int> all_awake_;
  const Courses* courses_ = nullptr;
  std::span<const std::size_t> following_;
  std::vector<char> follows_;     ///< by segment
  std::vector<double> followed_;  ///< states
  const ComponentInteraction& interaction_;
  ContactInteraction* contacts_;
  std::vector<const ForceElement*> elements_;
  CellMotion motion_;
  std::vector<Wrench> wrenches_;
  KeptWrenches kept_;  ///< of update_wrenches()
  int state_count_ = 0;
  int indicator_count_ = 0;
  bool stiff_pairs_ = false;
  std::vector<Entry> pattern_;
  std::uint64_t evaluations_ = 0;
  double (*clock_)() = nullptr;
  double forces_s_ = 0.0;
};

}  // namespace takt
