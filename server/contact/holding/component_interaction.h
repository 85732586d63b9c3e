#pragma once
// Algorithm for Component Interaction (ACI, thesis 3.2.5): who touches whom, who holds whom, and with which
// wrench.
//
// Two stages, kept apart: update_connections() takes every discrete decision, between accepted steps;
// evaluate() is const and pure, and may be called by a solver as often as it likes. (Thesis Fig. 3.7 does
// both at once; then a partner found by the search but not touching would get no force, and error-controlled
// solvers would see jumps.)
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "server/components/pair_generation.h"
#include "server/contact/collision/broad_phase.h"
#include "server/contact/collision/collision_world.h"
#include "server/contact/collision/pair_queries.h"
#include "server/contact/holding/connections.h"
#include "server/contact/holding/partner_search.h"

namespace takt {

class StateReader;
class StateWriter;

/// What the interaction must know of a gripper at one time.
struct GraspState {
  int palm = -1;                ///< component that Parts are held by
  std::vector<int> held{};      ///< Parts that it holds while they are in the grasp volume, ascending
  Vec3 lower_G = Vec3::Zero();  ///< grasp volume: the space between the jaws, in G
  Vec3 upper_G = Vec3::Zero();
};

class ComponentInteraction {
 public:
  ComponentInteraction(const std::vector<Component>& components, const std::vector<ComponentPair>& pairs,
                       const InteractionParameters& parameters);

  /// Times of the sub-stages are taken with this clock (seconds) where one is set.
  using Clock = double (*)();
  struct StageTimes {
    double broad_phase_s = 0.0, mpr_s = 0.0, partner_search_s = 0.0;
  };

  /// Discrete stage, first half: poses for the collision checks, of the components that may have moved. A
  /// pose that is not finite is left out, see refused_pose().
  void update_poses(const CellMotion& motion, std::span<const int> moved, Clock clock);
  void update_poses(const CellMotion& motion, Clock clock);  ///< of all components
  /// A component whose pose was not finite since the last reset, or -1: then the cell cannot go on.
  int refused_pose() const { return refused_pose_; }
  /// Parts (ascending) that may touch a component pushed straight from one pose to another; others are
  /// certainly apart. Valid until the next call.
  std::span<const int> parts_near_sweep(int component, const Pose& from, const Pose& to);
  /// Parts (ascending) in a grasp volume, which becomes the palm's shape. Valid until the next call of
  /// either.
  std::span<const int> parts_between(int palm, const Vec3& lower_G, const Vec3& upper_G);
  /// What the last update_connections() found: the gripper holds the Part, which is in its grasp volume.
  bool gripped(int part, int palm) const;
  /// Discrete stage, second half: contacts at these poses, connections, offsets of those that close.
  void update_connections(const CellMotion& motion, std::span<const GraspState> grasps, Clock clock);
  /// Parts that hang on another component than before this step.
  std::span<const PartnerChange> changes() const {
    return any_by_contact_ ? std::span<const PartnerChange>(shown_changes_) : connections_.changes();
  }
  /// Components with a connection that opened, closed or changed its constants or load in this step.
  std::span<const int> disturbed() const { return connections_.disturbed(); }

  /// Pure stage: wrench of every connection, summed per component in the order of the connections. `wrenches`
  /// has one entry per component, about its p_WBcm.
  void evaluate(const CellMotion& motion, std::span<Wrench> wrenches) const;
  /// The same for some Parts (component ids, ascending), with every Part they are connected with. Entries of
  /// other Parts are left alone, those of Grounds and Grippers are not the whole sum.
  void evaluate(const CellMotion& motion, std::span<const int> parts, std::span<Wrench> wrenches) const {
    connections_.evaluate(motion, parts, wrenches);
  }

  /// How the wrenches of evaluate() change with the motion: appends every pair that acts on one of these
  /// Parts (component ids, ascending) to `pairs`.
  void linearise(const CellMotion& motion, std::span<const int> parts, Linearisation /*of_friction*/,
                 std::vector<PairLinearisation>& pairs) const {
    connections_.linearise(motion, parts, pairs);
  }

  /// Lets others help with the collision checks, from `least_calls` in a step on; nullptr: nobody. Same bits,
  /// same counts.
  void set_executor(Executor* executor, std::uint64_t least_calls = PairQueries::kLeastCalls) {
    queries_.set_executor(executor, least_calls);
  }

  /// Discrete: pairs, by base and target in either order, between which surface contact acts from now on
  /// instead of a substitute force. They are still looked at, and tell who holds whom, but close no
  /// connection. Connections of other pairs stay as they are.
  void set_by_contact(const std::vector<std::pair<int, int>>& pairs);

  /// Open all connections and forget all verdicts and what is attached.
  void reset();

