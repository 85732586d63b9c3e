#include "server/contact/component_interaction.h"

#include <algorithm>

namespace takt {

ComponentInteraction::ComponentInteraction(const std::vector<Component>& components,
                                           const std::vector<ComponentPair>& pairs,
                                           const InteractionParameters& parameters)
    : components_(components),
      parameters_(parameters),
      world_(components, parameters.contact_margin_m),
      grasp_active_(components.size(), 0),
      graph_(components.size()),
      partner_search_(components.size()),
      connections_(components.size()) {
  for (const ComponentPair& pair : pairs) {
    const GripperRole role = components[static_cast<std::size_t>(pair.target)].role;
    if (pair.kind == PairKind::hold && role != GripperRole::left_jaw && role != GripperRole::right_jaw) {
      pairs_.push_back(pair);
    }
  }
  verdicts_.resize(pairs_.size());
  in_contact_.resize(pairs_.size(), 0);
  for (std::size_t i = 0; i < components.size(); ++i) {
    graph_.vertices[i] = {components[i].type, components[i].hierarchy};
    graph_.neighbours[i].reserve(components.size());
    if (components[i].type == ComponentType::part) parts_.push_back(static_cast<int>(i));
    if (components[i].role == GripperRole::palm) {
      // The grasp volume: a box whose bounds follow the jaws.
      world_.set_shape(static_cast<int>(i), ConvexShape::from_points(std::vector<Vec3>(8, Vec3::Zero())));
    }
  }
  changes_.reserve(parts_.size());
  softened_.reserve(parts_.size());
}

void ComponentInteraction::reset() {
  std::fill(verdicts_.begin(), verdicts_.end(), PairVerdict{});
  std::fill(in_contact_.begin(), in_contact_.end(), 0);
  std::fill(grasp_active_.begin(), grasp_active_.end(), 0);
  std::fill(connections_.begin(), connections_.end(), Connection{});
  graph_.clear_contacts();
  graph_valid_ = false;
  changes_.clear();
  counts_ = {};
  partner_searches_ = 0;
  stage_times_ = {};
}

bool ComponentInteraction::active(std::size_t pair) const {
  const auto target = static_cast<std::size_t>(pairs_[pair].target);
  return components_[target].type != ComponentType::gripper || grasp_active_[target] != 0;
}

void ComponentInteraction::update_poses(const CellMotion& motion, Clock clock) {
  const double begin = clock != nullptr ? clock() : 0.0;
  for (std::size_t i = 0; i < components_.size(); ++i)
    world_.set_pose(static_cast<int>(i), motion.bodies[i].X_WB);
  if (clock != nullptr) stage_times_.broad_phase_s += clock() - begin;
}

void ComponentInteraction::update_connections(const CellMotion& motion, std::span<const GraspState> grasps,
                                              Clock clock) {
  changes_.clear();
  for (const GraspState& grasp : grasps) {
    const auto palm = static_cast<std::size_t>(grasp.palm);
    grasp_active_[palm] = grasp.active ? 1 : 0;
    if (grasp.active) world_.set_box(grasp.palm, grasp.lower_G, grasp.upper_G);
  }
  detect(clock);
  search(clock, motion);
}

void ComponentInteraction::detect(Clock clock) {
  const double begin = clock != nullptr ? clock() : 0.0;
  bool changed = !graph_valid_;
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    char contact = 0;
    if (active(i)) {
      update_verdict(world_, pairs_[i].base, pairs_[i].target, verdicts_[i], counts_);
      contact = verdicts_[i].touching ? 1 : 0;
    }
    changed = changed || contact != in_contact_[i];
    in_contact_[i] = contact;
  }
  if (changed) {
    graph_.clear_contacts();
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      if (in_contact_[i] != 0) graph_.add_contact(pairs_[i].base, pairs_[i].target);
    }
    graph_.sort_contacts();
    graph_valid_ = false;
  }
  if (clock != nullptr) stage_times_.mpr_s += clock() - begin;
}

void ComponentInteraction::search(Clock clock, const CellMotion& motion) {
  if (graph_valid_) return;  // same contacts, same partners
  const double begin = clock != nullptr ? clock() : 0.0;
  graph_valid_ = true;
  for (const int part : parts_) {
    const int present = connections_[static_cast<std::size_t>(part)].partner;
    const int found = partner_search_.find(graph_, part, present);
    ++partner_searches_;
    if (found == present) continue;
    changes_.push_back({part, present, found});
    connect(part, found, motion);
  }
  soften_on_free_targets();
  if (clock != nullptr) stage_times_.partner_search_s += clock() - begin;
}

void ComponentInteraction::connect(int part, int partner, const CellMotion& motion) {
  Connection& connection = connections_[static_cast<std::size_t>(part)];
  connection = {};
  connection.partner = partner;
  if (partner == -1) return;
  const Component& base = components_[static_cast<std::size_t>(part)];
  const Component& target = components_[static_cast<std::size_t>(partner)];
  const BodyMotion& base_motion = motion.bodies[static_cast<std::size_t>(part)];
  const BodyMotion& target_motion = motion.bodies[static_cast<std::size_t>(partner)];
  capture_offset(base_motion, target_motion, connection);
  connection.gains = base.substitute;
  if (target.type == ComponentType::part) {
    // The sequence ends in a Part: nothing holds the assembly, it falls as one, and no weight is carried.
    // What the gains are depends on all that this Part holds: soften_on_free_targets().
    return;
  }
  if (parameters_.weight_feed_forward) connection.feed_forward_W = -(base.mass_kg * parameters_.gravity_W);
}

void ComponentInteraction::soften_on_free_targets() {
  softened_.clear();
  for (const PartnerChange& change : changes_) {
    if (change.to == -1) continue;
    const Component& target = components_[static_cast<std::size_t>(change.to)];
    if (target.type != ComponentType::part) continue;
    if (std::find(softened_.begin(), softened_.end(), change.to) != softened_.end()) continue;
    softened_.push_back(change.to);
    FreeTargetLoad load(target);
    for (const int part : parts_) {
      const Connection& connection = connections_[static_cast<std::size_t>(part)];
      if (connection.partner == change.to) load.add(components_[static_cast<std::size_t>(part)], connection);
    }
    const double scale = load.scale();
    for (const int part : parts_) {
      Connection& connection = connections_[static_cast<std::size_t>(part)];
      if (connection.partner != change.to) continue;
      // Never stiffer than it was: a stretched spring that stiffens would create energy.
      connection.softening = std::min(connection.softening, scale);
      connection.gains = scaled(components_[static_cast<std::size_t>(part)].substitute, connection.softening);
    }
  }
}

void ComponentInteraction::evaluate(const CellMotion& motion, std::span<Wrench> wrenches) const {
  std::fill(wrenches.begin(), wrenches.end(), Wrench{});
  for (const int part : parts_) {
    const Connection& connection = connections_[static_cast<std::size_t>(part)];
    if (connection.partner == -1) continue;
    const BodyMotion& base = motion.bodies[static_cast<std::size_t>(part)];
    const BodyMotion& target = motion.bodies[static_cast<std::size_t>(connection.partner)];
    const Wrench on_base = substitute_wrench(connection, base, target);
    wrenches[static_cast<std::size_t>(part)] += on_base;
    wrenches[static_cast<std::size_t>(connection.partner)] += reaction_on_target(on_base, base, target);
  }
}

}  // namespace takt
