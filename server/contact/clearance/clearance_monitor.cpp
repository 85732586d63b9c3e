#include "server/contact/clearance/clearance_monitor.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "plant_models/state_bytes.h"

namespace takt {

namespace {
constexpr double kNever = std::numeric_limits<double>::infinity();
// A bound of the distance that exceeds the limit by more than this is used as it is: it lasts for many steps.
constexpr double kFar_m = 0.03;
// A pair with more permitted motion than this shares it again between its bodies, without a new distance.
constexpr double kWorthSharing_m = 0.0005;
// Upper bound of the rounding of summed paths and of distances, with a wide margin.
constexpr double kGuard_m = 1e-7;

// No point p of a body goes further than this from one pose to another: it goes by (R1 - R0) p + (p1 - p0).
// The first is at most the largest singular value of R1 - R0 times the length of p; for the difference of two
// rotations two of the three singular values are equal and the third is zero, so it is the Frobenius norm
// over the square root of two.
double displacement(const Pose& from, const Pose& to, double reach_m) {
  return std::sqrt((to.p - from.p).squaredNorm()) + reach_m * std::sqrt(0.5 * (to.R - from.R).squaredNorm());
}
}  // namespace

ClearanceMonitor::ClearanceMonitor(const ClearanceModel& model, std::vector<std::optional<Pose>> base_poses,
                                   std::size_t component_count, bool ask_always)
    : model_(model),
      base_poses_(std::move(base_poses)),
      ask_always_(ask_always),
      bodies_(model.bodies.size()),
      pairs_(model.pairs.size()),
      by_contact_(model.pairs.size(), 0),
      body_of_component_(component_count, -1),
      robot_of_component_(component_count, -1),
      partner_(component_count, -1) {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const CheckedBody& body = model.bodies[i];
    bodies_[i].bounds = bounds_of(body.shapes);
    if (body.component >= 0) {
      body_of_component_[static_cast<std::size_t>(body.component)] = static_cast<int>(i);
      robot_of_component_[static_cast<std::size_t>(body.component)] = body.robot;
    } else if (body.joint >= 0 || rides(body)) {
      links_.push_back(static_cast<int>(i));
    }
  }
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    bodies_[static_cast<std::size_t>(model.pairs[i].a)].pairs.push_back(static_cast<int>(i));
    bodies_[static_cast<std::size_t>(model.pairs[i].b)].pairs.push_back(static_cast<int>(i));
  }
  woken_.reserve(bodies_.size());
  events_.reserve(2 * pairs_.size());
  reset();
}

void ClearanceMonitor::reset() {
  for (Body& body : bodies_) {
    body.X = Pose{};
    body.path_m = body.wake_m = 0.0;
  }
  std::fill(pairs_.begin(), pairs_.end(), Pair{});
  std::fill(partner_.begin(), partner_.end(), -1);
  events_.clear();
  counts_ = {};
  updates_ = 0;
  open_pairs_ = 0;
}

void ClearanceMonitor::save(StateWriter& out) const {
  for (const int partner : partner_) out.put(partner);
  out.put_size(open_pairs_);
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const Pair& pair = pairs_[i];
    if (!pair.open) continue;
    out.put_size(i);
    out.put(pair.overlapping), out.put(pair.least_m), out.put(pair.since_s), out.put(pair.least_p_W);
  }
}

void ClearanceMonitor::load(StateReader& in) {
  reset();
  for (int& partner : partner_) partner = in.index(partner_.size(), "a partner");
  open_pairs_ = in.size(pairs_.size(), "pairs that are too close");
  for (std::size_t i = 0; i < open_pairs_; ++i) {
    const auto index = in.get<std::uint64_t>();
    if (index >= pairs_.size() || pairs_[static_cast<std::size_t>(index)].open)
      in.fail("a pair that is too close is not checked, or is there twice");
    Pair& pair = pairs_[static_cast<std::size_t>(index)];
    pair.open = true;
    pair.overlapping = in.flag("'overlapping'");
    pair.least_m = in.number("a least distance");
    pair.since_s = in.number("a time");
    pair.least_p_W = in.vector("a place");
  }
}

