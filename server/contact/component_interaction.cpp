#include "server/contact/component_interaction.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace takt {

ComponentInteraction::ComponentInteraction(const std::vector<Component>& components,
                                           const std::vector<ComponentPair>& pairs,
                                           const InteractionParameters& parameters)
    : components_(components),
      parameters_(parameters),
      world_(components, parameters.contact_margin_m, parameters.skip_resting),
      queries_(pairs.size()),
      grasp_active_(components.size(), 0),
      graph_(components.size()),
      connections_(components, pairs.size(), parameters),
      shown_search_(components.size()),
      shown_partner_(components.size(), -1),
      broad_phase_(components.size()),
      near_(components.size()),
      reached_(components.size(), 0) {
  for (const ComponentPair& pair : pairs) {
    const GripperRole role = components[static_cast<std::size_t>(pair.target)].role;
    if (pair.kind == PairKind::hold && role != GripperRole::left_jaw && role != GripperRole::right_jaw) {
      pairs_.push_back(pair);
    }
  }
  verdicts_.resize(pairs_.size());
  in_contact_.resize(pairs_.size(), 0);
  by_contact_.resize(pairs_.size(), 0);
  for (std::size_t i = 0; i < components.size(); ++i) {
    graph_.vertices[i] = {components[i].type, components[i].hierarchy};
    graph_.neighbours[i].reserve(components.size());
    // A step does not allocate: room for all on a Ground, and for more than can lie around a Part.
    near_[i].reserve(components[i].type == ComponentType::part ? std::min<std::size_t>(components.size(), 64)
                                                               : components.size());
    if (components[i].type == ComponentType::part) parts_.push_back(static_cast<int>(i));
    if (components[i].role == GripperRole::palm) {
      // The grasp volume: a box whose bounds follow the jaws.
      world_.set_shape(static_cast<int>(i), ConvexShape::from_points(std::vector<Vec3>(8, Vec3::Zero())));
    }
  }
  shown_graph_ = graph_;
  shown_changes_.reserve(components.size());
  for (auto* list : {&work_, &found_, &toggled_, &changed_parts_}) list->reserve(2 * components.size());
}

void ComponentInteraction::reset() {
  std::fill(verdicts_.begin(), verdicts_.end(), PairVerdict{});
  std::fill(in_contact_.begin(), in_contact_.end(), 0);
  std::fill(grasp_active_.begin(), grasp_active_.end(), 0);
  connections_.reset();
  graph_.clear_contacts();
  shown_graph_.clear_contacts();
  std::fill(graph_.holds.begin(), graph_.holds.end(), -1);
  std::fill(shown_graph_.holds.begin(), shown_graph_.holds.end(), -1);
  std::fill(shown_partner_.begin(), shown_partner_.end(), -1);
  shown_changes_.clear();
  begun_ = false;
  refused_pose_ = -1;
  toggled_.clear();
  changed_parts_.clear();
  std::fill(reached_.begin(), reached_.end(), 0);  // marks of a step that ended half-way, in a fault
  known_calls_ = 0;
  counts_ = {};
  stage_times_ = {};
}

void ComponentInteraction::set_by_contact(const std::vector<std::pair<int, int>>& pairs) {
  std::fill(by_contact_.begin(), by_contact_.end(), 0);
  any_by_contact_ = false;
  for (const auto& [a, b] : pairs) {
    const int pair = find_pair(a, b);
    if (pair < 0) continue;  // a jaw: its gripper's palm stands for it
    by_contact_[static_cast<std::size_t>(pair)] = 1;
    any_by_contact_ = true;
  }
  rebuild_graphs();
  for (const int part : parts_) {
    shown_partner_[static_cast<std::size_t>(part)] = connections_.partner(part);
    mark_changed(part);
  }
}

bool ComponentInteraction::active(std::size_t pair) const {
  const auto target = static_cast<std::size_t>(pairs_[pair].target);
  return components_[target].type != ComponentType::gripper || grasp_active_[target] != 0;
}

void ComponentInteraction::update_poses(const CellMotion& motion, std::span<const int> moved, Clock clock) {
  const double begin = clock != nullptr ? clock() : 0.0;
  for (const int i : moved)
    if (!world_.set_pose(i, motion.bodies[static_cast<std::size_t>(i)].X_WB)) refused_pose_ = i;
  if (begun_) follow_moved();
  if (clock != nullptr) stage_times_.broad_phase_s += clock() - begin;
}

