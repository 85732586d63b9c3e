#include "server/contact/surface/contact_interaction.h"

#include <algorithm>
#include <stdexcept>

#include "plant_models/state_bytes.h"

namespace takt {

struct ContactInteraction::Pair {
  const ContactPairModel* model;
  PolygonalContact contact;
  // The last call, which is not repeated with the same input.
  RelativeMotion at;
  bool known = false;
  bool uncounted = false;  ///< evaluated for a report, not for a solver
  bool deep = false;       ///< an evaluation since passing() found it beyond `deep_m`
  double deep_m;
  ContactResult result;
  std::uint64_t made = 0, skipped = 0, apart = 0;

  Pair(const ContactPairModel& pair, const ContactModel& cell)
      : model(&pair),
        contact(cell.surfaces[static_cast<std::size_t>(pair.base)],
                cell.surfaces[static_cast<std::size_t>(pair.target)], pair.law),
        deep_m(0.25 * cell.surfaces[static_cast<std::size_t>(pair.target)]->wall_m()) {}

  void note_depth() { deep = deep || result.largest_penetration_m > deep_m; }
};

namespace {
// Wrench about the target's origin in its axes, into the world, about the same point.
Wrench to_world(const Wrench& F_T, const Mat3& R_WT) {
  return {R_WT * F_T.f, R_WT * F_T.t};
}

const BodyMotion& body(const CellMotion& motion, int component) {
  return motion.bodies[static_cast<std::size_t>(component)];
}
}  // namespace

ContactInteraction::ContactInteraction(const std::vector<Component>& components, const ContactModel& model)
    : components_(components),
      model_(model),
      acting_(model.pairs.size(), 0),
      asleep_(components.size(), 0),
      radius_m_(components.size(), 0.0),
      still_(model.pairs.size(), 0),
      is_near_(model.pairs.size(), 0) {
  pairs_.reserve(model.pairs.size());
  for (const ContactPairModel& pair : model.pairs) pairs_.emplace_back(pair, model);
  near_.reserve(pairs_.size());
  moving_.reserve(pairs_.size());
  for (std::size_t c = 0; c < std::min(components.size(), model.surfaces.size()); ++c) {
    if (model.surfaces[c] == nullptr) continue;
    const Aabb& box = model.surfaces[c]->bounds_B();
    radius_m_[c] = box.lower.cwiseAbs().cwiseMax(box.upper.cwiseAbs()).norm();
  }
}

ContactInteraction::~ContactInteraction() = default;

void ContactInteraction::set_acting(const std::vector<char>& acting) {
  acting_ = acting;
  any_acting_ = std::any_of(acting.begin(), acting.end(), [](char a) { return a != 0; });
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    if (acting_[i] != 0) continue;
    pairs_[i].contact.reset();
    pairs_[i].known = false;
  }
  wake_all();
}

void ContactInteraction::wake_all() {
  std::fill(asleep_.begin(), asleep_.end(), 0);
  std::fill(still_.begin(), still_.end(), 0);
  std::fill(is_near_.begin(), is_near_.end(), 0);
  list_near();
}

void ContactInteraction::set_asleep(const std::vector<char>& asleep) {
  asleep_ = asleep;
  const auto cannot_move = [this](int component) {
    const auto c = static_cast<std::size_t>(component);
    return asleep_[c] != 0 || components_[c].type == ComponentType::ground;
  };
  for (std::size_t i = 0; i < pairs_.size(); ++i)
    still_[i] = cannot_move(model_.pairs[i].base) && cannot_move(model_.pairs[i].target) ? 1 : 0;
  list_near();
}

void ContactInteraction::list_near() {
  near_.clear();
  moving_.clear();
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    if (is_near_[i] == 0) continue;
    near_.push_back(i);
    if (still_[i] == 0) moving_.push_back(i);
  }
}

void ContactInteraction::update_friction(std::span<const BodyHeat> heat) {
  for (Pair& pair : pairs_) {
    const std::vector<std::array<double, 2>>& table = pair.model->friction_at_K;
    if (table.empty()) continue;
    const double T = std::max(heat[static_cast<std::size_t>(pair.model->base)].temperature_K,
                              heat[static_cast<std::size_t>(pair.model->target)].temperature_K);
    std::size_t i = 1;
    while (i < table.size() && table[i][0] < T) ++i;
    double friction = T <= table.front()[0] ? table.front()[1] : table.back()[1];
    if (T > table.front()[0] && i < table.size()) {
      const auto& [from, to] = std::pair{table[i - 1], table[i]};
      friction = from[1] + (to[1] - from[1]) * (T - from[0]) / (to[0] - from[0]);
    }
    if (friction == pair.contact.law().friction) continue;
    pair.contact.set_friction(friction);
    pair.known = false;
  }
}

