#pragma once
// Algorithm for Component Interaction (ACI, thesis 3.2.5): contacts of components, the holder of each Part,
// and the wrenches of the connections.
//
// Two separate stages: update_connections() takes every discrete decision, between accepted steps; evaluate()
// is const and pure, so a solver may call it any number of times. (Thesis Fig. 3.7 has one stage; a partner
// that the search finds without contact would then exert no force, and error-controlled solvers would see
// jumps.)
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "server/components/pair_generation.h"
#include "server/contact/collision/collision_world.h"
#include "server/contact/collision/pair_queries.h"
#include "server/contact/holding/connections.h"
#include "server/contact/holding/partner_search.h"
#include "server/geometry/broad_phase.h"
#include "server/geometry/convex/distance.h"

namespace takt {

class StateReader;
class StateWriter;

/// State of a gripper at one time, as the interaction needs it.
struct GraspState {
  int palm = -1;                ///< component that Parts are held by
  std::vector<int> held{};      ///< Parts that it holds while they are in the grasp volume, ascending
  Vec3 lower_G = Vec3::Zero();  ///< grasp volume: the space between the jaws, in G
  Vec3 upper_G = Vec3::Zero();
};

class ComponentInteraction {
 public:
  ComponentInteraction(const std::vector<Component>& components, const ComponentPairs& pairs,
                       const InteractionParameters& parameters);

  /// Times of the sub-stages are taken with this clock (seconds) where one is set.
  using Clock = double (*)();
  struct StageTimes {
    double broad_phase_s = 0.0, mpr_s = 0.0, partner_search_s = 0.0;
  };

  /// Discrete stage, first half: sets the poses of components that may have moved, for the collision checks.
  /// A pose that is not finite is refused, see refused_pose().
  void update_poses(const CellMotion& motion, std::span<const int> moved, Clock clock);
  void update_poses(const CellMotion& motion, Clock clock);  ///< of all components
  /// A component with a pose that was not finite, first one after a reset, or -1. With such a pose the cell
  /// must stop.
  int refused_pose() const { return refused_pose_; }
  /// Parts (ascending) that may touch a component pushed straight from one pose to another; all others are
  /// certainly apart. Valid until the next call.
  std::span<const int> parts_near_sweep(int component, const Pose& from, const Pose& to);
  /// The same for a box of the world: Parts whose bounds overlap with it, into `parts`.
  void parts_near(const Aabb& box, std::vector<int>& parts);
  /// Parts (ascending) in a grasp volume, which becomes the palm's shape. Valid until the next call of
  /// parts_between() or parts_near_sweep().
  std::span<const int> parts_between(int palm, const Vec3& lower_G, const Vec3& upper_G);
  /// Result of the last update_connections(): the gripper holds the Part, which is in its grasp volume.
  bool gripped(int part, int palm) const;
  /// Discrete stage, second half: contacts at these poses, connections, offsets of closing connections.
  void update_connections(const CellMotion& motion, std::span<const GraspState> grasps, Clock clock);
  /// Parts whose partner changed in this step.
  std::span<const PartnerChange> changes() const {
    return any_by_contact_ ? std::span<const PartnerChange>(shown_changes_) : connections_.changes();
  }
  /// Components with a connection that opened, closed or changed its constants or load in this step.
  std::span<const int> disturbed() const { return connections_.disturbed(); }

  /// Pure stage: wrench of every connection, summed per component in the order of the connections. `wrenches`
  /// has one entry per component, about its p_WBcm; those of components without a connection are unchanged.
  void evaluate(const CellMotion& motion, std::span<Wrench> wrenches) const {
    connections_.evaluate(motion, wrenches);
  }
  /// The same; those of connections at rest come from `kept`.
  void evaluate(const CellMotion& motion, std::span<Wrench> wrenches, KeptWrenches& kept) const {
    connections_.evaluate(motion, wrenches, kept);
  }
  /// The same for some Parts (component ids, ascending), with every Part they are connected with. Entries of
  /// other Parts are unchanged; those of Grounds and Grippers are incomplete sums.
  void evaluate(const CellMotion& motion, std::span<const int> parts, std::span<Wrench> wrenches) const {
    connections_.evaluate(motion, parts, wrenches);
  }

