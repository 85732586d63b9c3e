#include "server/contact/holding/component_interaction.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "server/contact/holding/ground_support.h"
#include "server/geometry/convex/distance.h"

namespace takt {

namespace {
// Bodies whose approach in a step is below this are at relative rest.
constexpr double kRested_m = 1e-7;
/// A Part at less than this speed does not fall.
constexpr double kAtRest_m_per_s = 1e-6;
/// More than can lie around a Part.
constexpr std::size_t kNeighbours = 64;

/// Of the convex shapes of two components that touch: the pair that overlaps deepest, or, within a margin, is nearest. Does not
/// allocate.
ConvexDistance deepest(const CollisionWorld& world, int a, int b, double margin_m = 0.0) {
  ConvexDistance result;
  result.distance = 1.0;
  for (const ConvexShape& shape_a : world.shapes(a)) {
    const Aabb box_a = shape_a.box.at(world.pose(a), margin_m);
    if (!box_a.overlaps(world.aabb(b))) continue;
    for (const ConvexShape& shape_b : world.shapes(b)) {
      if (!shape_b.box.at(world.pose(b), margin_m).overlaps(box_a)) continue;
      const ConvexDistance found = convex_distance(shape_a, world.pose(a), shape_b, world.pose(b));
      if (found.distance < result.distance) result = found;
    }
  }
  return result;
}
}  // namespace

ComponentInteraction::ComponentInteraction(const std::vector<Component>& components,
                                           const ComponentPairs& pairs,
                                           const InteractionParameters& parameters)
    : components_(components),
      parameters_(parameters),
      collision_world_(components, parameters.contact_margin_m, parameters.exact_sleeping),
      holds_(components.size()),
      graph_(components.size()),
      connections_(components, pairs.size(), parameters),
      shown_search_(components.size()),
      shown_partner_(components.size(), -1),
      broad_phase_(components.size()),
      near_(components.size()),
      reached_(components.size(), 0) {
  for (int base = 0; base < pairs.table().base_count(); ++base) {
    if (pairs.kind_of_base(base) != PairKind::hold) continue;
    for (std::size_t i = pairs.table().begin_of(base); i < pairs.table().end_of(base); ++i) {
      const int target = pairs.table().target(i);
      const GripperRole role = components[static_cast<std::size_t>(target)].role;
      if (role != GripperRole::left_jaw && role != GripperRole::right_jaw) pairs_.add(base, target);
    }
  }
  pairs_.shrink_to_fit();
  const std::size_t near_pairs = std::min(pairs_.size(), kNeighbours * components.size());
  queries_.reserve(parameters.exact_sleeping ? near_pairs : pairs_.size());
  if (!parameters.exact_sleeping) {
    verdicts_.resize(pairs_.size());
  } else {
    verdicts_.reserve(near_pairs);
    free_verdicts_.reserve(near_pairs);
  }
  in_contact_.resize(pairs_.size(), 0);
  by_contact_.resize(pairs_.size(), 0);
  held_.resize(pairs_.size(), 0);
  for (std::size_t i = 0; i < components.size(); ++i) {
    graph_.vertices[i] = {components[i].type, components[i].hierarchy};
    // A step does not allocate: room for all on a Ground, and for more than can lie around a Part.
    const std::size_t room = components[i].type == ComponentType::part
                                 ? std::min(components.size(), kNeighbours)
                                 : components.size();
    graph_.neighbours[i].reserve(room);
    near_[i].reserve(room);
    if (components[i].type == ComponentType::part) parts_.push_back(static_cast<int>(i));
    if (components[i].role == GripperRole::palm) {
      // The grasp volume: a box whose bounds follow the jaws.
      collision_world_.set_shape(static_cast<int>(i),
                                 ConvexShape::from_points(std::vector<Vec3>(8, Vec3::Zero())));
    }
  }
  for (std::size_t i = 0; i < components.size(); ++i)
    if (components[i].role == GripperRole::palm) holds_[i].reserve(parts_.size());
  shown_graph_ = graph_;
  shown_changes_.reserve(components.size());
  for (auto* list : {&work_, &found_, &toggled_, &changed_parts_}) list->reserve(2 * components.size());
  touched_.reserve(near_pairs);
  pushed_out_.reserve(components.size());
}

void ComponentInteraction::reset() {
  if (parameters_.exact_sleeping)
    verdicts_.clear(), free_verdicts_.clear();
  else
    std::fill(verdicts_.begin(), verdicts_.end(), PairVerdict{});
  std::fill(in_contact_.begin(), in_contact_.end(), 0);
  std::fill(held_.begin(), held_.end(), 0);
  for (std::vector<int>& held : holds_) held.clear();
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
  touched_.clear();
  std::fill(reached_.begin(), reached_.end(), 0);  // marks of a step that ended half-way, in a fault
  known_calls_ = 0;
  counts_ = {};
  stage_times_ = {};
}

void ComponentInteraction::set_by_contact(const PairPredicate& acts) {
  any_by_contact_ = false;
  for (int base = 0; base < pairs_.base_count(); ++base) {
    for (std::size_t i = pairs_.begin_of(base); i < pairs_.end_of(base); ++i) {
      by_contact_[i] = acts(base, pairs_.target(i)) ? 1 : 0;
      any_by_contact_ = any_by_contact_ || by_contact_[i] != 0;
    }
  }
  rebuild_graphs();
  for (const int part : parts_) {
    shown_partner_[static_cast<std::size_t>(part)] = connections_.partner(part);
    mark_changed(part);
  }
}

bool ComponentInteraction::active(std::size_t pair) const {
  const auto target = static_cast<std::size_t>(pairs_.target(pair));
  return components_[target].type != ComponentType::gripper || held_[pair] != 0;
}

void ComponentInteraction::update_poses(const CellMotion& motion, std::span<const int> moved, Clock clock) {
  const double begin = clock != nullptr ? clock() : 0.0;
  for (const int i : moved)
    if (!collision_world_.set_pose(i, motion.bodies[static_cast<std::size_t>(i)].X_WB)) refused_pose_ = i;
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
  connections_.begin_step(motion);
  shown_changes_.clear();
  for (const GraspState& grasp : grasps) {
    set_held(grasp);
    if (!grasp.held.empty()) collision_world_.set_box(grasp.palm, grasp.lower_G, grasp.upper_G);
  }
  detect(clock);
  connect(clock, motion);
}

void ComponentInteraction::set_held(const GraspState& grasp) {
  std::vector<int>& present = holds_[static_cast<std::size_t>(grasp.palm)];
  if (present == grasp.held) return;
  const auto mark = [&](int part, char held) {
    if (const int pair = find_pair(part, grasp.palm); pair >= 0) held_[static_cast<std::size_t>(pair)] = held;
  };
  for (const int part : present) mark(part, 0);
  for (const int part : grasp.held) mark(part, 1);
  present.assign(grasp.held.begin(), grasp.held.end());
  toggled_.push_back(grasp.palm);
}

bool ComponentInteraction::gripped(int part, int palm) const {
  const int pair = find_pair(part, palm);
  return pair >= 0 && in_contact_[static_cast<std::size_t>(pair)] != 0;
}

std::span<const int> ComponentInteraction::parts_between(int palm, const Vec3& lower_G, const Vec3& upper_G) {
  collision_world_.set_box(palm, lower_G, upper_G);
  const Pose X_WG = collision_world_.pose(palm);
  static_cast<void>(parts_near_sweep(palm, X_WG, X_WG));
  if (!begun_) found_.assign(parts_.begin(), parts_.end());
  std::erase_if(found_, [&](int part) {
    return !collision_world_.boxes_overlap(part, palm) ||
           !collision_world_.shapes_overlap(part, palm, counts_);
  });
  return found_;
}

void ComponentInteraction::detect(Clock clock) {
  const double begin = clock != nullptr ? clock() : 0.0;
  // The calls of the pairs' last tests estimate those of this step.
  sharing_ = queries_.begin(known_calls_);
  retested_calls_ = 0;
  if (parameters_.exact_sleeping)
    detect_moved();
  else
    detect_all();
  if (sharing_) {
    queries_.run(collision_world_, verdicts_, counts_);
    for (const PairQueries::Item& item : queries_.items()) finish_check(item);
  }
  queries_.end();
  if (parameters_.exact_sleeping) counts_.mpr_skipped += known_calls_ - retested_calls_;
  collision_world_.clear_moved();
  toggled_.clear();
  if (clock != nullptr) stage_times_.mpr_s += clock() - begin;
}

void ComponentInteraction::detect_all() {
  for (int base = 0; base < pairs_.base_count(); ++base) {
    for (std::size_t i = pairs_.begin_of(base); i < pairs_.end_of(base); ++i) {
      verdicts_[i].version_base = 0;  // as if it had moved
      const auto place = static_cast<std::uint32_t>(i);
      check({place, place, base, pairs_.target(i)});
    }
  }
}

void ComponentInteraction::detect_moved() {
  if (!begun_) {
    begin_near();
    for (std::size_t i = 0; i < pairs_.size(); ++i) {  // stored before load()
      if (in_contact_[i] == 0) continue;
      const int base = pairs_.base(i), target = pairs_.target(i);
      if (!broad_phase_.near(base, target)) set_contact(i, base, target, false);
    }
    for (std::size_t c = 0; c < components_.size(); ++c)
      for (const Near& near : near_[c]) check(ends_of(static_cast<int>(c), near));
  } else {
    follow_moved();
    work_.assign(collision_world_.moved().begin(), collision_world_.moved().end());
    work_.insert(work_.end(), toggled_.begin(), toggled_.end());
    for (const int c : work_)
      for (const Near& near : near_[static_cast<std::size_t>(c)]) check(ends_of(c, near));
  }
}

void ComponentInteraction::begin_near() {
  std::vector<Aabb> boxes;
  boxes.reserve(components_.size());
  for (std::size_t c = 0; c < components_.size(); ++c) {
    boxes.push_back(collision_world_.aabb(static_cast<int>(c)));
    near_[c].clear();
  }
  verdicts_.clear(), free_verdicts_.clear();
  broad_phase_.build(boxes);
  for (std::size_t c = 0; c < components_.size(); ++c) refresh_near(static_cast<int>(c));
  begun_ = true;
}

void ComponentInteraction::follow_moved() {
  for (const int c : collision_world_.moved())
    if (broad_phase_.update(c, collision_world_.aabb(c))) refresh_near(c);
}

std::span<const int> ComponentInteraction::parts_near_sweep(int component, const Pose& from, const Pose& to) {
  if (!begun_) return parts_;  // empty broad phase, or no reuse of results
  const Aabb first = collision_world_.aabb_at(component, from);
  const Aabb last = collision_world_.aabb_at(component, to);
  found_.clear();
  broad_phase_.find({first.lower.cwiseMin(last.lower), first.upper.cwiseMax(last.upper)}, found_);
  std::erase_if(
      found_, [this](int c) { return components_[static_cast<std::size_t>(c)].type != ComponentType::part; });
  std::sort(found_.begin(), found_.end());
  return found_;
}

void ComponentInteraction::parts_near(const Aabb& box, std::vector<int>& parts) {
  found_.clear();
  if (begun_)
    broad_phase_.find(box, found_);
  else
    found_.assign(parts_.begin(), parts_.end());
  parts.clear();
  for (const int c : found_)
    if (components_[static_cast<std::size_t>(c)].type == ComponentType::part &&
        collision_world_.aabb(c).overlaps(box))
      parts.push_back(c);
  std::sort(parts.begin(), parts.end());
}

void ComponentInteraction::refresh_near(int component) {
  std::vector<Near>& mine = near_[static_cast<std::size_t>(component)];
  const auto forget = [this](int owner, std::uint32_t pair) {
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
    known_calls_ -= verdicts_[near.verdict].calls;
    verdicts_[near.verdict] = {};
    free_verdicts_.push_back(near.verdict);
    const PairQueries::Item ends = ends_of(component, near);
    set_contact(near.pair, ends.base, ends.target, false);
  }
  found_.clear();
  broad_phase_.find(broad_phase_.large_box(component), found_);
  for (const int other : found_) {
    const int pair = find_pair(component, other);
    if (pair < 0) continue;
    const auto index = static_cast<std::uint32_t>(pair);
    const std::vector<Near>& theirs = near_[static_cast<std::size_t>(other)];
    const std::vector<Near>& shorter = mine.size() <= theirs.size() ? mine : theirs;
    if (std::any_of(shorter.begin(), shorter.end(), [index](const Near& n) { return n.pair == index; }))
      continue;
    if (free_verdicts_.empty()) {
      free_verdicts_.push_back(static_cast<std::uint32_t>(verdicts_.size()));
      verdicts_.emplace_back();
    }
    const std::uint32_t verdict = free_verdicts_.back();
    free_verdicts_.pop_back();
    mine.push_back({other, index, verdict});
    near_[static_cast<std::size_t>(other)].push_back({component, index, verdict});
  }
}

PairQueries::Item ComponentInteraction::ends_of(int component, const Near& near) const {
  const int target = pairs_.target(near.pair);
  return {near.pair, near.verdict, target == component ? near.other : component, target};
}

void ComponentInteraction::check(const PairQueries::Item& pair) {
  PairVerdict& verdict = verdicts_[pair.verdict];
  const std::uint64_t before = verdict.calls;
  if (!active(pair.pair)) {
    known_calls_ -= before;
    verdict = {};
    set_contact(pair.pair, pair.base, pair.target, false);
    return;
  }
  if (!begin_verdict(collision_world_, pair.base, pair.target, verdict, counts_)) return;
  known_calls_ -= before;
  if (collision_world_.boxes_overlap(pair.base, pair.target)) {
    if (sharing_) {
      queries_.add(pair, before);
      return;
    }
    query_verdict(collision_world_, pair.base, pair.target, verdict, counts_);
  }
  finish_check(pair);
}

void ComponentInteraction::finish_check(const PairQueries::Item& pair) {
  const PairVerdict& verdict = verdicts_[pair.verdict];
  known_calls_ += verdict.calls;
  retested_calls_ += verdict.calls;
  set_contact(pair.pair, pair.base, pair.target, verdict.touching);
}

int ComponentInteraction::find_pair(int a, int b) const {
  const std::size_t pair = pairs_.find_either(a, b);
  return pair == PairTable::kNone ? -1 : static_cast<int>(pair);
}

void ComponentInteraction::set_contact(std::size_t pair, int base, int target, bool contact) {
  if ((in_contact_[pair] != kApart) == contact) {
    // A Part that falls along a Ground is held by what is below it.
    const bool supported = in_contact_[pair] == kHangs && contact;
    if (!supported || !supports(collision_world_, parameters_, target, base)) return;
  }
  in_contact_[pair] = contact ? kHolds : kApart;
  const auto note = [&](ContactGraph& graph) {
    if (contact)
      graph.add_contact(base, target);
    else if (!attached(base, target))
      graph.remove_contact(base, target);
  };
  if (by_contact_[pair] == 0) note(graph_);
  if (contact && by_contact_[pair] == 0 && !is_gripper(target)) touched_.push_back(pair);
  if (any_by_contact_) note(shown_graph_);
  mark_changed(base);
  mark_changed(target);
}

void ComponentInteraction::connect(Clock clock, const CellMotion& motion) {
  if (changed_parts_.empty()) return;  // same contacts, same connections
  const double begin = clock != nullptr ? clock() : 0.0;
  // A search follows contacts from Part to Part, so a contact matters to the Parts connected with its ends.
  // Parts connected by the old contact alone are reached from the other end.
  for (std::size_t i = 0; i < changed_parts_.size(); ++i) {
    for (const int neighbour : graph().neighbours[static_cast<std::size_t>(changed_parts_[i])]) {
      const auto n = static_cast<std::size_t>(neighbour);
      if (graph_.vertices[n].type != ComponentType::part || reached_[n] != 0) continue;
      reached_[n] = 1;
      changed_parts_.push_back(neighbour);
    }
  }
  std::sort(changed_parts_.begin(), changed_parts_.end());
  const GroundContacts grounds{components_, parameters_, collision_world_, pairs_,
                               by_contact_, in_contact_, graph_,           shown_graph_};
  for (const int part : changed_parts_) {
    reached_[static_cast<std::size_t>(part)] = 0;
    // Not of a Part that a Ground or another Part holds, nor of one that is placed at rest.
    const int holder = connections_.partner(part);
    if (holder >= 0 ? is_gripper(holder)
                    : motion.bodies[static_cast<std::size_t>(part)].V_WB.v.norm() > kAtRest_m_per_s)
      grounds.drop_unsupported(part);
  }
  connections_.update(graph_, changed_parts_, motion);
  push_out(motion);
  if (any_by_contact_) show_partners();
  changed_parts_.clear();
  if (clock != nullptr) stage_times_.partner_search_s += clock() - begin;
}

bool ComponentInteraction::caught(int part) const {
  const std::span<const PartnerChange> changes = connections_.changes();
  return std::any_of(changes.begin(), changes.end(), [&](const PartnerChange& change) {
    return change.part == part && change.to >= 0 && !is_gripper(change.to);
  });
}

ConvexDistance ComponentInteraction::nearest(int a, int b) const {
  return deepest(collision_world_, a, b, parameters_.contact_margin_m);
}

void ComponentInteraction::push_out(const CellMotion& motion) {
  if (parameters_.step_s > 0.0) {
    std::sort(touched_.begin(), touched_.end());
    pushed_out_.clear();
    for (const std::size_t pair : touched_) push_out(pairs_.base(pair), pairs_.target(pair), motion);
  }
  touched_.clear();
}

/// A pair that begins to touch in this step was apart at its start: its depth is at most the approach in the
/// step. Deeper overlaps come from convex shapes that exceed their solid; they stay.
void ComponentInteraction::push_out(int base_id, int target_id, const CellMotion& motion) {
  const bool search = parameters_.algorithm == InteractionAlgorithm::partner_search;
  const bool base_caught = caught(base_id), target_caught = caught(target_id);
  if (search && !base_caught && !target_caught) return;
  const BodyMotion& base = motion.bodies[static_cast<std::size_t>(base_id)];
  const BodyMotion& target = motion.bodies[static_cast<std::size_t>(target_id)];
  const ConvexDistance found = deepest(collision_world_, base_id, target_id);
  if (!(found.distance < 0.0)) return;
  const auto velocity = [&](const BodyMotion& body) { return body.V_WB.at(found.point_A_W - body.X_WB.p); };
  const double approach = (velocity(base) - velocity(target)).dot(found.normal_W) * parameters_.step_s;
  const double depth = std::min(-found.distance, approach);
  if (!(depth > kRested_m)) return;
  const auto push = [&](int part, int other, const Vec3& away_W) {
    auto earlier = std::find_if(pushed_out_.begin(), pushed_out_.end(),
                                [part](const auto& pushed) { return pushed.first == part; });
    if (earlier == pushed_out_.end()) earlier = pushed_out_.insert(pushed_out_.end(), {part, Vec3::Zero()});
    const double left = depth - earlier->second.dot(away_W);
    if (!(left > 0.0)) return;
    earlier->second += left * away_W;
    connections_.shift(part, other, left * away_W, motion);
  };
  if (!search) {
    push(base_id, target_id, -found.normal_W);
    if (!is_gripper(target_id)) push(target_id, base_id, found.normal_W);
  } else if (base_caught) {
    push(base_id, -1, -found.normal_W);
  } else {
    push(target_id, -1, found.normal_W);
  }
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

}  // namespace takt
