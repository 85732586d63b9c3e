#include "server/simulation/ode_system.h"

namespace takt {

OdeSystem::OdeSystem(std::vector<const PlantModel*> models, const ComponentInteraction& interaction,
                     std::size_t body_count, std::size_t arm_count)
    : interaction_(interaction), wrenches_(body_count) {
  motion_.bodies.resize(body_count);
  motion_.arms.resize(arm_count);
  std::size_t begin = 0;
  for (const PlantModel* model : models) {
    const auto count = static_cast<std::size_t>(model->state_count());
    segments_.push_back({model, begin, count});
    begin += count;
  }
  state_count_ = static_cast<int>(begin);
}

void OdeSystem::initial_state(std::span<double> x) const {
  for (const Segment& segment : segments_) segment.model->initial_state(x.data() + segment.begin);
}

void OdeSystem::update_motion(double t, std::span<const double> x) {
  for (const Segment& segment : segments_) segment.model->write_motion(t, x.data() + segment.begin, motion_);
}

std::span<const Wrench> OdeSystem::update_wrenches() {
  interaction_.evaluate(motion_, wrenches_);
  return wrenches_;
}

void OdeSystem::derivatives(double t, std::span<const double> x, std::span<double> xdot) {
  update_motion(t, x);
  derivatives_at_motion(t, x, xdot);
}

void OdeSystem::derivatives_at_motion(double t, std::span<const double> x, std::span<double> xdot) {
  ++evaluations_;
  const double begin = clock_ != nullptr ? clock_() : 0.0;
  update_wrenches();
  if (clock_ != nullptr) forces_s_ += clock_() - begin;
  for (const Segment& segment : segments_) {
    if (segment.count == 0) continue;
    segment.model->derivatives(t, x.data() + segment.begin, motion_, wrenches_, xdot.data() + segment.begin);
  }
}

}  // namespace takt