void ClearanceMonitor::set_by_contact(const PairPredicate& acts) {
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const CheckedBody& a = model_.bodies[static_cast<std::size_t>(model_.pairs[i].a)];
    const CheckedBody& b = model_.bodies[static_cast<std::size_t>(model_.pairs[i].b)];
    const bool may_press = (a.is_part || b.is_part) && a.component >= 0 && b.component >= 0;
    by_contact_[i] = may_press && acts(a.component, b.component) ? 1 : 0;
  }
  changed_ = true;
}

void ClearanceMonitor::update(double time_s, std::uint64_t step, const CellMotion& motion,
                              std::span<const int> moved, std::span<const PartnerChange> changes) {
  const Instant now{time_s, step};
  const bool first = updates_++ == 0;
  events_.clear();
  woken_.clear();
  for (const int i : links_) {
    const CheckedBody& link = model_.bodies[static_cast<std::size_t>(i)];
    const ArmMotion& arm = motion.arms[static_cast<std::size_t>(link.robot)];
    const Pose X_RL = link.joint < 0 ? Pose{} : arm.poses.link[static_cast<std::size_t>(link.joint)];
    advance(i, rides(link) ? arm.base.X_WR * X_RL : X_RL);
  }
  for (const int component : moved) {
    const int i = body_of_component_[static_cast<std::size_t>(component)];
    if (i >= 0) advance(i, motion.bodies[static_cast<std::size_t>(component)].X_WB);
  }
  for (const PartnerChange& change : changes) {
    partner_[static_cast<std::size_t>(change.part)] = change.to;
  }
  if (first) {  // Grounds and Parts at rest may not be among `moved` after a reset
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      const int component = model_.bodies[i].component;
      if (component >= 0) bodies_[i].X = motion.bodies[static_cast<std::size_t>(component)].X_WB;
    }
  }
  if (first || changed_ || ask_always_) {
    changed_ = false;
    for (std::size_t i = 0; i < pairs_.size(); ++i) look(static_cast<int>(i), now, true);
    for (Body& body : bodies_) body.wake_m = body.path_m;  // each finds its own when it moves
  } else {
    for (const PartnerChange& change : changes) {
      const int i = body_of_component_[static_cast<std::size_t>(change.part)];
      if (i < 0) continue;
      // For pairs with surface contact the holder does not matter.
      for (const int pair : bodies_[static_cast<std::size_t>(i)].pairs)
        look(pair, now, by_contact_[static_cast<std::size_t>(pair)] == 0);
    }
    for (const int i : woken_) wake(i, now);
  }
  const auto by_pair = [](const CollisionEvent& x, const CollisionEvent& y) {
    return x.a != y.a ? x.a < y.a : x.b < y.b;
  };
  std::sort(events_.begin(), events_.end(), by_pair);
}

void ClearanceMonitor::advance(int index, const Pose& X) {
  Body& body = bodies_[static_cast<std::size_t>(index)];
  const double distance = displacement(body.X, X, body.bounds.reach_m);
  if (distance == 0.0) return;
  body.path_m += distance;
  body.X = X;
  if (body.path_m >= body.wake_m) woken_.push_back(index);
}

void ClearanceMonitor::wake(int index, const Instant& now) {
  Body& body = bodies_[static_cast<std::size_t>(index)];
  double next = kNever;
  for (const int i : body.pairs) {
    Pair& pair = pairs_[static_cast<std::size_t>(i)];
    const double& own = model_.pairs[static_cast<std::size_t>(i)].a == index ? pair.wake_a_m : pair.wake_b_m;
    if (body.path_m >= own) look(i, now, false);
    next = std::min(next, own);
  }
  body.wake_m = next;
}

bool ClearanceMonitor::held_by_own_gripper(const CheckedPair& pair) const {
  const CheckedBody& a = model_.bodies[static_cast<std::size_t>(pair.a)];
  const CheckedBody& b = model_.bodies[static_cast<std::size_t>(pair.b)];
  const auto holds = [this](const CheckedBody& part, const CheckedBody& other) {
    if (!part.is_part || other.robot < 0) return false;
    const int partner = partner_[static_cast<std::size_t>(part.component)];
    return partner >= 0 && robot_of_component_[static_cast<std::size_t>(partner)] == other.robot;
  };
  return holds(a, b) || holds(b, a);
}

