#include "server/simulation/step/threshold_sleeping.h"

#include <algorithm>
#include <cmath>

#include "plant_models/state_bytes.h"

namespace takt {

namespace {
constexpr int kLeastSteps = 2;
// Bounds are near that the present speeds, a large acceleration and this slack let meet within some steps.
constexpr double kSlack_m = 1e-4;
constexpr double kAcceleration_m_per_s2 = 20.0;
constexpr double kStepsToWake = 2.0;
// A group that is kept together more widely than it is woken does not wake itself.
constexpr double kStepsToJoin = 3.0;
}  // namespace

ThresholdSleeping::ThresholdSleeping(const std::vector<Component>& components,
                                     const SleepingParameters& parameters, double step_s,
                                     ContactInteraction& contacts, ExactSleeping& exact)
    : components_(components),
      parameters_(parameters),
      step_s_(step_s),
      steps_(std::max(kLeastSteps, static_cast<int>(std::ceil(parameters.time_to_sleep_s / step_s - 1e-9)))),
      contacts_(contacts),
      exact_(exact),
      slow_steps_(exact.parts().size(), 0),
      group_(slow_steps_.size(), -1),
      near_(slow_steps_.size()),
      kept_up_(slow_steps_.size(), 0),
      may_sleep_(slow_steps_.size(), 0),
      asleep_(components.size(), 0) {}

void ThresholdSleeping::wake_all() {
  std::fill(slow_steps_.begin(), slow_steps_.end(), 0);
  std::fill(group_.begin(), group_.end(), -1);
  std::fill(asleep_.begin(), asleep_.end(), 0);
  sleeping_ = 0;
  leave_parked();
  contacts_.set_asleep(asleep_);
  for (std::size_t i = 0; i < may_sleep_.size(); ++i)
    may_sleep_[i] = contacts_.acts_on(exact_.parts()[i]) ? 1 : 0;
}

/// A parked Part meets no other, and no group of sleepers contains it.
void ThresholdSleeping::leave_parked() {
  for (std::size_t i = 0; i < group_.size(); ++i)
    if (exact_.is_parked(i)) asleep_[static_cast<std::size_t>(exact_.parts()[i])] = 1;
}

void ThresholdSleeping::save(StateWriter& out) const {
  for (std::size_t i = 0; i < slow_steps_.size(); ++i) out.put(slow_steps_[i]), out.put(group_[i]);
}

void ThresholdSleeping::load(StateReader& in) {
  wake_all();
  for (std::size_t i = 0; i < slow_steps_.size(); ++i) {
    slow_steps_[i] = in.integer<int>(0, steps_, "steps that a Part was slow");
    group_[i] = in.integer<int>(-1, static_cast<int>(group_.size()) - 1, "a group of sleeping Parts");
    if (group_[i] < 0) continue;
    asleep_[static_cast<std::size_t>(exact_.parts()[i])] = 1;
    ++sleeping_;
  }
  contacts_.set_asleep(asleep_);
}

bool ThresholdSleeping::asleep(int component) const {
  return asleep_[static_cast<std::size_t>(component)] != 0;
}

bool ThresholdSleeping::moves(int component) const {
  const auto c = static_cast<std::size_t>(component);
  if (components_[c].type == ComponentType::ground)
    return !moving_grounds_.empty() && moving_grounds_[c] != 0;
  return !asleep(component);
}

/// No point of the component's surface is faster, as seen from the world.
double ThresholdSleeping::speed_m_per_s(int component, const CellMotion& motion) const {
  const Twist& V = motion.bodies[static_cast<std::size_t>(component)].V_WB;
  return V.v.norm() + V.w.norm() * contacts_.radius_m(component);
}

bool ThresholdSleeping::may_meet(const PairContact& pair, const CellMotion& motion, double steps) const {
  double speed = 0.0;
  for (const int end : {pair.base, pair.target})
    if (moves(end)) speed += speed_m_per_s(end, motion);
  const double time_s = steps * step_s_;
  return contacts_.bounds_meet(pair, motion,
                               kSlack_m + time_s * speed + kAcceleration_m_per_s2 * time_s * time_s);
}

bool ThresholdSleeping::wake_reached(const CellMotion& motion) {
  if (sleeping_ == 0) return false;
  std::vector<char>& woken = kept_up_;  // by place of a Part: its group wakes
  std::fill(woken.begin(), woken.end(), 0);
  bool any = false;
  const auto wake = [&](int place) {
    woken[static_cast<std::size_t>(place)] = 1;
    any = true;
  };
  for (std::size_t i = 0; i < group_.size(); ++i)
    if (group_[i] >= 0 && !exact_.is_asleep(i)) wake(static_cast<int>(i));
  for (const PairContact* const near : contacts_.moving()) {
    const PairContact& ends = *near;
    const int sleeper = asleep(ends.base) ? ends.base : ends.target;
    const int other = sleeper == ends.base ? ends.target : ends.base;
    if (asleep(sleeper) && moves(other) && may_meet(ends, motion, kStepsToWake))
      wake(exact_.place_of(sleeper));
  }
  if (!any) return false;
  for (std::size_t i = 0; i < woken.size(); ++i) {
    if (woken[i] == 0 || group_[i] < 0) continue;
    const int group = group_[i];
    for (std::size_t k = 0; k < group_.size(); ++k) {
      if (group_[k] != group) continue;
      group_[k] = -1;
      slow_steps_[k] = 0;
      exact_.set_asleep(k, false);
      asleep_[static_cast<std::size_t>(exact_.parts()[k])] = 0;
      --sleeping_;
    }
  }
  exact_.list_awake();
  contacts_.set_asleep(asleep_);
  return true;
}

// Groups of the awake Parts; kept_up_ of their roots.
void ThresholdSleeping::find_groups(const ComponentInteraction& interaction, const CellMotion& motion) {
  near_.reset();
  std::fill(kept_up_.begin(), kept_up_.end(), 0);
  // First for the Parts themselves, then for the roots.
  for (const int place : exact_.awake_indices())
    if (slow_steps_[static_cast<std::size_t>(place)] < steps_) kept_up_[static_cast<std::size_t>(place)] = 1;
  const auto together = [this](int a, int b) {
    const int place = exact_.place_of(a), other = exact_.place_of(b);
    if (place >= 0 && other >= 0)
      near_.join(place, other);
    else if (moves(place >= 0 ? b : a))  // a Gripper, or a Ground that moves
      kept_up_[static_cast<std::size_t>(place >= 0 ? place : other)] = 1;
  };
  for (const PairContact* const near : contacts_.moving()) {
    const PairContact& ends = *near;
    if (exact_.place_of(ends.base) < 0 && exact_.place_of(ends.target) < 0) continue;
    // A sleeping component was not near when it fell asleep, and wakes before another one comes near.
    if (asleep(ends.base) || asleep(ends.target)) continue;
    if (may_meet(ends, motion, kStepsToJoin)) together(ends.base, ends.target);
  }
  for (const int part : exact_.awake())
    for (const PairConnection& pair : interaction.connections_of(part))
      together(part, pair.connection.partner);
  for (const int place : exact_.awake_indices())
    if (kept_up_[static_cast<std::size_t>(place)] != 0)
      kept_up_[static_cast<std::size_t>(near_.root(place))] = 1;
}

bool ThresholdSleeping::fall_asleep(const ComponentInteraction& interaction, const CellMotion& motion) {
  bool any_slow = false;
  for (const int place : exact_.awake_indices()) {
    int& slow_steps = slow_steps_[static_cast<std::size_t>(place)];
    const int part = exact_.parts()[static_cast<std::size_t>(place)];
    const bool slow = may_sleep_[static_cast<std::size_t>(place)] != 0 &&
                      speed_m_per_s(part, motion) < parameters_.speed_m_per_s;
    slow_steps = slow ? std::min(slow_steps + 1, steps_) : 0;
    any_slow = any_slow || slow_steps == steps_;
  }
  if (!any_slow) return false;
  find_groups(interaction, motion);
  bool changed = false;
  for (const int index : exact_.awake_indices()) {
    const int group = near_.root(index);
    if (kept_up_[static_cast<std::size_t>(group)] != 0) continue;
    const auto place = static_cast<std::size_t>(index);
    group_[place] = group;
    exact_.set_asleep(place, true);
    asleep_[static_cast<std::size_t>(exact_.parts()[place])] = 1;
    ++sleeping_;
    changed = true;
  }
  if (!changed) return false;
  exact_.list_awake();
  contacts_.set_asleep(asleep_);
  return true;
}

}  // namespace takt
