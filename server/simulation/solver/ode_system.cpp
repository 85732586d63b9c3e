#include "server/simulation/solver/ode_system.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/simulation/solver/islands.h"

namespace takt {

OdeSystem::OdeSystem(std::vector<PlantModel*> models, const ComponentInteraction& interaction,
                     std::size_t body_count, std::size_t arm_count, ContactInteraction* contacts)
    : interaction_(interaction), contacts_(contacts), wrenches_(body_count), kept_(body_count) {
  motion_.bodies.resize(body_count);
  motion_.arms.resize(arm_count);
  motion_.heat.resize(body_count);
  segment_of_body_.resize(body_count, -1);
  std::size_t begin = 0;
  std::vector<std::pair<int, int>> entries;
  for (PlantModel* model : models) {
    const auto count = static_cast<std::size_t>(model->state_count());
    if (model->body() >= 0) {
      segment_of_body_[static_cast<std::size_t>(model->body())] = static_cast<int>(segments_.size());
      if (count > 0) part_bodies_.push_back(model->body());
    }
    if (model->body() >= 0 && count == 0) fixed_.push_back(segments_.size());
    if (count > 0) blocks_.push_back({{begin, begin + count}, model->body()});
    segments_.push_back({model, begin, count, static_cast<std::size_t>(indicator_count_), pattern_.size()});
    indicator_count_ += model->indicator_count();
    entries.clear();
    model->jacobian_pattern(entries);
    for (const auto& [row, column] : entries)
      pattern_.push_back({static_cast<int>(begin) + row, static_cast<int>(begin) + column});
    begin += count;
  }
  state_count_ = static_cast<int>(begin);
  for (std::size_t body = 0; body < body_count; ++body) {
    const int segment = segment_of_body_[body];
    if (segment < 0 || segments_[static_cast<std::size_t>(segment)].count == 0)
      stateless_bodies_.push_back(static_cast<int>(body));
  }
  active_.reserve(segments_.size());
  active_states_.reserve(segments_.size());
  active_bodies_.reserve(body_count);
  awake_.reserve(part_bodies_.size());
  all_active_.reserve(segments_.size()), all_states_.reserve(segments_.size());
  all_awake_.reserve(part_bodies_.size());
  follows_.resize(segments_.size(), 0);
  followed_.resize(begin);
  wake_all();
}

void OdeSystem::set_awake(std::span<const int> parts) {
  activate(parts, false);
}

void OdeSystem::wake_all() {
  activate(part_bodies_, true);
}

void OdeSystem::activate(std::span<const int> parts, bool fixed_bodies) {
  active_.clear();
  active_states_.clear();
  active_bodies_.clear();
  awake_.assign(parts.begin(), parts.end());
  for (std::size_t i = 0; i < segments_.size(); ++i) {
    if (segments_[i].model->body() < 0 || (fixed_bodies && segments_[i].count == 0)) active_.push_back(i);
    if (segments_[i].count > 0 && segments_[i].model->body() < 0)
      active_states_.push_back({segments_[i].begin, segments_[i].begin + segments_[i].count});
  }
  for (const int part : parts) {
    const auto i = static_cast<std::size_t>(segment_of_body_[static_cast<std::size_t>(part)]);
    active_.push_back(i);
    const Range states{segments_[i].begin, segments_[i].begin + segments_[i].count};
    if (!active_states_.empty() && active_states_.back().end == states.begin)
      active_states_.back().end = states.end;
    else
      active_states_.push_back(states);
  }
  for (std::size_t body = 0; body < segment_of_body_.size(); ++body) {
    const int segment = segment_of_body_[body];
    if (segment < 0 || (fixed_bodies && segments_[static_cast<std::size_t>(segment)].count == 0))
      active_bodies_.push_back(static_cast<int>(body));
  }
  active_bodies_.insert(active_bodies_.end(), parts.begin(), parts.end());
}

void OdeSystem::attend(std::span<const std::size_t> segments, std::span<PairContact* const> pairs,
                       std::span<const int> ends, Islands& islands) {
  if (islands_ == nullptr) all_active_ = active_, all_states_ = active_states_, all_awake_ = awake_;
  follow(nullptr, {});
  active_.clear(), active_states_.clear(), awake_.clear();
  auto next = segments.begin();
  for (const std::size_t i : all_active_) {
    const Segment& segment = segments_[i];
    const bool attended = next != segments.end() && *next == i;
    if (attended) ++next;
    if (!attended && segment.count > 0) continue;
    active_.push_back(i);
    if (!attended) continue;
    active_states_.push_back({segment.begin, segment.begin + segment.count});
    if (segment.model->body() >= 0) awake_.push_back(segment.model->body());
  }
  contacts_->attend(pairs, ends);
  islands_ = &islands;
}

void OdeSystem::attend_all() {
  if (islands_ == nullptr) return;
  islands_ = nullptr;
  follow(nullptr, {});
  active_.swap(all_active_), active_states_.swap(all_states_), awake_.swap(all_awake_);
  contacts_->attend_all();
}

void OdeSystem::follow(const Courses* courses, std::span<const std::size_t> segments) {
  for (const std::size_t i : following_) follows_[i] = 0;
  courses_ = courses, following_ = segments;
  for (const std::size_t i : following_) follows_[i] = 1;
}

void OdeSystem::follow_courses(double t) {
  for (const std::size_t i : following_) {
    const Segment& segment = segments_[i];
    const auto& [begin_s, length_s] = courses_->spans[i];
    const double h = length_s, s = (t - begin_s) / h, r = 1.0 - s;
    const double from = r * r * (1.0 + 2.0 * s), to = s * s * (1.0 + 2.0 * r);
    const double out = h * s * r * r, in = h * s * s * r;
    for (std::size_t k = segment.begin; k < segment.begin + segment.count; ++k)
      followed_[k] = from * courses_->x[0][k] + to * courses_->x[1][k] + out * courses_->f[0][k] -
                     in * courses_->f[1][k];
    segment.model->write_motion(t, followed_.data() + segment.begin, motion_);
  }
}

void OdeSystem::initial_state(std::span<double> x) const {
  for (const Segment& segment : segments_) segment.model->initial_state(x.data() + segment.begin);
}

void OdeSystem::update_motion(double t, std::span<const double> x) {
  motion_.time_s = t;
  for (const std::size_t i : active_)
    segments_[i].model->write_motion(t, x.data() + segments_[i].begin, motion_);
  follow_courses(t);
  if (islands_ != nullptr) islands_->watch(motion_);
}

void OdeSystem::evaluate_wrenches() {
  // A Gripper that released its load, or whose screwdriver stopped, must not keep its old wrench.
  for (const int body : stateless_bodies_) wrenches_[static_cast<std::size_t>(body)] = {};
  if (!has_contacts() || islands_ != nullptr) {
    interaction_.evaluate(motion_, awake_, wrenches_);
  } else {
    for (const int body : awake_) wrenches_[static_cast<std::size_t>(body)] = {};
    interaction_.evaluate(motion_, wrenches_);
  }
  if (has_contacts()) contacts_->evaluate_moving(motion_, wrenches_);
  for (const ForceElement* element : elements_) element->add_wrenches(motion_, wrenches_);
}

void OdeSystem::update_stateless_motion(double t) {
  motion_.time_s = t;
  for (const std::size_t i : active_)
    if (segments_[i].count == 0) segments_[i].model->write_motion(t, nullptr, motion_);
  follow_courses(t);
}

std::span<const Wrench> OdeSystem::update_wrenches() {
  interaction_.evaluate(motion_, wrenches_, kept_);
  if (has_contacts()) contacts_->evaluate(motion_, wrenches_);
  for (const ForceElement* element : elements_) element->add_wrenches(motion_, wrenches_);
  return wrenches_;
}

void OdeSystem::hold_contacts(double next_s) {
  if (has_contacts()) contacts_->hold(motion_, next_s);
}

void OdeSystem::note_peaks() {
  if (has_contacts()) contacts_->note_peaks(motion_);
}

bool OdeSystem::watches_peaks() const {
  return has_contacts() && contacts_->watches_peaks();
}

void OdeSystem::derivatives(double t, std::span<const double> x, std::span<double> xdot) {
  update_motion(t, x);
  derivatives_at_motion(t, x, xdot);
}

void OdeSystem::derivatives_at_motion(double t, std::span<const double> x, std::span<double> xdot) {
  ++evaluations_;
  const double begin = clock_ != nullptr ? clock_() : 0.0;
  evaluate_wrenches();
  if (clock_ != nullptr) forces_s_ += clock_() - begin;
  for (const std::size_t i : active_) {
    const Segment& segment = segments_[i];
    if (segment.count == 0) continue;
    segment.model->derivatives(t, x.data() + segment.begin, motion_, wrenches_, xdot.data() + segment.begin);
  }
}

void OdeSystem::indicators(double t, std::span<const double> x, std::span<double> g) {
  update_motion(t, x);
  evaluate_wrenches();
  for (const Segment& segment : segments_) {
    if (segment.model->indicator_count() == 0) continue;
    segment.model->indicators(t, x.data() + segment.begin, motion_, wrenches_,
                              g.data() + segment.first_indicator);
  }
}

bool OdeSystem::switch_modes(double t, std::span<double> x) {
  if (indicator_count_ == 0) return false;
  update_motion(t, x);
  evaluate_wrenches();
  bool changed = false;
  for (const Segment& segment : segments_) {
    if (segment.model->indicator_count() == 0) continue;
    if (segment.model->switch_modes(t, x.data() + segment.begin, motion_, wrenches_)) changed = true;
  }
  return changed;
}

double OdeSystem::next_time_event(double t) const {
  double next = std::numeric_limits<double>::infinity();
  const auto note = [&](std::size_t i) {
    const double event = segments_[i].model->next_time_event(t);
    if (!std::isnan(next) && !(event >= next)) next = event;  // a NaN is kept, so that the caller refuses it
  };
  for (const std::size_t i : fixed_) note(i);
  for (const std::size_t i : active_) note(i);
  return next;
}

void OdeSystem::jacobian(double t, std::span<const double> x, std::span<double> values) const {
  for (const Segment& segment : segments_)
    segment.model->jacobian(t, x.data() + segment.begin, motion_, values.data() + segment.first_entry);
}

void OdeSystem::time_derivative(double t, std::span<const double> x, std::span<double> rate) const {
  for (const std::size_t i : active_) {
    const Segment& segment = segments_[i];
    std::fill_n(rate.begin() + static_cast<std::ptrdiff_t>(segment.begin), segment.count, 0.0);
    segment.model->time_derivative(t, x.data() + segment.begin, motion_, rate.data() + segment.begin);
  }
}

void OdeSystem::state_scales(std::span<double> scales) const {
  for (const Segment& segment : segments_) segment.model->state_scales(scales.data() + segment.begin);
}

}  // namespace takt