void ContactInteraction::reset() {
  for (Pair& pair : pairs_) {
    pair.contact.reset();
    pair.known = false;
    pair.made = pair.skipped = pair.apart = 0;
  }
  wake_all();
}

void ContactInteraction::forget(int component) {
  for (Pair& pair : pairs_) {
    if (pair.model->base != component && pair.model->target != component) continue;
    pair.contact.reset();
    pair.known = false;
  }
}

void ContactInteraction::save(StateWriter& out) const {
  out.put_size(near_.size());
  for (const std::size_t i : near_) out.put_size(i);
  for (const Pair& pair : pairs_) {
    const std::span<const ContactSpring> springs = pair.contact.springs();
    out.put_size(springs.size());
    for (const ContactSpring& spring : springs)
      out.put(static_cast<double>(spring.element)), out.put(spring.anchor_T);
    const RelativeMotion* held = pair.contact.held_from();
    out.put(held != nullptr);
    if (held != nullptr) out.put(held->X_TB), out.put(held->V_TB_T.v), out.put(held->V_TB_T.w);
  }
}

void ContactInteraction::load(StateReader& in) {
  near_.clear();
  const std::size_t near = in.size(pairs_.size(), "near pairs");
  for (std::size_t i = 0; i < near; ++i) {
    const auto pair = in.get<std::uint64_t>();
    if (pair >= pairs_.size() || acting_[static_cast<std::size_t>(pair)] == 0 ||
        (!near_.empty() && near_.back() >= pair))
      in.fail("a near pair is none that acts, or the pairs are not in order");
    near_.push_back(static_cast<std::size_t>(pair));
  }
  std::fill(is_near_.begin(), is_near_.end(), 0);
  for (const std::size_t pair : near_) is_near_[pair] = 1;
  list_near();
  std::vector<double> kept;
  for (Pair& pair : pairs_) {
    pair.contact.reset();
    pair.known = false;
    constexpr std::size_t kMaxSprings = 1U << 24U;
    kept.clear();
    const std::size_t springs = in.size(kMaxSprings, "contact springs");
    for (std::size_t i = 0; i < 4 * springs; ++i) kept.push_back(in.number("a contact spring"));
    try {
      pair.contact.restore(kept);
    } catch (const std::invalid_argument& error) {
      in.fail(error.what());
    }
    if (!in.flag("'held'")) continue;
    RelativeMotion motion;
    motion.X_TB = in.pose("a held pose");
    motion.V_TB_T.v = in.vector("a held velocity");
    motion.V_TB_T.w = in.vector("a held angular velocity");
    pair.contact.hold_from(motion);
  }
}

RelativeMotion ContactInteraction::motion_of(const ContactPairModel& pair, const CellMotion& motion) const {
  const BodyMotion& base = body(motion, pair.base);
  const BodyMotion& target = body(motion, pair.target);
  return relative_motion(base.X_WB, base.V_WB, target.X_WB, target.V_WB);
}

bool ContactInteraction::boxes_apart(const ContactPairModel& pair, const CellMotion& motion,
                                     double margin_m) const {
  return gap_m(pair, motion) > margin_m;
}

double ContactInteraction::gap_m(const ContactPairModel& pair, const CellMotion& motion) const {
  const auto world_box = [&motion](int component, const ContactSurface& surface) {
    const Aabb& box = surface.bounds_B();
    const Pose& X = body(motion, component).X_WB;
    const Vec3 center = X * (0.5 * (box.lower + box.upper));
    const Vec3 half = X.R.cwiseAbs() * (0.5 * (box.upper - box.lower));
    return Aabb{center - half, center + half};
  };
  const Aabb a = world_box(pair.base, *model_.surfaces[static_cast<std::size_t>(pair.base)]);
  const Aabb b = world_box(pair.target, *model_.surfaces[static_cast<std::size_t>(pair.target)]);
  return (a.lower - b.upper).cwiseMax(b.lower - a.upper).maxCoeff();
}

double ContactInteraction::speed_m_per_s(const ContactPairModel& pair, const CellMotion& motion) const {
  const BodyMotion& base = body(motion, pair.base);
  const BodyMotion& target = body(motion, pair.target);
  const Vec3 v = base.V_WB.v - target.V_WB.at(base.X_WB.p - target.X_WB.p);
  return v.norm() + (base.V_WB.w - target.V_WB.w).norm() * radius_m(pair.base);
}

double ContactInteraction::seeing_step_s(const CellMotion& motion, double most_s) {
  constexpr double kDeepShare = 0.2;  // of the depth up to which the law is linear
  double step_s = most_s;
  for (const std::size_t i : moving_) {
    Pair& pair = pairs_[i];
    const double speed = speed_m_per_s(*pair.model, motion);
    const double linear_m = pair.contact.law().linear_depth_m;
    if (!(speed * step_s > kDeepShare * linear_m)) continue;
    const double gap = gap_m(*pair.model, motion);
    double far_m = std::max(0.0, gap) + linear_m;
    if (gap < 0.0) {
      look_at_pair(pair, motion);
      if (pair.result.largest_penetration_m > linear_m) far_m = kDeepShare * linear_m;
    }
    step_s = std::min(step_s, far_m / speed);
  }
  return step_s;
}