  /// Discrete: from the next update_connections() on the Part hangs on this component, at the pose relative
  /// to it that it has then, whatever the algorithm's rules say. Attached again, it takes the offset anew.
  /// Empty if done, else why not.
  std::string attach(int part, int component);
  /// The rules decide again. The Part must be attached.
  void detach(int part);
  /// See Connections.
  void turn(int part, const ConnectionTurn& turn) { connections_.turn(part, turn); }
  void set_stiffness(int part, double ratio) { connections_.set_stiffness(part, ratio); }
  /// What a Part is attached to, or -1.
  int attached_to(int part) const { return graph_.holds[static_cast<std::size_t>(part)]; }
  bool attached(int a, int b) const;  ///< either to the other
  /// Discrete: how a Gripper gives way (Connections::set_yielding), or none, from now on.
  void set_yielding(int palm, const std::optional<BodyInertia>& inertia) {
    connections_.set_yielding(palm, inertia);
  }
  /// Discrete: the connections of all that is attached are decided anew.
  void reconsider_attached();
  /// Discrete: the Part was put to another place: its connections are decided anew and take their offsets
  /// there.
  void put_elsewhere(int part);

  /// What Parts are attached to; it belongs to what decides which pairs act by contact.
  void save_attached(StateWriter& out) const;
  void load_attached(StateReader& in);
  /// All else that influences what follows. load() wants load_attached() first, and set_by_contact() for the
  /// pairs of then; both throw StateError, and leave an interaction that must be thrown away.
  void save(StateWriter& out) const;
  void load(StateReader& in);

  /// What a Part hangs on: with partner search its partner; else its Gripper, its Ground, or the Part that
  /// carries it; or -1.
  int partner(int component) const {
    return any_by_contact_ ? shown_partner_[static_cast<std::size_t>(component)]
                           : connections_.partner(component);
  }
  /// All closed connections, by base, then target; and those of which a component is the Base.
  std::span<const PairConnection> connections() const { return connections_.all(); }
  std::span<const PairConnection> connections_of(int component) const { return connections_.of(component); }
  /// What one connection exerts on its Base about its centre of mass; see Connections.
  Wrench pair_wrench(const PairConnection& pair, const CellMotion& motion) const {
    return connections_.pair_wrench(pair, motion);
  }
  InteractionAlgorithm algorithm() const { return parameters_.algorithm; }
  bool touching(std::size_t pair) const { return verdicts_[pair].touching && active(pair); }
  /// Who touches whom, whatever acts between them.
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
    std::size_t pair;
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
  void check(std::size_t pair);
  void finish_check(std::size_t pair);
  void set_contact(std::size_t pair, bool contact);
  int find_pair(int a, int b) const;
  void connect(Clock clock, const CellMotion& motion);
  void show_partners();
  void push_out(const CellMotion& motion);
  void push_out(const ComponentPair& pair, const CellMotion& motion);
  bool caught(int part) const;
  void mark_changed(int component);
  void add_attached_edge(int part);
  void rebuild_graphs();

  const std::vector<Component>& components_;
  InteractionParameters parameters_;
  std::vector<ComponentPair> pairs_;  ///< hold pairs only, without jaws; ordered by base, then target
  std::vector<int> parts_;            ///< component ids of Parts
  CollisionWorld collision_world_;
  std::vector<PairVerdict> verdicts_;
  PairQueries queries_;                  ///< of this step, where they are worth sharing among threads
  bool sharing_ = false;                 ///< they are, in this step
  std::vector<char> in_contact_;         ///< by pair: touching and the gripper, if any, holds
  std::vector<char> held_;               ///< by pair: of a Part and the palm that holds it
  std::vector<std::vector<int>> holds_;  ///< by component: Parts that a palm holds, ascending
  ContactGraph graph_;
  Connections connections_;

  // Where surface contact acts, substitute forces do not: graph_ and connections_ know the other pairs only,
  // and what a Part hangs on is found by a second search, for people.
  std::vector<char> by_contact_;  ///< by pair
  bool any_by_contact_ = false;
  ContactGraph shown_graph_;
  PartnerSearch shown_search_;
  std::vector<int> shown_partner_;  ///< by component
  std::vector<PartnerChange> shown_changes_;

  // What may touch: pairs whose large boxes overlap. All others are known to be apart.
  BroadPhase broad_phase_;
  bool begun_ = false;                   ///< the broad phase knows all components
  std::vector<std::vector<Near>> near_;  ///< by component
  std::vector<int> work_, found_;
  int refused_pose_ = -1;
  std::vector<int> toggled_;          ///< palms that hold other Parts than before
  std::uint64_t known_calls_ = 0;     ///< calls behind all present verdicts
  std::uint64_t retested_calls_ = 0;  ///< of those, made in this step
  std::vector<int>
      changed_parts_;  ///< Parts whose contacts changed, and then all that a search may lead to them
  std::vector<char> reached_;
  std::vector<std::size_t> touched_;              ///< pairs that began to touch in this step
  std::vector<std::pair<int, Vec3>> pushed_out_;  ///< Parts, in this step, and how far

  DetectionCounts counts_;
  StageTimes stage_times_;
};

}  // namespace takt