bool ClearanceMonitor::held_together(const CheckedPair& pair) const {
  const int a = model_.bodies[static_cast<std::size_t>(pair.a)].component;
  const int b = model_.bodies[static_cast<std::size_t>(pair.b)].component;
  const int holds_a = partner_[static_cast<std::size_t>(a)], holds_b = partner_[static_cast<std::size_t>(b)];
  return holds_a == b || holds_b == a || (holds_a >= 0 && holds_a == holds_b);
}

double ClearanceMonitor::touching_m(std::size_t index) const {
  const CheckedPair& pair = model_.pairs[index];
  return by_contact_[index] != 0 ? pair.touching_by_contact_m : pair.touching_m;
}

BodyDistance ClearanceMonitor::measure(std::size_t index) const {
  const CheckedPair& checked = model_.pairs[index];
  const CheckedBody& a = model_.bodies[static_cast<std::size_t>(checked.a)];
  const CheckedBody& b = model_.bodies[static_cast<std::size_t>(checked.b)];
  const Pose X_WA = pose_in_world(checked.a), X_WB = pose_in_world(checked.b);
  BodyDistance found = body_distance(a.shapes, bodies_[static_cast<std::size_t>(checked.a)].bounds, X_WA,
                                     b.shapes, bodies_[static_cast<std::size_t>(checked.b)].bounds, X_WB,
                                     checked.limit_m + std::max(kFar_m, 2.0 * model_.hysteresis_m));
  if (!checked.by_solids || !(found.distance_m < 0.0)) return found;
  const double touching = touching_m(index);
  const SolidOverlap overlap = solid_overlap(*a.solid, X_WA, *b.solid, X_WB, touching);
  found.distance_m = -overlap.depth_m;
  if (overlap.depth_m > 0.0) found.p_W = overlap.p_W;
  // At most this deep at present, so that as much may be added until the next evaluation.
  found.at_least_m = checked.limit_m + 0.5 * touching;
  return found;
}

Pose ClearanceMonitor::pose_in_world(int index) const {
  const CheckedBody& body = model_.bodies[static_cast<std::size_t>(index)];
  const Pose& X = bodies_[static_cast<std::size_t>(index)].X;
  return body.component >= 0 || rides(body) ? X : *base_poses_[static_cast<std::size_t>(body.robot)] * X;
}

void ClearanceMonitor::look(int index, const Instant& now, bool ask) {
  Pair& pair = pairs_[static_cast<std::size_t>(index)];
  if (pair.looked_at == updates_) return;
  const CheckedPair& checked = model_.pairs[static_cast<std::size_t>(index)];
  const Body& a = bodies_[static_cast<std::size_t>(checked.a)];
  const Body& b = bodies_[static_cast<std::size_t>(checked.b)];
  const double left = pair.spare_m - (a.path_m - pair.path_a_m) - (b.path_m - pair.path_b_m);
  // Of Parts that touch as much as the overlap that counts is left.
  const double worth_sharing_m =
      checked.by_solids ? std::min(kWorthSharing_m, 0.1 * touching_m(static_cast<std::size_t>(index)))
                        : kWorthSharing_m;
  if (!ask && left > worth_sharing_m) {
    wait(index);
    return;
  }
  pair.looked_at = updates_;
  pair.path_a_m = a.path_m, pair.path_b_m = b.path_m;
  const bool by_contact = by_contact_[static_cast<std::size_t>(index)] != 0;
  if (checked.by_solids ? !by_contact && held_together(checked)
                        : by_contact || held_by_own_gripper(checked)) {
    if (pair.open) close(index, now);
    pair.spare_m = pair.wake_a_m = pair.wake_b_m = kNever;
    return;
  }
  const Pose X_WA = pose_in_world(checked.a), X_WB = pose_in_world(checked.b);
  // The shorter one as seen from the longer one: the bound grows with the reach.
  const bool a_is_shorter = a.bounds.reach_m < b.bounds.reach_m;
  const Pose X_LS = a_is_shorter ? X_WB.inverse() * X_WA : X_WA.inverse() * X_WB;
  if (!ask) {
    pair.spare_m =
        pair.asked_spare_m - displacement(pair.X_LS, X_LS, std::min(a.bounds.reach_m, b.bounds.reach_m));
    if (pair.spare_m > worth_sharing_m) {
      wait(index);
      return;
    }
  }
  ++counts_.pairs_asked;
  const BodyDistance found = measure(static_cast<std::size_t>(index));
  counts_.distances += found.queries;
  judge(index, found, now);
  // While a pair is close, every motion is evaluated: the event reports the smallest distance.
  pair.spare_m = pair.open ? 0.0 : std::max(0.0, found.at_least_m - checked.limit_m - kGuard_m);
  pair.asked_spare_m = pair.spare_m;
  pair.X_LS = X_LS;
  wait(index);
}

