#include "server/contact/surface/contact_interaction.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "plant_models/state_bytes.h"

namespace takt {

ContactInteraction::ContactInteraction(const std::vector<Component>& components, const ContactModel& model)
    : components_(components),
      model_(model),
      acting_(model.pairs.size(), 0),
      degree_(components.size(), 0),
      asleep_(components.size(), 0),
      counted_(components.size(), 0),
      listed_(components.size(), 0),
      boxes_(components.size()),
      approach_(components.size(), model),
      pool_(model, components.size()) {
  constexpr std::size_t kRoom = 256, kRoomPerComponent = 32;
  const std::size_t room = std::min(model.pairs.size(), kRoom + kRoomPerComponent * components.size());
  for (auto* list : {&near_, &found_, &next_}) list->reserve(room);
  for (auto* list : {&moving_, &present_}) list->reserve(room);
  mobile_.reserve(components.size()), ends_.reserve(components.size());
}

ContactInteraction::~ContactInteraction() = default;

bool ContactInteraction::acting(int a, int b) const {
  const std::size_t pair = model_.pairs.table().find_either(a, b);
  return pair != PairTable::kNone && acting_[pair] != 0;
}

void ContactInteraction::set_acting(const PairPredicate& acts) {
  const PairTable& pairs = model_.pairs.table();
  acting_count_ = 0;
  std::fill(degree_.begin(), degree_.end(), 0);
  for (int base = 0; base < pairs.base_count(); ++base) {
    for (std::size_t i = pairs.begin_of(base); i < pairs.end_of(base); ++i) {
      const bool act = acts(base, pairs.target(i));
      acting_[i] = act ? 1 : 0;
      if (!act) continue;
      ++acting_count_;
      ++degree_[static_cast<std::size_t>(base)];
      ++degree_[static_cast<std::size_t>(pairs.target(i))];
    }
  }
  pool_.for_each([this](PairContact& pair) {
    if (acting_[pair.number] == 0) pair.forget();
  });
  wake_all();
}

void ContactInteraction::wake_all() {
  clear_near();
  std::fill(asleep_.begin(), asleep_.end(), 0);
  set_asleep(asleep_);
}

void ContactInteraction::clear_near() {
  for (const Near& pair : near_)
    if (pair.contact != nullptr) pool_.give_back(*pair.contact);
  near_.clear();
  list_contacts();
}

void ContactInteraction::set_asleep(const std::vector<char>& asleep) {
  asleep_ = asleep;
  all_moved_ = unsettled_ = true;
  movable_known_ = false;
  mobile_.clear();
  for (std::size_t c = 0; c < components_.size(); ++c)
    if (!immobile(static_cast<int>(c))) mobile_.push_back(static_cast<int>(c));
  for (Near& pair : near_) {
    pair.still = immobile(pair.base) && immobile(pair.target);
    if (pair.contact != nullptr) pair.contact->still = pair.still, pair.contact->frozen = false;
  }
  take_contacts();
}

void ContactInteraction::take_contacts() {
  for (Near& pair : near_)
    if (!pair.still && pair.contact == nullptr)
      pair.contact = &pool_.take(pair.number, pair.base, pair.target);
  list_contacts();
}

void ContactInteraction::list_contacts() {
  moving_.clear();
  present_.clear();
  for (const Near& pair : near_) {
    if (pair.contact == nullptr) continue;
    present_.push_back(pair.contact);
    if (!pair.still) moving_.push_back(pair.contact);
  }
  for (const int end : ends_) listed_[static_cast<std::size_t>(end)] = 0;
  ends_.clear();
  for (const PairContact* pair : moving_) {
    for (const int end : {pair->base, pair->target}) {
      char& listed = listed_[static_cast<std::size_t>(end)];
      if (listed == 0) ends_.push_back(end);
      listed = 1;
    }
  }
}

void ContactInteraction::find_boxes(const CellMotion& motion) {
  for (const int end : attends_ ? attended_ends_ : std::span<const int>(ends_)) {
    const auto c = static_cast<std::size_t>(end);
    boxes_[c] = ApproachSearch::world_box(*model_.surfaces[c], motion.bodies[c].X_WB);
  }
}

/// True only if the contact would find no element either: with room for rounding, and not where it holds a patch, whose
/// planes reach beyond the box.
bool ContactInteraction::boxes_apart(const PairContact& pair) const {
  constexpr double kRounding_m = 1e-9;
  const Aabb& base = boxes_[static_cast<std::size_t>(pair.base)];
  const Aabb& target = boxes_[static_cast<std::size_t>(pair.target)];
  return ApproachSearch::gap_m(base, target) > kRounding_m && !pair.contact.can_hold();
}

/// Pairs that have come to lie still keep their contact only where they press, and it is not evaluated again.
void ContactInteraction::settle(const CellMotion& motion) {
  unsettled_ = false;
  bool changed = false;
  for (Near& pair : near_) {
    if (!pair.still || pair.contact == nullptr) continue;
    look_at_pair(*pair.contact, motion);
    pair.contact->frozen = true;
    if (pair.contact->result.elements > 0 || !pair.contact->contact.springs().empty()) continue;
    pool_.give_back(*pair.contact);
    pair.contact = nullptr;
    changed = true;
  }
  if (changed) list_contacts();
}

void ContactInteraction::update_friction(std::span<const BodyHeat> heat) {
  pool_.update_friction(heat);
}

void ContactInteraction::reset() {
  pool_.for_each([](PairContact& pair) { pair.forget(); });
  boxes_apart_ = 0;
  wake_all();
  pool_.reset_counts();
}

void ContactInteraction::forget(int component) {
  all_moved_ = true;
  pool_.for_each([component](PairContact& pair) {
    if (pair.base == component || pair.target == component) pair.forget();
  });
}

void ContactInteraction::save(StateWriter& out) const {
  out.put_size(near_.size());
  for (const Near& pair : near_) out.put_size(pair.number);
  std::vector<const PairContact*> stateful;
  pool_.for_each([&stateful](const PairContact& pair) {
    if (!pair.contact.springs().empty() || pair.contact.held_from() != nullptr) stateful.push_back(&pair);
  });
  std::sort(stateful.begin(), stateful.end(),
            [](const PairContact* a, const PairContact* b) { return a->number < b->number; });
  out.put_size(stateful.size());
  for (const PairContact* pair : stateful) {
    out.put_size(pair->number);
    const std::span<const ContactSpring> springs = pair->contact.springs();
    out.put_size(springs.size());
    for (const ContactSpring& spring : springs)
      out.put(static_cast<double>(spring.element)), out.put(spring.anchor_T);
    const HeldFrom* held = pair->contact.held_from();
    out.put(held != nullptr);
    if (held == nullptr) continue;
    out.put(held->motion.X_TB), out.put(held->motion.V_TB_T.v), out.put(held->motion.V_TB_T.w);
    out.put(held->most_s);
  }
}

void ContactInteraction::load(StateReader& in) {
  const PairTable& pairs = model_.pairs.table();
  const auto next_pair = [&](std::size_t& last, bool first, const char* what) {
    const auto pair = in.get<std::uint64_t>();
    if (pair >= pairs.size() || acting_[static_cast<std::size_t>(pair)] == 0 || (!first && last >= pair))
      in.fail(std::string(what) + " does not act, or the pairs are not in ascending order");
    last = static_cast<std::size_t>(pair);
  };
  pool_.for_each([](PairContact& pair) { pair.forget(); });
  clear_near();
  const std::size_t near = in.size(pairs.size(), "near pairs");
  std::size_t number = 0;
  for (std::size_t i = 0; i < near; ++i) {
    next_pair(number, i == 0, "a near pair");
    near_.push_back({number, pairs.base(number), pairs.target(number), false, nullptr});
  }
  take_contacts();
  std::vector<double> kept;
  const std::size_t stateful = in.size(pairs.size(), "pairs with a state");
  for (std::size_t p = 0; p < stateful; ++p) {
    next_pair(number, p == 0, "a pair with a state");
    constexpr std::size_t kMaxSprings = 1U << 24U;
    kept.clear();
    const std::size_t springs = in.size(kMaxSprings, "contact springs");
    for (std::size_t i = 0; i < 4 * springs; ++i) kept.push_back(in.number("a contact spring"));
    const auto here = std::lower_bound(near_.begin(), near_.end(), number,
                                       [](const Near& a, std::size_t key) { return a.number < key; });
    const bool is_near = here != near_.end() && here->number == number;
    PairContact& pair =
        is_near ? *here->contact : pool_.take(number, pairs.base(number), pairs.target(number));
    try {
      pair.contact.restore(kept);
    } catch (const std::invalid_argument& error) {
      in.fail(error.what());
    }
    if (in.flag("'held'")) {
      RelativeMotion motion;
      motion.X_TB = in.pose("a held pose");
      motion.V_TB_T.v = in.vector("a held velocity");
      motion.V_TB_T.w = in.vector("a held angular velocity");
      pair.contact.hold_from({motion, in.number("the time for which a patch is held")});
    }
    if (!is_near) pool_.give_back(pair);
  }
}

RelativeMotion ContactInteraction::motion_of(int base_id, int target_id, const CellMotion& motion) const {
  const BodyMotion& base = body(motion, base_id);
  const BodyMotion& target = body(motion, target_id);
  RelativeMotion relative = relative_motion(base.X_WB, base.V_WB, target.X_WB, target.V_WB);
  if (motion.has_surface(target_id))
    relative.move_surface(motion.surfaces[static_cast<std::size_t>(target_id)]);
  return relative;
}

double ContactInteraction::gap_m(const PairContact& pair, const CellMotion& motion) const {
  const auto world_box = [&](int component) {
    return ApproachSearch::world_box(*model_.surfaces[static_cast<std::size_t>(component)],
                                     body(motion, component).X_WB);
  };
  return ApproachSearch::gap_m(world_box(pair.base), world_box(pair.target));
}

double ContactInteraction::speed_m_per_s(int base_id, int target_id, const CellMotion& motion) const {
  const BodyMotion& base = body(motion, base_id);
  const BodyMotion& target = body(motion, target_id);
  const Vec3 v = base.V_WB.v - target.V_WB.at(base.X_WB.p - target.X_WB.p);
  return v.norm() + (base.V_WB.w - target.V_WB.w).norm() * radius_m(base_id);
}

double ContactInteraction::seeing_step_s(const CellMotion& motion, double most_s) {
  constexpr double kMostDeep = 1.75, kDeepShare = 0.2;  // of the depth up to which the law is linear
  double step_s = most_s;
  for (PairContact* const moving : moving_) {
    PairContact& pair = *moving;
    const double speed = speed_m_per_s(pair.base, pair.target, motion);
    const double linear_m = pair.contact.law().linear_depth_m;
    if (!(speed * step_s > kDeepShare * linear_m)) continue;
    double far_m = gap_m(pair, motion) + kMostDeep * linear_m;
    if (far_m < kMostDeep * linear_m) {
      look_at_pair(pair, motion);
      const double deep_m = pair.result.largest_penetration_m;
      far_m = deep_m > linear_m ? kDeepShare * linear_m : kMostDeep * linear_m - deep_m;
    }
    step_s = std::min(step_s, far_m / speed);
  }
  return step_s;
}

ContactInteraction::Passing ContactInteraction::passing(const CellMotion& motion) {
  Passing found;
  for (PairContact* const moving : moving_) {
    PairContact& pair = *moving;
    if (!pair.deep) continue;
    pair.deep = false;
    look_at_pair(pair, motion);
    const double wall_m = pair.contact.passed_wall_m(motion_of(pair.base, pair.target, motion));
    if (!(wall_m > 0.0) || found.base >= 0) continue;
    found = {pair.base, pair.target, wall_m, pair.result.largest_penetration_m,
             speed_m_per_s(pair.base, pair.target, motion)};
  }
  return found;
}

void ContactInteraction::update(const CellMotion& motion, double step_s) {
  ++updates_;
  if (!any_acting()) return;
  if (unsettled_) settle(motion);
  if (all_moved_)
    approach_.follow(motion);
  else
    approach_.follow(motion, mobile_);
  all_moved_ = false;
  find_near(motion, step_s);
  replace_moving();
  count_apart();
}

void ContactInteraction::find_near(const CellMotion& motion, double step_s) {
  const PairTable& pairs = model_.pairs.table();
  found_.clear();
  for (const int component : mobile_) {
    if (!acts_on(component)) continue;
    for (const int other : approach_.find(component, motion, step_s)) {
      // A pair of two that can move is found from either side.
      if (other == component || (other < component && !immobile(other))) continue;
      const std::size_t number = pairs.find_either(component, other);
      if (number == PairTable::kNone || acting_[number] == 0) continue;
      const int target = pairs.target(number), base = target == other ? component : other;
      const double reach_m = ApproachSearch::reach_m(step_s, speed_m_per_s(base, target, motion));
      if (ApproachSearch::gap_m(approach_.box(base), approach_.box(target)) > reach_m) continue;
      found_.push_back({number, base, target, false, nullptr});
    }
  }
  std::sort(found_.begin(), found_.end(), [](const Near& a, const Near& b) { return a.number < b.number; });
}

/// Replaces the near pairs that can move by those found.
void ContactInteraction::replace_moving() {
  if (std::equal(found_.begin(), found_.end(), moving_.begin(), moving_.end(),
                 [](const Near& a, const PairContact* b) { return a.number == b->number; }))
    return;
  next_.clear();
  auto found = found_.begin();
  for (const Near& pair : near_) {
    while (found != found_.end() && found->number < pair.number) next_.push_back(*found++);
    const bool stays = found != found_.end() && found->number == pair.number;
    if (stays) ++found;
    if (stays || pair.still)
      next_.push_back(pair);
    else
      pool_.give_back(*pair.contact);
  }
  next_.insert(next_.end(), found, found_.end());
  near_.swap(next_);
  take_contacts();
}

void ContactInteraction::count_apart() {
  if (!movable_known_) {
    // By the smaller of the two: those that can move, and those that cannot.
    const bool few = 2 * mobile_.size() <= components_.size();
    movable_count_ = few ? 0 : acting_count_;
    for (std::size_t c = 0; c < components_.size(); ++c) {
      const bool moves = !immobile(static_cast<int>(c));
      counted_[c] = moves == few ? 1 : 0;
      if (few && moves) movable_count_ += degree_[c];
    }
    movable_count_ -= pairs_among_counted();
    movable_known_ = true;
  }
  boxes_apart_ += movable_count_ - moving_.size();
}

/// Acting pairs of two of these components.
std::size_t ContactInteraction::pairs_among_counted() const {
  const PairTable& pairs = model_.pairs.table();
  std::size_t count = 0;
  for (int base = 0; base < pairs.base_count(); ++base) {
    if (counted_[static_cast<std::size_t>(base)] == 0) continue;
    for (std::size_t i = pairs.begin_of(base); i < pairs.end_of(base); ++i)
      count += acting_[i] != 0 && counted_[static_cast<std::size_t>(pairs.target(i))] != 0 ? 1 : 0;
  }
  return count;
}

void ContactInteraction::note_peaks(const CellMotion& motion) {
  if (!watches_peaks_) return;
  for (PairContact* const pair : visited())
    pair->note_peak(updates_, motion.time_s, body(motion, pair->target).X_WB);
}

void ContactInteraction::accept(const CellMotion& motion) {
  for (PairContact* const moving : moving_) {
    PairContact& pair = *moving;
    if (pair.kind->law.friction_law != FrictionLaw::stick) continue;
    if (pair.contact.accept(motion_of(pair.base, pair.target, motion))) pair.known = false;
  }
}

void ContactInteraction::evaluate_near(PairContact& pair, const CellMotion& motion) const {
  if (!boxes_apart(pair)) return evaluate_pair(pair, motion);
  ++pair.apart;
  pair.result = ContactResult{};
  pair.known = false;
}

void ContactInteraction::evaluate_pair(PairContact& pair, const CellMotion& motion) const {
  const RelativeMotion now = motion_of(pair.base, pair.target, motion);
  if (pair.known && same_bits(now, pair.at)) {
    if (pair.uncounted) {
      pair.uncounted = false;
      ++pair.made;
      return;
    }
    if (model_.cache_unmoved_pairs) {
      ++pair.skipped;
      return;
    }
  }
  ++pair.made;
  pair.contact.evaluate(now, pair.result);
  pair.note_depth();
  pair.at = now;
  pair.known = true;
  pair.uncounted = false;
}

void ContactInteraction::release() {
  pool_.for_each([](PairContact& pair) {
    pair.contact.release();
    pair.known = pair.frozen = false;
  });
}

void ContactInteraction::hold(const CellMotion& motion, double next_s) {
  for (PairContact* const pair : visited()) {
    if (!pair->contact.can_hold()) continue;
    if (pair->contact.hold(motion_of(pair->base, pair->target, motion), next_s)) pair->known = false;
  }
}

// The same result, whether calls are skipped or not, and no call.
void ContactInteraction::look_at_pair(PairContact& pair, const CellMotion& motion) const {
  if (pair.frozen) return;
  const RelativeMotion now = motion_of(pair.base, pair.target, motion);
  if (pair.known && same_bits(now, pair.at)) return;
  pair.contact.evaluate(now, pair.result);
  pair.at = now;
  pair.known = pair.uncounted = true;
}

void ContactInteraction::run_task(std::size_t task, void* context) {
  const Work& work = *static_cast<Work*>(context);
  work.self->evaluate_near(*work.self->visited()[task], *work.motion);
}

void ContactInteraction::evaluate_all(const CellMotion& motion) {
  find_boxes(motion);
  Work work{this, &motion};
  const std::size_t count = visited().size();
  const bool ask = model_.parallel && executor_ != nullptr && count > 1;
  if (ask && executor_->begin(count))
    executor_->run(count, run_task, &work);
  else
    for (std::size_t i = 0; i < count; ++i) run_task(i, &work);
  if (ask) executor_->end();
}

void ContactInteraction::add_wrenches(const PairContact& pair, const CellMotion& motion,
                                      std::span<Wrench> wrenches) const {
  if (pair.result.elements == 0) return;
  const BodyMotion& base = body(motion, pair.base);
  const BodyMotion& target = body(motion, pair.target);
  const Wrench F = to_world(pair.result.F_B_T, target.X_WB.R);  // about the target's origin
  const auto add = [&](int component, const BodyMotion& at, double sign) {
    const Vec3 arm = target.X_WB.p - at.p_WBcm;
    wrenches[static_cast<std::size_t>(component)] += {sign * F.f, sign * (F.t + arm.cross(F.f))};
  };
  add(pair.base, base, 1.0);
  add(pair.target, target, -1.0);
}

void ContactInteraction::evaluate_moving(const CellMotion& motion, std::span<Wrench> wrenches) {
  evaluate_all(motion);
  for (const PairContact* pair : visited()) add_wrenches(*pair, motion, wrenches);
}

void ContactInteraction::evaluate(const CellMotion& motion, std::span<Wrench> wrenches) {
  evaluate_all(motion);
  for (PairContact* const pair : present_) {
    if (pair->still) look_at_pair(*pair, motion);
    add_wrenches(*pair, motion, wrenches);
  }
}

void ContactInteraction::linearise(const CellMotion& motion, Linearisation linearisation,
                                   std::vector<PairLinearisation>& pairs) {
  find_boxes(motion);
  for (PairContact* const moving : visited()) {
    PairContact& pair = *moving;
    if (boxes_apart(pair)) continue;
    const RelativeMotion now = motion_of(pair.base, pair.target, motion);
    // A pair without pressure at this motion has no stiffness.
    if (pair.known && pair.result.elements == 0 && same_bits(now, pair.at)) continue;
    ContactJacobian J;
    ++pair.made;
    pair.contact.evaluate(now, linearisation, pair.result, J);
    pair.note_depth();
    pair.at = now;
    pair.known = true;
    pair.uncounted = false;
    if (pair.result.elements == 0) continue;
    const BodyMotion& target = body(motion, pair.target);
    const Mat3& R = target.X_WB.R;
    PairLinearisation entry{pair.base, pair.target, target.X_WB.p};
    if (linearisation == Linearisation::tangent) {
      entry.p_W = body(motion, pair.base).p_WBcm;
      const Vec3 p_TP_T = R.transpose() * (entry.p_W - target.X_WB.p);
      move_point(p_TP_T, J.K);
      move_point(p_TP_T, J.D);
      entry.f_W = R * pair.result.F_B_T.f;
    }
    entry.K = turned(R, J.K);
    entry.D = turned(R, J.D);
    pairs.push_back(entry);
  }
}

ContactCallCounts ContactInteraction::counts() const {
  ContactCallCounts counts = pool_.counts();
  counts.boxes_apart += boxes_apart_;
  return counts;
}

}  // namespace takt