ContactInteraction::Passing ContactInteraction::passing(const CellMotion& motion) {
  Passing found;
  for (const std::size_t i : moving_) {
    Pair& pair = pairs_[i];
    if (!pair.deep) continue;
    pair.deep = false;
    look_at_pair(pair, motion);
    const double wall_m = pair.contact.passed_wall_m(motion_of(*pair.model, motion));
    if (!(wall_m > 0.0) || found.base >= 0) continue;
    found = {pair.model->base, pair.model->target, wall_m, pair.result.largest_penetration_m,
             speed_m_per_s(*pair.model, motion)};
  }
  return found;
}

void ContactInteraction::update(const CellMotion& motion, double step_s) {
  constexpr double kFastest_m_per_s = 10.0, kFaster = 2.0;
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    if (acting_[i] == 0 || still_[i] != 0) continue;
    const double reach_m =
        step_s * std::max(kFastest_m_per_s, kFaster * speed_m_per_s(*pairs_[i].model, motion));
    is_near_[i] = boxes_apart(*pairs_[i].model, motion, reach_m) ? 0 : 1;
    if (is_near_[i] == 0) ++pairs_[i].apart;
  }
  list_near();
}

void ContactInteraction::accept(const CellMotion& motion) {
  for (const std::size_t i : moving_) {
    Pair& pair = pairs_[i];
    if (pair.model->law.friction_law != FrictionLaw::stick) continue;
    if (pair.contact.accept(motion_of(*pair.model, motion))) pair.known = false;
  }
}