// Shares the remaining motion between the two bodies: all of it to the only mobile one, else half each, but
// less to Parts, which mostly rest.
void ClearanceMonitor::wait(int index) {
  Pair& pair = pairs_[static_cast<std::size_t>(index)];
  const CheckedPair& checked = model_.pairs[static_cast<std::size_t>(index)];
  Body& a = bodies_[static_cast<std::size_t>(checked.a)];
  Body& b = bodies_[static_cast<std::size_t>(checked.b)];
  const auto weight = [this](int body) {
    const CheckedBody& b_of = model_.bodies[static_cast<std::size_t>(body)];
    return !b_of.moves ? 0.0 : b_of.is_part ? 0.2 : 1.0;
  };
  const double weight_a = weight(checked.a), weight_b = weight(checked.b);
  const double left = std::max(0.0, pair.spare_m - (a.path_m - pair.path_a_m) - (b.path_m - pair.path_b_m)) /
                      (weight_a + weight_b);
  pair.wake_a_m = weight_a > 0.0 ? a.path_m + weight_a * left : kNever;
  pair.wake_b_m = weight_b > 0.0 ? b.path_m + weight_b * left : kNever;
  a.wake_m = std::min(a.wake_m, pair.wake_a_m);
  b.wake_m = std::min(b.wake_m, pair.wake_b_m);
}

void ClearanceMonitor::judge(int index, const BodyDistance& found, const Instant& now) {
  Pair& pair = pairs_[static_cast<std::size_t>(index)];
  const double limit = model_.pairs[static_cast<std::size_t>(index)].limit_m;
  const double d = found.distance_m;
  const bool overlaps = d < -touching_m(static_cast<std::size_t>(index));
  if (pair.open) {
    if (d < pair.least_m) pair.least_m = d, pair.least_p_W = found.p_W;
  } else {
    if (!overlaps && !(d < limit)) return;
    pair.open = true;
    ++open_pairs_;
    pair.overlapping = false;
    pair.since_s = now.time_s;
    pair.least_m = d, pair.least_p_W = found.p_W;
    if (!overlaps) report(CollisionEvent::Kind::clearance, index, d, found.p_W, now);
  }
  if (overlaps && !pair.overlapping) {
    pair.overlapping = true;
    report(CollisionEvent::Kind::collision, index, d, found.p_W, now);
  }
  if (d > model_.hysteresis_m) pair.overlapping = false;
  if (d > limit + model_.hysteresis_m) close(index, now);
}

void ClearanceMonitor::close(int index, const Instant& now) {
  Pair& pair = pairs_[static_cast<std::size_t>(index)];
  report(CollisionEvent::Kind::clearance_restored, index, pair.least_m, pair.least_p_W, now);
  events_.back().duration_s = now.time_s - pair.since_s;
  pair.open = pair.overlapping = false;
  --open_pairs_;
}

void ClearanceMonitor::report(CollisionEvent::Kind kind, int index, double distance_m, const Vec3& p_W,
                              const Instant& now) {
  const CheckedPair& pair = model_.pairs[static_cast<std::size_t>(index)];
  events_.push_back({kind, now.time_s, now.step, pair.a, pair.b, pair.limit_m, distance_m, 0.0, p_W});
}

}  // namespace takt