void ComponentInteraction::update_poses(const CellMotion& motion, Clock clock) {
  work_.resize(components_.size());
  std::iota(work_.begin(), work_.end(), 0);
  update_poses(motion, work_, clock);
}

void ComponentInteraction::update_connections(const CellMotion& motion, std::span<const GraspState> grasps,
                                              Clock clock) {
  connections_.begin_step();
  shown_changes_.clear();
  for (const GraspState& grasp : grasps) {
    const auto palm = static_cast<std::size_t>(grasp.palm);
    if ((grasp_active_[palm] != 0) != grasp.active) toggled_.push_back(grasp.palm);
    grasp_active_[palm] = grasp.active ? 1 : 0;
    if (grasp.active) world_.set_box(grasp.palm, grasp.lower_G, grasp.upper_G);
  }
  detect(clock);
  connect(clock, motion);
}

void ComponentInteraction::detect(Clock clock) {
  const double begin = clock != nullptr ? clock() : 0.0;
  // The pairs' last tests tell how many calls are to be expected.
  sharing_ = queries_.begin(known_calls_);
  retested_calls_ = 0;
  if (parameters_.skip_resting)
    detect_moved();
  else
    detect_all();
  if (sharing_) {
    queries_.run(world_, pairs_, verdicts_, counts_);
    for (const PairQueries::Item& item : queries_.items()) finish_check(item.pair);
  }
  queries_.end();
  if (parameters_.skip_resting) counts_.mpr_skipped += known_calls_ - retested_calls_;
  world_.clear_moved();
  toggled_.clear();
  if (clock != nullptr) stage_times_.mpr_s += clock() - begin;
}

void ComponentInteraction::detect_all() {
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    verdicts_[i].version_base = 0;  // as if it had moved
    check(i);
  }
}

void ComponentInteraction::detect_moved() {
  if (!begun_) {
    begin_near();
    for (std::size_t i = 0; i < pairs_.size(); ++i)  // of before load()
      if (in_contact_[i] != 0 && !broad_phase_.near(pairs_[i].base, pairs_[i].target)) set_contact(i, false);
    for (std::size_t c = 0; c < components_.size(); ++c)
      for (const Near& near : near_[c]) check(near.pair);
  } else {
    follow_moved();
    work_.assign(world_.moved().begin(), world_.moved().end());
    work_.insert(work_.end(), toggled_.begin(), toggled_.end());
    for (const int c : work_)
      for (const Near& near : near_[static_cast<std::size_t>(c)]) check(near.pair);
  }
}

void ComponentInteraction::begin_near() {
  std::vector<Aabb> boxes;
  boxes.reserve(components_.size());
  for (std::size_t c = 0; c < components_.size(); ++c) {
    boxes.push_back(world_.aabb(static_cast<int>(c)));
    near_[c].clear();
  }
  broad_phase_.build(boxes);
  for (std::size_t c = 0; c < components_.size(); ++c) refresh_near(static_cast<int>(c));
  begun_ = true;
}

void ComponentInteraction::follow_moved() {
  for (const int c : world_.moved())
    if (broad_phase_.update(c, world_.aabb(c))) refresh_near(c);
}

std::span<const int> ComponentInteraction::parts_near_sweep(int component, const Pose& from, const Pose& to) {
  if (!begun_) return parts_;  // nothing is known yet, or nothing shall be remembered
  const Aabb first = world_.aabb_at(component, from);
  const Aabb last = world_.aabb_at(component, to);
  found_.clear();
  broad_phase_.find({first.lower.cwiseMin(last.lower), first.upper.cwiseMax(last.upper)}, found_);
  std::erase_if(
      found_, [this](int c) { return components_[static_cast<std::size_t>(c)].type != ComponentType::part; });
  std::sort(found_.begin(), found_.end());
  return found_;
}

void ComponentInteraction::refresh_near(int component) {
  std::vector<Near>& mine = near_[static_cast<std::size_t>(component)];
  const auto forget = [this](int owner, std::size_t pair) {
    std::vector<Near>& list = near_[static_cast<std::size_t>(owner)];
    const auto it = std::find_if(list.begin(), list.end(), [pair](const Near& n) { return n.pair == pair; });
    *it = list.back();
    list.pop_back();
  };
  for (std::size_t i = mine.size(); i-- > 0;) {
    const Near near = mine[i];
    if (broad_phase_.near(component, near.other)) continue;
    forget(near.other, near.pair);
    forget(component, near.pair);
    known_calls_ -= verdicts_[near.pair].calls;
    verdicts_[near.pair] = {};
    set_contact(near.pair, false);
  }
  found_.clear();
  broad_phase_.find(broad_phase_.large_box(component), found_);
  for (const int other : found_) {
    const int pair = find_pair(component, other);
    if (pair < 0) continue;
    const auto index = static_cast<std::size_t>(pair);
    const std::vector<Near>& theirs = near_[static_cast<std::size_t>(other)];
    const std::vector<Near>& shorter = mine.size() <= theirs.size() ? mine : theirs;
    if (std::any_of(shorter.begin(), shorter.end(), [index](const Near& n) { return n.pair == index; }))
      continue;
    mine.push_back({other, index});
    near_[static_cast<std::size_t>(other)].push_back({component, index});
  }
}