  /// How the wrenches of evaluate() change with the motion: appends every pair that acts on one of these
  /// Parts (component ids, ascending) to `pairs`.
  void linearise(const CellMotion& motion, std::span<const int> parts, Linearisation /*of_friction*/,
                 std::vector<PairLinearisation>& pairs) const {
    connections_.linearise(motion, parts, pairs);
  }

  /// Shares the collision checks with the executor in steps of at least `least_calls` calls; nullptr: without
  /// executor. Bits and counts stay the same.
  void set_executor(Executor* executor, std::uint64_t least_calls = PairQueries::kLeastCalls) {
    queries_.set_executor(executor, least_calls);
  }

  /// Discrete: which pairs act by surface contact instead of a substitute force. Their contacts count in the
  /// search for partners, but close no connection. Connections of other pairs stay unchanged.
  void set_by_contact(const PairPredicate& acts);

  /// Opens all connections and clears all verdicts and attachments.
  void reset();

  /// Discrete: attaches the Part to this component at their relative pose in the next update_connections(),
  /// whatever the algorithm's rules decide. A repeated call captures the offset again. Returns an empty text,
  /// or the reason of a refusal.
  std::string attach(int part, int component);
  /// The rules decide again. The Part must be attached.
  void detach(int part);
  /// See Connections.
  void turn(int part, const ConnectionTurn& turn) { connections_.turn(part, turn); }
  void slide(int part, const Vec3& velocity_W, const CellMotion& motion) {
    connections_.slide(part, velocity_W, motion);
  }
  /// Of two components that touch: where they overlap deepest or, within the contact margin, are nearest; `normal_W` from a to b.
  ConvexDistance nearest(int a, int b) const;
  double contact_margin_m() const { return parameters_.contact_margin_m; }
  void allow_sliding() { connections_.allow_sliding(); }
  void set_stiffness(int part, double ratio) { connections_.set_stiffness(part, ratio); }
  /// The component that a Part is attached to, or -1.
  int attached_to(int part) const { return graph_.holds[static_cast<std::size_t>(part)]; }
  bool attached(int a, int b) const;  ///< whether one of the two is attached to the other
  /// Discrete: compliance of a Gripper (Connections::set_yielding); std::nullopt: rigid.
  void set_yielding(int palm, const std::optional<BodyInertia>& inertia) {
    connections_.set_yielding(palm, inertia);
  }
  /// Discrete: decides the connections of all attached Parts again.
  void reconsider_attached();
  /// Discrete, after a Part was moved to another place: its connections are decided again and take their
  /// offsets there.
  void put_elsewhere(int part);

  /// Saves the attachments, which also decide which pairs act by contact.
  void save_attached(StateWriter& out) const;
  void load_attached(StateReader& in);
  /// Saves the rest of the state that influences later steps. Call load_attached() and set_by_contact() (with
  /// the saved pairs) first; both loads throw StateError, and the interaction is then invalid.
  void save(StateWriter& out) const;
  void load(StateReader& in);

  /// Holder of a Part: with partner search its partner; else its Gripper, its Ground, or the Part that
  /// carries it; or -1.
  int partner(int component) const {
    return any_by_contact_ ? shown_partner_[static_cast<std::size_t>(component)]
                           : connections_.partner(component);
  }
  /// All closed connections, by base, then target; of(): those with the component as Base.
  std::span<const PairConnection> connections() const { return connections_.all(); }
  std::span<const PairConnection> connections_of(int component) const { return connections_.of(component); }
  /// Wrench of one connection on its Base about its centre of mass; see Connections.
  Wrench pair_wrench(const PairConnection& pair, const CellMotion& motion) const {
    return connections_.pair_wrench(pair, motion);
  }
  InteractionAlgorithm algorithm() const { return parameters_.algorithm; }
  /// The contacts of all components, by surface contact or by substitute force.
  const ContactGraph& graph() const { return any_by_contact_ ? shown_graph_ : graph_; }
  const DetectionCounts& counts() const { return counts_; }
  std::uint64_t partner_searches() const { return connections_.partner_searches(); }
  const StageTimes& stage_times() const { return stage_times_; }
  CollisionWorld& collision_world() { return collision_world_; }
  const CollisionWorld& collision_world() const { return collision_world_; }
  DetectionCounts& counts() { return counts_; }

