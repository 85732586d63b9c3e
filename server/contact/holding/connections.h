#pragma once
// The closed connections of a cell and their wrenches: the Algorithm for Component Interaction (ACI, thesis
// 3.2.5) after the contacts are known. One of three algorithms decides which connections are closed
// (connection_rules.h, partner_search.h); all share the same two stages, update() between steps and
// evaluate() within.
//
// Weight feed-forward for Parts held by Parts: each Part has one carrying connection, along a tree from
// Grippers and Grounds outwards (support_tree.h). This connection carries the weight of the Part and of all
// Parts that it supports, with its moment; other connections carry no weight. In every Part the passed loads
// cancel except its own weight, so each Part gets exactly its weight at its centre of mass and the support at
// the end gets the reaction: the chain neither sags nor twists, in any pose. pair_wrench() returns the wrench
// of each connection.
//
// Parts without support fall without feed-forward. Their connections are softened so that no mode is faster
// than that of the fastest Part alone (FreeTargetLoad). If such Parts are caught, softened connections close
// again with full constants, because a stretched spring that stiffens would create energy.
//
// A Gripper whose robot has dynamics is compliant (set_yielding()). A Part attached to it from afar pulls at
// a lever: an unsoftened spring and damper would swing the wrist faster than the solver can follow. So if
// such a Gripper holds attached Parts, all its connections are softened as on a free Target. Connections of
// merely gripped Parts keep the thesis' constants, because their levers are short.
//
// A Part that the user attached (ContactGraph::holds) is the Base of one connection in every algorithm: to
// that component. With partner search, a Part attached to a held Part gets that Part's partner, as all Parts
// that ride on it do.
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "server/components/component.h"
#include "server/contact/holding/connection_rules.h"
#include "server/contact/holding/kept_wrenches.h"
#include "server/contact/holding/partner_search.h"
#include "server/contact/holding/substitute_force.h"
#include "server/contact/holding/support_tree.h"

namespace takt {

class StateReader;
class StateWriter;

struct InteractionParameters {
  Vec3 gravity_W{0.0, 0.0, -9.80665};  ///< m/s^2
  double contact_margin_m = 0.0002;    ///< components closer than this touch
  bool weight_feed_forward = true;     ///< false: the thesis' law, where the spring carries the weight
  /// False: evaluates every pair and every Part in every step; the bits are the same.
  bool exact_sleeping = true;
  InteractionAlgorithm algorithm = InteractionAlgorithm::partner_search;
  /// Time between two discrete stages (s). A falling Part penetrates its support by the fall in that time;
  /// the connection corrects this depth. 0: without correction.
  double step_s = 0.0;
};

/// A change of the component that holds a Part.
struct PartnerChange {
  int part = -1, from = -1, to = -1;
};

/// A closed connection; its Target is connection.partner. Of two Parts the Base is the one of lower
/// hierarchy.
struct PairConnection {
  int base = -1;
  Connection connection;
  ConnectionKey key() const { return {base, connection.partner}; }
};

class Connections {
 public:
  Connections(const std::vector<Component>& components, std::size_t pair_count,
              const InteractionParameters& parameters);

  /// Opens all.
  void reset();

  /// Discrete stage: decides the connections of `parts` (ascending; all Parts of the contact clusters in
  /// which a contact changed) at these poses. Allocates only if more than 32 connections per Part are closed.
  void update(const ContactGraph& graph, std::span<const int> parts, const CellMotion& motion);
  /// Starts a step, at this motion.
  void begin_step(const CellMotion& motion);
  std::span<const PartnerChange> changes() const { return changes_; }
  /// Components with a connection that opened, closed or changed its constants or load in this step; any
  /// order.
  std::span<const int> disturbed() const { return disturbed_; }

  /// In the next update(), captures again the offset of the Part's own connection (`own`: it was attached),
  /// or also those of connections with the Part as Target (`all`: it was moved). The update must contain
  /// these Parts.
  enum class Renewal : char { none, own, all };
  void recompute_gains(int part, Renewal what);

  /// Discrete, from the next update() on: lower bound of the inertia of a compliant Gripper (its palm;
  /// inertia in G); std::nullopt: it moves as prescribed.
  void set_yielding(int palm, const std::optional<BodyInertia>& inertia) {
    yielding_[static_cast<std::size_t>(palm)] = inertia;
  }
  /// After update(): the Part is turned in its connections during this step. begin_step() ends it.
  void turn(int part, const ConnectionTurn& turn);
  /// After update(): shifts the held pose of the Part (a Base) by `shift_W` (m), in the connection with this
  /// Target or in all of them (-1). Without such a connection it has no effect.
  void shift(int part, int target, const Vec3& shift_W, const CellMotion& motion);
  /// After update(): during this step the held pose of the Part (a Base) slides over its Targets at this velocity (m/s).
  /// The next begin_step() ends it, where it then is.
  void slide(int part, const Vec3& velocity_W, const CellMotion& motion);
  /// Before the first step: connections may slide. Their state is then saved.
  void allow_sliding() { may_slide_ = true; }
  /// Discrete, from the next update() on: factor for the constants of a Part's connections (default 1). The
  /// connections close again when it changes.
  void set_stiffness(int part, double ratio);