void ContactInteraction::evaluate_pair(Pair& pair, const CellMotion& motion) const {
  const RelativeMotion now = motion_of(*pair.model, motion);
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

void ContactInteraction::set_holding(bool holding) {
  holding_ = holding;
  for (Pair& pair : pairs_) {
    pair.contact.release();
    pair.known = false;
  }
}

void ContactInteraction::hold(const CellMotion& motion, double next_s) {
  for (const std::size_t i : moving_) {
    Pair& pair = pairs_[i];
    if (!pair.contact.can_hold()) continue;
    if (pair.contact.hold(motion_of(*pair.model, motion), next_s)) pair.known = false;
  }
}

// The same result, whether calls are skipped or not, and no call.
void ContactInteraction::look_at_pair(Pair& pair, const CellMotion& motion) const {
  const RelativeMotion now = motion_of(*pair.model, motion);
  if (pair.known && same_bits(now, pair.at)) return;
  pair.contact.evaluate(now, pair.result);
  pair.at = now;
  pair.known = pair.uncounted = true;
}

void ContactInteraction::run_task(std::size_t task, void* context) {
  const Work& work = *static_cast<Work*>(context);
  work.self->evaluate_pair(work.self->pairs_[work.self->moving_[task]], *work.motion);
}

void ContactInteraction::evaluate_all(const CellMotion& motion) {
  Work work{this, &motion};
  const bool ask = model_.parallel && executor_ != nullptr && moving_.size() > 1;
  if (ask && executor_->begin(moving_.size()))
    executor_->run(moving_.size(), run_task, &work);
  else
    for (std::size_t i = 0; i < moving_.size(); ++i) run_task(i, &work);
  if (ask) executor_->end();
}

void ContactInteraction::add_wrenches(const Pair& pair, const CellMotion& motion,
                                      std::span<Wrench> wrenches) const {
  if (pair.result.elements == 0) return;
  const BodyMotion& base = body(motion, pair.model->base);
  const BodyMotion& target = body(motion, pair.model->target);
  const Wrench F = to_world(pair.result.F_B_T, target.X_WB.R);  // about the target's origin
  const auto add = [&](int component, const BodyMotion& at, double sign) {
    const Vec3 arm = target.X_WB.p - at.p_WBcm;
    wrenches[static_cast<std::size_t>(component)] += {sign * F.f, sign * (F.t + arm.cross(F.f))};
  };
  add(pair.model->base, base, 1.0);
  add(pair.model->target, target, -1.0);
}

void ContactInteraction::evaluate_moving(const CellMotion& motion, std::span<Wrench> wrenches) {
  evaluate_all(motion);
  for (const std::size_t i : moving_) add_wrenches(pairs_[i], motion, wrenches);
}

void ContactInteraction::evaluate(const CellMotion& motion, std::span<Wrench> wrenches) {
  evaluate_all(motion);
  for (const std::size_t i : near_) {
    if (still_[i] != 0) look_at_pair(pairs_[i], motion);
    add_wrenches(pairs_[i], motion, wrenches);
  }
}

void ContactInteraction::linearise(const CellMotion& motion, Linearisation linearisation,
                                   std::vector<PairLinearisation>& list) {
  for (const std::size_t i : moving_) {
    Pair& pair = pairs_[i];
    const RelativeMotion now = motion_of(*pair.model, motion);
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
    const BodyMotion& target = body(motion, pair.model->target);
    const Mat3& R = target.X_WB.R;
    PairLinearisation entry;
    entry.base = pair.model->base;
    entry.target = pair.model->target;
    entry.p_W = target.X_WB.p;
    for (int r = 0; r < 2; ++r) {
      for (int c = 0; c < 2; ++c) {
        entry.K.block<3, 3>(3 * r, 3 * c) = R * J.K.block<3, 3>(3 * r, 3 * c) * R.transpose();
        entry.D.block<3, 3>(3 * r, 3 * c) = R * J.D.block<3, 3>(3 * r, 3 * c) * R.transpose();
      }
    }
    list.push_back(entry);
  }
}

std::size_t ContactInteraction::read(const CellMotion& motion, std::span<ContactSample> samples) {
  std::size_t count = 0;
  for (const std::size_t i : near_) {
    Pair& pair = pairs_[i];
    look_at_pair(pair, motion);
    if (pair.result.elements == 0) continue;
    if (count++ >= samples.size()) continue;
    const Pose& X_WT = body(motion, pair.model->target).X_WB;
    ContactSample& sample = samples[count - 1];
    sample.base = pair.model->base;
    sample.target = pair.model->target;
    sample.result = pair.result;
    sample.p_WC = X_WT * pair.result.p_TC;
    sample.F_base_W = to_world(pair.result.F_B_T, X_WT.R);
    sample.F_base_W.t -= (sample.p_WC - X_WT.p).cross(sample.F_base_W.f);
  }
  return count;
}

void ContactInteraction::add_forces(const CellMotion& motion, std::span<Vec3> forces_W) {
  for (const std::size_t i : near_) {
    Pair& pair = pairs_[i];
    look_at_pair(pair, motion);
    if (pair.result.elements == 0) continue;
    const Vec3 f_W = body(motion, pair.model->target).X_WB.R * pair.result.F_B_T.f;
    forces_W[static_cast<std::size_t>(pair.model->base)] += f_W;
    forces_W[static_cast<std::size_t>(pair.model->target)] -= f_W;
  }
}

int ContactInteraction::heaviest_on(int component, const CellMotion& motion) {
  int heaviest = -1;
  double most_N = 0.0;
  for (const std::size_t i : near_) {
    Pair& pair = pairs_[i];
    if (pair.model->base != component && pair.model->target != component) continue;
    look_at_pair(pair, motion);
    if (pair.result.elements == 0 || pair.result.F_B_T.f.norm() <= most_N) continue;
    most_N = pair.result.F_B_T.f.norm();
    heaviest = pair.model->base == component ? pair.model->target : pair.model->base;
  }
  return heaviest;
}

void ContactInteraction::read(const CellMotion& motion, std::vector<ContactSample>& samples) {
  samples.resize(near_.size());
  samples.resize(read(motion, std::span<ContactSample>(samples)));
}

std::vector<ElementPressure> ContactInteraction::pressures(std::size_t pair, const CellMotion& motion) {
  return pairs_[pair].contact.pressures(motion_of(*pairs_[pair].model, motion));
}

void ContactInteraction::list_pushed(const CellMotion& motion, int component, const Vec3& direction_W,
                                     std::vector<int>& others) {
  constexpr double kLeastShare = 0.5;
  others.clear();
  for (const std::size_t i : near_) {
    Pair& pair = pairs_[i];
    if (pair.model->base != component && pair.model->target != component) continue;
    evaluate_pair(pair, motion);
    if (pair.result.elements == 0) continue;
    const bool is_base = pair.model->base == component;
    const Vec3 on_base_W = body(motion, pair.model->target).X_WB.R * pair.result.F_B_T.f;
    const Vec3 on_other_W = is_base ? Vec3(-on_base_W) : on_base_W;
    if (on_other_W.dot(direction_W) <= kLeastShare * on_other_W.norm()) continue;
    others.push_back(is_base ? pair.model->target : pair.model->base);
  }
  std::sort(others.begin(), others.end());
}

ContactCallCounts ContactInteraction::counts() const {
  ContactCallCounts counts;
  for (const Pair& pair : pairs_) {
    counts.made += pair.made;
    counts.skipped += pair.skipped;
    counts.boxes_apart += pair.apart;
    counts.rebuilds += pair.contact.counts().rebuilds;
    counts.elements += pair.contact.counts().elements;
  }
  return counts;
}

}  // namespace takt