 private:
  struct Near {
    int other;
    std::uint32_t pair, verdict;  ///< places in pairs_ and verdicts_
  };
  bool active(std::size_t pair) const;
  bool is_gripper(int component) const {
    return components_[static_cast<std::size_t>(component)].type == ComponentType::gripper;
  }
  void set_held(const GraspState& grasp);
  void detect(Clock clock);
  void detect_moved();
  void detect_all();
  void begin_near();
  void follow_moved();
  void refresh_near(int component);
  void check(const PairQueries::Item& pair);
  void finish_check(const PairQueries::Item& pair);
  /// A near pair with its ends; `component` is one of them.
  PairQueries::Item ends_of(int component, const Near& near) const;
  void set_contact(std::size_t pair, int base, int target, bool contact);
  int find_pair(int a, int b) const;
  void connect(Clock clock, const CellMotion& motion);
  void show_partners();
  void push_out(const CellMotion& motion);
  void push_out(int base_id, int target_id, const CellMotion& motion);
  bool caught(int part) const;
  void mark_changed(int component);
  void add_attached_edge(int part);
  void rebuild_graphs();

  const std::vector<Component>& components_;
  InteractionParameters parameters_;
  PairTable pairs_;         ///< holding pairs only, without jaws
  std::vector<int> parts_;  ///< component ids of Parts
  CollisionWorld collision_world_;
  /// Of near pairs; of all pairs, by pair, where every step tests all of them.
  std::vector<PairVerdict> verdicts_;
  std::vector<std::uint32_t> free_verdicts_;  ///< places in verdicts_
  PairQueries queries_;                       ///< of this step, where they are worth sharing among threads
  bool sharing_ = false;                      ///< they are, in this step
  std::vector<char> in_contact_;              ///< by pair: touching and the gripper, if any, holds
  std::vector<char> held_;                    ///< by pair: of a Part and the palm that holds it
  std::vector<std::vector<int>> holds_;       ///< by component: Parts that a palm holds, ascending
  ContactGraph graph_;
  Connections connections_;

  // Pairs with surface contact have no substitute force: graph_ and connections_ contain the other pairs
  // only, and a second search over all pairs finds the holders for reports.
  std::vector<char> by_contact_;  ///< by pair
  bool any_by_contact_ = false;
  ContactGraph shown_graph_;
  PartnerSearch shown_search_;
  std::vector<int> shown_partner_;  ///< by component
  std::vector<PartnerChange> shown_changes_;

  // Candidate pairs, whose large boxes overlap. All others are apart.
  BroadPhase broad_phase_;
  bool begun_ = false;                   ///< the broad phase contains all components
  std::vector<std::vector<Near>> near_;  ///< by component
  std::vector<int> work_, found_;
  int refused_pose_ = -1;
  std::vector<int> toggled_;          ///< palms with a change of their held Parts
  std::uint64_t known_calls_ = 0;     ///< calls behind all present verdicts
  std::uint64_t retested_calls_ = 0;  ///< of those, in this step
  /// Parts whose contacts changed, and then all from which a search may reach them.
  std::vector<int> changed_parts_;
  std::vector<char> reached_;
  std::vector<std::size_t> touched_;              ///< pairs that began to touch in this step
  std::vector<std::pair<int, Vec3>> pushed_out_;  ///< Parts, in this step, and how far

  DetectionCounts counts_;
  StageTimes stage_times_;
};

}  // namespace takt
