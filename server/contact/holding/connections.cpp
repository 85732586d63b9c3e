#include "server/contact/holding/connections.h"

#include <algorithm>

namespace takt {

namespace {
// Reserved connections per Part: a cube in a dense lattice touches 26 others, and each of those connections
// has two ends.
constexpr std::size_t kRoomPerPart = 32;
}  // namespace

Connections::Connections(const std::vector<Component>& components, std::size_t pair_count,
                         const InteractionParameters& parameters)
    : components_(components),
      parameters_(parameters),
      first_(components.size() + 1, 0),
      partner_(components.size(), -1),
      passes_to_(components.size(), -1),
      stiffness_(components.size(), 1.0),
      decided_(components.size(), 0),
      scale_(components.size(), 1.0),
      renew_(components.size(), Renewal::none),
      yielding_(components.size()),
      partner_search_(components.size()),
      tree_(components) {
  for (std::size_t i = 0; i < components.size(); ++i)
    if (components[i].type == ComponentType::part) parts_.push_back(static_cast<int>(i));
  const bool single = parameters.algorithm == InteractionAlgorithm::partner_search;
  const std::size_t room = single ? parts_.size() : std::min(pair_count, kRoomPerPart * parts_.size());
  list_.reserve(room);
  next_.reserve(room);
  wanted_.reserve(room);
  // Each connection that opens or closes disturbs two; each that stays may be disturbed by its load and
  // gains.
  disturbed_.reserve(6 * room + parts_.size());
  changes_.reserve(parts_.size());
  turning_.reserve(parts_.size());
  softened_.reserve(components.size());
  closed_on_.reserve(room);
}

void Connections::reset() {
  ++version_;
  list_.clear();
  std::fill(first_.begin(), first_.end(), 0);
  std::fill(partner_.begin(), partner_.end(), -1);
  std::fill(passes_to_.begin(), passes_to_.end(), -1);
  std::fill(renew_.begin(), renew_.end(), Renewal::none);
  std::fill(stiffness_.begin(), stiffness_.end(), 1.0);
  tree_.reset();
  end_turns();
  partner_searches_ = 0;
}

void Connections::turn(int part, const ConnectionTurn& turn) {
  ++version_;
  for (PairConnection& pair : mutable_of(part)) {
    turn_offset(turn, pair.connection);
    mark_changed(pair);
  }
  turning_.push_back(part);
}

void Connections::shift(int part, int target, const Vec3& shift_W, const CellMotion& motion) {
  ++version_;
  for (PairConnection& pair : mutable_of(part)) {
    Connection& connection = pair.connection;
    if (target != -1 && connection.partner != target) continue;
    const Pose& X_WT = motion.carrier(connection.partner).X_WB;
    connection.p_TBcm_T += X_WT.R.transpose() * shift_W;
    mark_changed(pair);
  }
}

void Connections::set_stiffness(int part, double ratio) {
  double& stiffness = stiffness_[static_cast<std::size_t>(part)];
  if (stiffness == ratio) return;
  stiffness = ratio;
  if (!of(part).empty()) recompute_gains(part, Renewal::own);
}

SubstituteParameters Connections::own_gains(int part, double softening) const {
  const double factor = softening * stiffness_[static_cast<std::size_t>(part)];
  const SubstituteParameters& own = component(part).substitute;
  return factor == 1.0 ? own : scaled(own, factor);
}

void Connections::begin_step(const CellMotion& motion) {
  if (may_slide_) {
    for (PairConnection& pair : list_) {
      Connection& connection = pair.connection;
      if (!connection.slides) continue;
      ++version_;
      const Mat3& R_WT = motion.carrier(connection.partner).X_WB.R;
      connection.p_TBcm_T +=
          R_WT.transpose() * ((motion.time_s - connection.slide_from_s) * connection.slide_W);
      connection.slide_W = Vec3::Zero();
      connection.slides = false;
    }
  }
  end_turns();
}

void Connections::slide(int part, const Vec3& velocity_W, const CellMotion& motion) {
  ++version_;
  for (PairConnection& pair : mutable_of(part)) {
    if (pair.connection.partner != partner(part)) continue;
    pair.connection.slide_W = velocity_W;
    pair.connection.slide_from_s = motion.time_s;
    pair.connection.slides = true;
    mark_changed(pair);
  }
}

void Connections::end_turns() {
  if (!turning_.empty()) ++version_;
  for (const int part : turning_)
    for (PairConnection& pair : mutable_of(part)) pair.connection.turn = {};
  turning_.clear();
  changes_.clear();
  disturbed_.clear();
}

void Connections::update(const ContactGraph& graph, std::span<const int> parts, const CellMotion& motion) {
  if (!parts.empty()) ++version_;
  wanted_.clear();
  closed_on_.clear();
  const bool single = parameters_.algorithm == InteractionAlgorithm::partner_search;
  if (single)
    search(graph, parts);
  else
    follow_rules(graph, parts);
  if (!as_wanted(parts)) open_and_close(parts, motion);
  if (single) {
    soften_on_free_targets();
  } else {
    assign_supports(graph, parts);
    soften_attached(graph, parts);
    soften_free_clusters(graph, parts, motion);
  }
  soften_on_grippers(graph, parts);
}

void Connections::search(const ContactGraph& graph, std::span<const int> parts) {
  for (const int part : parts) {
    int& partner = partner_[static_cast<std::size_t>(part)];
    const int attached_to = graph.holds[static_cast<std::size_t>(part)];
    int found = partner_search_.find(graph, part, partner);
    if (found == -1) found = attached_to;
    ++partner_searches_;
    if (found != -1) wanted_.emplace_back(part, found);
    if (found == partner) continue;
    changes_.push_back({part, partner, found});
    partner = found;
  }
}

void Connections::follow_rules(const ContactGraph& graph, std::span<const int> parts) {
  for (const int part : parts) {
    if (const int attached_to = graph.holds[static_cast<std::size_t>(part)]; attached_to != -1)
      wanted_.emplace_back(part, attached_to);
    else if (parameters_.algorithm == InteractionAlgorithm::substitute_force)
      substitute_force_connections(graph, part, wanted_);
    else
      extended_substitute_force_connections(graph, part, partner(part), wanted_);
  }
}

bool Connections::as_wanted(std::span<const int> parts) const {
  auto wanted = wanted_.begin();
  for (const int part : parts) {
    for (const PairConnection& pair : of(part)) {
      if (wanted == wanted_.end() || *wanted != pair.key() || renewed(pair)) return false;
      ++wanted;
    }
  }
  return wanted == wanted_.end();
}

PairConnection Connections::close(const ConnectionKey& key, const CellMotion& motion) const {
  PairConnection pair;
  pair.base = key.first;
  pair.connection.partner = key.second;
  const Component& base = component(key.first);
  capture_offset(motion.bodies[static_cast<std::size_t>(key.first)], motion.carrier(key.second),
                 pair.connection);
  pair.connection.gains = own_gains(key.first, 1.0);
  // If the sequence of a partner search ends in a Part, the assembly has no support: it falls as one and no
  // weight is carried. assign_supports() decides which of several connections carries a weight.
  if (parameters_.algorithm == InteractionAlgorithm::partner_search && parameters_.weight_feed_forward &&
      !is_part(key.second))
    pair.connection.feed_forward_W = -(base.mass_kg * parameters_.gravity_W);
  return pair;
}

void Connections::mark_changed(const PairConnection& pair) {
  disturbed_.push_back(pair.base);
  disturbed_.push_back(pair.connection.partner);
}

void Connections::open_and_close(std::span<const int> parts, const CellMotion& motion) {
  for (const int part : parts) decided_[static_cast<std::size_t>(part)] = 1;
  next_.clear();
  auto old = list_.begin();
  auto wanted = wanted_.begin();
  while (old != list_.end() || wanted != wanted_.end()) {
    if (wanted == wanted_.end() || (old != list_.end() && old->key() < *wanted)) {
      if (decided_[static_cast<std::size_t>(old->base)] != 0)
        mark_changed(*old);
      else
        next_.push_back(*old);
      ++old;
    } else if (old == list_.end() || *wanted < old->key()) {
      next_.push_back(close(*wanted, motion));
      mark_changed(next_.back());
      if (is_part(wanted->second)) closed_on_.push_back(wanted->second);
      ++wanted;
    } else if (renewed(*old)) {
      next_.push_back(close(*wanted, motion));
      next_.back().connection.feed_forward_W = old->connection.feed_forward_W;
      mark_changed(next_.back());
      if (is_part(wanted->second)) closed_on_.push_back(wanted->second);
      ++old, ++wanted;
    } else {
      next_.push_back(*old);
      ++old, ++wanted;
    }
  }
  list_.swap(next_);
  for (const int part : parts) decided_[static_cast<std::size_t>(part)] = 0;
  for (const int part : parts) renew_[static_cast<std::size_t>(part)] = Renewal::none;
  index_list();
}

void Connections::index_list() {
  std::size_t place = 0;
  for (std::size_t c = 0; c + 1 < first_.size(); ++c) {
    while (place < list_.size() && list_[place].base < static_cast<int>(c)) ++place;
    first_[c] = place;
  }
  first_.back() = list_.size();
}

std::span<PairConnection> Connections::mutable_of(int id) {
  const auto c = static_cast<std::size_t>(id);
  return std::span<PairConnection>(list_).subspan(first_[c], first_[c + 1] - first_[c]);
}

const PairConnection* Connections::find(int base, int target) const {
  const std::span<const PairConnection> mine = of(base);
  const auto it = std::lower_bound(mine.begin(), mine.end(), target, [](const PairConnection& p, int key) {
    return p.connection.partner < key;
  });
  return it != mine.end() && it->connection.partner == target ? &*it : nullptr;
}

bool Connections::closed(const ContactGraph& graph, int a, int b) const {
  if (graph.holds[static_cast<std::size_t>(a)] == b) return find(a, b) != nullptr;
  if (graph.holds[static_cast<std::size_t>(b)] == a) return find(b, a) != nullptr;
  return (!is_part(b) || is_base(graph, a, b) ? find(a, b) : find(b, a)) != nullptr;
}

void Connections::soften_on_free_targets() {
  softened_.clear();
  for (const int target : closed_on_) {
    if (std::find(softened_.begin(), softened_.end(), target) != softened_.end()) continue;
    softened_.push_back(target);
    FreeTargetLoad load(component(target));
    for (const PairConnection& pair : list_)
      if (pair.connection.partner == target) load.add(component(pair.base), pair.connection);
    const double scale = load.scale();
    for (PairConnection& pair : list_) {
      Connection& connection = pair.connection;
      if (connection.partner != target) continue;
      // Never stiffer than it was: a stretched spring that stiffens would create energy.
      connection.softening = std::min(connection.softening, scale);
      connection.gains = own_gains(pair.base, connection.softening);
    }
  }
}

void Connections::assign_supports(const ContactGraph& graph, std::span<const int> parts) {
  tree_.grow(graph, parts, [&](int a, int b) { return closed(graph, a, b); });
  for (const int part : parts) {
    int& partner = partner_[static_cast<std::size_t>(part)];
    const int carrier = tree_.carrier(part);
    if (carrier != partner) {
      changes_.push_back({part, partner, carrier});
      disturbed_.push_back(part);
      partner = carrier;
    }
    if (!parameters_.weight_feed_forward) continue;
    const Vec3 lift_W = -(component(part).mass_kg * parameters_.gravity_W);
    const int support = tree_.support(part);
    for (PairConnection& pair : mutable_of(part)) {
      const bool carries = support != -1 && pair.connection.partner == support && support == carrier;
      const Vec3 feed_forward_W = carries ? lift_W : Vec3::Zero();
      if (pair.connection.feed_forward_W == feed_forward_W) continue;
      pair.connection.feed_forward_W = feed_forward_W;
      mark_changed(pair);
    }
    const int passes_to = support != carrier ? support : -1;
    if (passes_to_[static_cast<std::size_t>(part)] == passes_to) continue;
    passes_to_[static_cast<std::size_t>(part)] = passes_to;
    disturbed_.push_back(part);
  }
}

/// The user may attach a Part to one that is far lighter, or far away: as on a free Target, no mode shall
/// become faster than that of the Part alone.
void Connections::soften_attached(const ContactGraph& graph, std::span<const int> parts) {
  for (const int part : parts) {
    for (PairConnection& pair : mutable_of(part)) {
      Connection& connection = pair.connection;
      const int target = connection.partner;
      if (!attached_to_part(graph, part, target) || connection.softening < 1.0) continue;
      FreeTargetLoad load(component(target));
      load.add(component(part), connection);
      connection.softening = load.scale();
      connection.gains = own_gains(part, connection.softening);
    }
  }
}

void Connections::soften_on_grippers(const ContactGraph& graph, std::span<const int> parts) {
  softened_.clear();
  for (const int part : parts) {
    for (const PairConnection& pair : of(part)) {
      const int palm = pair.connection.partner;
      if (yields(palm) && std::find(softened_.begin(), softened_.end(), palm) == softened_.end())
        softened_.push_back(palm);
    }
  }
  for (const int palm : softened_) {
    FreeTargetLoad load(*yielding_[static_cast<std::size_t>(palm)]);
    bool any_attached = false;
    for (const PairConnection& pair : list_) {
      if (pair.connection.partner != palm) continue;
      load.add(component(pair.base), pair.connection);
      any_attached = any_attached || graph.holds[static_cast<std::size_t>(pair.base)] != -1;
    }
    if (!any_attached) continue;
    const double scale = load.scale();
    for (PairConnection& pair : list_) {
      Connection& connection = pair.connection;
      if (connection.partner != palm || scale >= connection.softening) continue;
      connection.softening = scale;
      connection.gains = own_gains(pair.base, scale);
      mark_changed(pair);
    }
  }
}

bool Connections::attached_to_part(const ContactGraph& graph, int part, int target) const {
  return graph.holds[static_cast<std::size_t>(part)] == target && is_part(target);
}

bool Connections::renewed(const PairConnection& pair) const {
  return renew_[static_cast<std::size_t>(pair.base)] != Renewal::none ||
         renew_[static_cast<std::size_t>(pair.connection.partner)] == Renewal::all;
}

void Connections::recompute_gains(int part, Renewal what) {
  Renewal& renewal = renew_[static_cast<std::size_t>(part)];
  renewal = std::max(renewal, what);
}

double Connections::free_scale(const ContactGraph& graph, int part) const {
  FreeTargetLoad load(component(part));
  for (const int other : graph.neighbours[static_cast<std::size_t>(part)]) {
    if (!is_part(other)) continue;
    const bool base = is_base(graph, part, other);
    const PairConnection* pair = base ? find(part, other) : find(other, part);
    if (pair == nullptr) continue;
    if (base)
      load.add_own();
    else
      load.add(component(other), pair->connection);
  }
  return load.shared_scale();
}

void Connections::soften_free_clusters(const ContactGraph& graph, std::span<const int> parts,
                                       const CellMotion& motion) {
  for (const int part : parts) {
    const bool free = tree_.support(part) == -1;
    scale_[static_cast<std::size_t>(part)] = free ? free_scale(graph, part) : 1.0;
  }
  for (const int part : parts) {
    const bool free = tree_.support(part) == -1;
    for (PairConnection& pair : mutable_of(part)) {
      Connection& connection = pair.connection;
      if (!free && (attached_to_part(graph, part, connection.partner) || yields(connection.partner)))
        continue;
      if (!free && connection.softening < 1.0) {  // caught: closes again with full constants
        const Vec3 feed_forward_W = connection.feed_forward_W;
        pair = close(pair.key(), motion);
        pair.connection.feed_forward_W = feed_forward_W;
        mark_changed(pair);
      } else if (free) {
        const double scale = std::min(scale_[static_cast<std::size_t>(part)],
                                      scale_[static_cast<std::size_t>(connection.partner)]);
        if (scale >= connection.softening) continue;
        connection.softening = scale;
        connection.gains = own_gains(part, scale);
        mark_changed(pair);
      }
    }
  }
}

void Connections::evaluate(const CellMotion& motion, std::span<const int> parts,
                           std::span<Wrench> wrenches) const {
  for (const int part : parts) {
    wrenches[static_cast<std::size_t>(part)] = {};
    for (const PairConnection& pair : of(part))
      wrenches[static_cast<std::size_t>(pair.connection.partner)] = {};
  }
  for (const int part : parts)
    for (const PairConnection& pair : of(part)) add_wrenches(pair, motion, wrenches);
  add_passed_weights(motion, parts, wrenches);
}

void Connections::evaluate(const CellMotion& motion, std::span<Wrench> wrenches) const {
  for (const PairConnection& pair : list_) {
    wrenches[static_cast<std::size_t>(pair.base)] = {};
    wrenches[static_cast<std::size_t>(pair.connection.partner)] = {};
  }
  for (const PairConnection& pair : list_) add_wrenches(pair, motion, wrenches);
  add_passed_weights(motion, parts_, wrenches);
}

void Connections::add_wrenches(const PairConnection& pair, const CellMotion& motion,
                               std::span<Wrench> wrenches) const {
  const auto part = static_cast<std::size_t>(pair.base),
             partner = static_cast<std::size_t>(pair.connection.partner);
  const BodyMotion& base = motion.bodies[part];
  const BodyMotion& target = motion.carrier(pair.connection.partner);
  const Wrench on_base = substitute_wrench(pair.connection, base, target, motion.time_s);
  wrenches[part] += on_base;
  wrenches[partner] += reaction_on_target(on_base, base, target);
  if (const ConnectionTurn& turn = pair.connection.turn; turn.driver >= 0) {
    const Vec3 torque_W = turn.torque_N_m * (base.X_WB.R * turn.axis_B);
    wrenches[partner].t += torque_W;
    wrenches[static_cast<std::size_t>(turn.driver)].t -= torque_W;
  }
}

void Connections::evaluate(const CellMotion& motion, std::span<Wrench> wrenches, KeptWrenches& kept) const {
  kept.begin(motion, version_);
  for (const int part : parts_) {
    const std::span<const PairConnection> pairs = of(part);
    for (const PairConnection& pair : pairs) {
      if (pairs.size() == 1 && kept.stands(static_cast<std::size_t>(part), pair.connection)) continue;
      kept.renew(static_cast<std::size_t>(part));
      kept.renew(static_cast<std::size_t>(pair.connection.partner));
      if (pair.connection.turn.driver >= 0) kept.renew(static_cast<std::size_t>(pair.connection.turn.driver));
    }
  }
  kept.clear_renewed();
  for (const int part : parts_) {
    const auto place = static_cast<std::size_t>(part);
    const std::span<const PairConnection> pairs = of(part);
    for (const PairConnection& pair : pairs) {
      const auto partner = static_cast<std::size_t>(pair.connection.partner);
      const ConnectionTurn& turn = pair.connection.turn;
      const bool turns = turn.driver >= 0 && kept.renews(static_cast<std::size_t>(turn.driver));
      if (!kept.renews(place) && !kept.renews(partner) && !turns) continue;
      const BodyMotion& base = motion.bodies[place];
      const BodyMotion& target = motion.carrier(pair.connection.partner);
      const Wrench on_base = pairs.size() == 1
                                 ? kept.of(place, pair.connection, motion)
                                 : substitute_wrench(pair.connection, base, target, motion.time_s);
      if (kept.renews(place)) kept.sum(place) += on_base;
      if (kept.renews(partner)) kept.sum(partner) += reaction_on_target(on_base, base, target);
      if (turn.driver < 0) continue;
      const Vec3 torque_W = turn.torque_N_m * (base.X_WB.R * turn.axis_B);
      if (kept.renews(partner)) kept.sum(partner).t += torque_W;
      if (turns) kept.sum(static_cast<std::size_t>(turn.driver)).t -= torque_W;
    }
  }
  std::copy(kept.sums().begin(), kept.sums().end(), wrenches.begin());
  add_passed_weights(motion, parts_, wrenches);
}

/// Weights passed on through other Parts.
void Connections::add_passed_weights(const CellMotion& motion, std::span<const int> parts,
                                     std::span<Wrench> wrenches) const {
  if (parameters_.algorithm == InteractionAlgorithm::partner_search) return;
  for (const int part : parts) {
    const int support = passes_to_[static_cast<std::size_t>(part)];
    if (support == -1) continue;
    const Wrench lift{-(component(part).mass_kg * parameters_.gravity_W), Vec3::Zero()};
    wrenches[static_cast<std::size_t>(part)] += lift;
    wrenches[static_cast<std::size_t>(support)] +=
        reaction_on_target(lift, motion.bodies[static_cast<std::size_t>(part)],
                           motion.bodies[static_cast<std::size_t>(support)]);
  }
}

void Connections::linearise(const CellMotion& motion, std::span<const int> parts,
                            std::vector<PairLinearisation>& pairs) const {
  for (const int part : parts)
    for (const PairConnection& pair : of(part))
      pairs.push_back(
          substitute_linearisation(part, pair.connection, motion.bodies[static_cast<std::size_t>(part)]));
}

Wrench Connections::pair_wrench(const PairConnection& pair, const CellMotion& motion) const {
  const BodyMotion& base = motion.bodies[static_cast<std::size_t>(pair.base)];
  const int target = pair.connection.partner;
  Wrench result = substitute_wrench(pair.connection, base, motion.carrier(target), motion.time_s);
  if (parameters_.algorithm == InteractionAlgorithm::partner_search) return result;
  // Loads of Parts whose sequence of carriers runs through this connection, either way.
  for (const int part : parts_) {
    if (passes_to_[static_cast<std::size_t>(part)] == -1) continue;
    double sign = 0.0;
    for (int at = part; at != -1 && is_part(at); at = partner(at)) {
      if (at == pair.base && partner(at) == target) sign = 1.0;
      if (at == target && partner(at) == pair.base) sign = -1.0;
    }
    if (sign == 0.0) continue;
    const Vec3 lift_W = -sign * (component(part).mass_kg * parameters_.gravity_W);
    const Vec3 arm = motion.bodies[static_cast<std::size_t>(part)].p_WBcm - base.p_WBcm;
    result += Wrench{lift_W, arm.cross(lift_W)};
  }
  return result;
}

}  // namespace takt