void ComponentInteraction::check(std::size_t pair) {
  PairVerdict& verdict = verdicts_[pair];
  const ComponentPair& ends = pairs_[pair];
  const std::uint64_t before = verdict.calls;
  if (!active(pair)) {
    known_calls_ -= before;
    verdict = {};
    set_contact(pair, false);
    return;
  }
  if (!begin_verdict(world_, ends.base, ends.target, verdict, counts_)) return;
  known_calls_ -= before;
  if (world_.boxes_overlap(ends.base, ends.target)) {
    if (sharing_) {
      queries_.add(pair, ends, before);
      return;
    }
    query_verdict(world_, ends.base, ends.target, verdict, counts_);
  }
  finish_check(pair);
}

void ComponentInteraction::finish_check(std::size_t pair) {
  known_calls_ += verdicts_[pair].calls;
  retested_calls_ += verdicts_[pair].calls;
  set_contact(pair, verdicts_[pair].touching);
}

int ComponentInteraction::find_pair(int a, int b) const {
  for (const auto& [base, target] : {std::pair{a, b}, std::pair{b, a}}) {
    const auto it = std::lower_bound(pairs_.begin(), pairs_.end(), std::pair{base, target},
                                     [](const ComponentPair& p, const std::pair<int, int>& key) {
                                       return std::pair{p.base, p.target} < key;
                                     });
    if (it != pairs_.end() && it->base == base && it->target == target)
      return static_cast<int>(it - pairs_.begin());
  }
  return -1;
}

void ComponentInteraction::set_contact(std::size_t pair, bool contact) {
  if ((in_contact_[pair] != 0) == contact) return;
  in_contact_[pair] = contact ? 1 : 0;
  const ComponentPair& p = pairs_[pair];
  const auto note = [&](ContactGraph& graph) {
    if (contact)
      graph.add_contact(p.base, p.target);
    else if (!attached(p.base, p.target))
      graph.remove_contact(p.base, p.target);
  };
  if (by_contact_[pair] == 0) note(graph_);
  if (any_by_contact_) note(shown_graph_);
  mark_changed(p.base);
  mark_changed(p.target);
}

void ComponentInteraction::connect(Clock clock, const CellMotion& motion) {
  if (changed_parts_.empty()) return;  // same contacts, same connections
  const double begin = clock != nullptr ? clock() : 0.0;
  // A search follows contacts from Part to Part, so a contact matters to the Parts connected with its ends.
  // Those that only the old contact connected are reached from the other end.
  for (std::size_t i = 0; i < changed_parts_.size(); ++i) {
    for (const int neighbour : graph().neighbours[static_cast<std::size_t>(changed_parts_[i])]) {
      const auto n = static_cast<std::size_t>(neighbour);
      if (graph_.vertices[n].type != ComponentType::part || reached_[n] != 0) continue;
      reached_[n] = 1;
      changed_parts_.push_back(neighbour);
    }
  }
  std::sort(changed_parts_.begin(), changed_parts_.end());
  for (const int part : changed_parts_) reached_[static_cast<std::size_t>(part)] = 0;
  connections_.update(graph_, changed_parts_, motion);
  if (any_by_contact_) show_partners();
  changed_parts_.clear();
  if (clock != nullptr) stage_times_.partner_search_s += clock() - begin;
}

void ComponentInteraction::show_partners() {
  for (const int part : changed_parts_) {
    int& shown = shown_partner_[static_cast<std::size_t>(part)];
    int found = connections_.partner(part);
    if (found == -1) found = shown_search_.find(shown_graph_, part, shown);
    if (found == shown) continue;
    shown_changes_.push_back({part, shown, found});
    shown = found;
  }
}

void ComponentInteraction::evaluate(const CellMotion& motion, std::span<Wrench> wrenches) const {
  std::fill(wrenches.begin(), wrenches.end(), Wrench{});
  evaluate(motion, parts_, wrenches);
}

}  // namespace takt