  /// Serialised state; load() throws StateError for invalid bytes.
  void save(StateWriter& out) const;
  void load(StateReader& in);

  /// Ordered by base, then target.
  std::span<const PairConnection> all() const { return list_; }
  /// The connections with the component as Base.
  std::span<const PairConnection> of(int component) const {
    const auto c = static_cast<std::size_t>(component);
    return std::span<const PairConnection>(list_).subspan(first_[c], first_[c + 1] - first_[c]);
  }
  /// Holder of a Part: its Gripper, else its Ground, else a Part; or -1.
  int partner(int component) const { return partner_[static_cast<std::size_t>(component)]; }

  /// Pure stage; see ComponentInteraction::evaluate().
  void evaluate(const CellMotion& motion, std::span<const int> parts, std::span<Wrench> wrenches) const;
  /// Of all Parts; entries of components without a connection are unchanged.
  void evaluate(const CellMotion& motion, std::span<Wrench> wrenches) const;
  /// Of all Parts. Takes the wrenches of connections at rest from `kept`.
  void evaluate(const CellMotion& motion, std::span<Wrench> wrenches, KeptWrenches& kept) const;
  /// Appends how the wrenches of these Parts' connections change with the motion. Weights that pass through
  /// are constant.
  void linearise(const CellMotion& motion, std::span<const int> parts,
                 std::vector<PairLinearisation>& pairs) const;
  /// Wrench of one connection on its Base about its centre of mass, with the weight that passes through it.
  /// The Target gets its reaction_on_target(). The sum over all connections is evaluate(). It visits all
  /// Parts: for reports and tests.
  Wrench pair_wrench(const PairConnection& pair, const CellMotion& motion) const;

  std::uint64_t partner_searches() const { return partner_searches_; }

 private:
  const Component& component(int id) const { return components_[static_cast<std::size_t>(id)]; }
  bool is_part(int id) const { return component(id).type == ComponentType::part; }
  void add_wrenches(const PairConnection& pair, const CellMotion& motion, std::span<Wrench> wrenches) const;
  void add_passed_weights(const CellMotion& motion, std::span<const int> parts,
                          std::span<Wrench> wrenches) const;
  bool closed(const ContactGraph& graph, int a, int b) const;
  void search(const ContactGraph& graph, std::span<const int> parts);
  void follow_rules(const ContactGraph& graph, std::span<const int> parts);
  bool as_wanted(std::span<const int> parts) const;
  void open_and_close(std::span<const int> parts, const CellMotion& motion);
  PairConnection close(const ConnectionKey& key, const CellMotion& motion) const;
  void soften_on_free_targets();
  void soften_attached(const ContactGraph& graph, std::span<const int> parts);
  void soften_on_grippers(const ContactGraph& graph, std::span<const int> parts);
  bool yields(int target) const { return yielding_[static_cast<std::size_t>(target)].has_value(); }
  bool attached_to_part(const ContactGraph& graph, int part, int target) const;
  bool renewed(const PairConnection& pair) const;
  void index_list();
  void assign_supports(const ContactGraph& graph, std::span<const int> parts);
  void soften_free_clusters(const ContactGraph& graph, std::span<const int> parts, const CellMotion& motion);
  double free_scale(const ContactGraph& graph, int part) const;
  const PairConnection* find(int base, int target) const;
  std::span<PairConnection> mutable_of(int component);
  void mark_changed(const PairConnection& pair);
  void end_turns();
  /// A Part's own constants with its factor, and softer by `softening`.
  SubstituteParameters own_gains(int part, double softening) const;

  const std::vector<Component>& components_;
  InteractionParameters parameters_;
  std::vector<int> parts_;            ///< component ids of Parts
  std::vector<PairConnection> list_;  ///< closed, ordered
  std::vector<PairConnection> next_;  ///< list under construction
  std::vector<std::size_t> first_;    ///< by component: place of its first in list_; and the end
  std::vector<int> partner_;          ///< by component; Parts only
  std::vector<int> passes_to_;        ///< by component: the support whose load includes a Part held by a Part
  std::vector<double> stiffness_;     ///< by component: factor for a Part's own constants
  std::vector<int> turning_;          ///< Parts with a turn in this step
  bool may_slide_ = false;
  std::vector<ConnectionKey> wanted_;
  std::vector<char> decided_;  ///< by component: among the Parts of this update
  std::vector<double> scale_;  ///< by component, of this update
  std::vector<PartnerChange> changes_;
  std::vector<int> disturbed_;
  std::vector<int> softened_;                         ///< free Targets already seen in this step
  std::vector<int> closed_on_;                        ///< Parts that became Targets in this step
  std::vector<Renewal> renew_;                        ///< by component
  std::vector<std::optional<BodyInertia>> yielding_;  ///< by component; Grippers only
  PartnerSearch partner_search_;
  SupportTree tree_;
  std::uint64_t partner_searches_ = 0;
  std::uint64_t version_ = 1;  ///< differs after each change of a connection
};

}  // namespace takt
