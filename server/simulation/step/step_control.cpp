// Mechanisms at the begin of a step, and Parts that enter and leave the cell (StepControl).
#include <algorithm>

#include "server/simulation/step/simulation_impl.h"

namespace takt {

namespace {

class Control final : public StepControl {
 public:
  explicit Control(Simulation::Impl& simulation) : s_(simulation) {}

  double time_s() const override { return s_.time(); }
  double step_s() const override { return s_.model->step_s; }
  const CellMotion& motion() override {
    s_.refresh_motion();
    return s_.system().motion();
  }
  CellPlant& plant() override { return s_.plant; }
  ComponentInteraction& interaction() override { return s_.interaction; }
  bool parked(int part) const override { return s_.is_parked(part); }
  void park(int part) override { s_.park(part); }
  void bring_in(int part, const Pose& X_WB, const Twist& V_WB) override { s_.bring_in(part, X_WB, V_WB); }

 private:
  Simulation::Impl& s_;
};

}  // namespace

void Simulation::Impl::begin_mechanisms() {
  if (mechanisms.empty()) return;
  Control control(*this);
  device_notices.clear();
  const bool allowed = plant.motion_allowed();
  for (const auto& mechanism : mechanisms) mechanism->begin_step(control);
  if (plant.motion_allowed() != allowed) plant.integrator().restart();  // axes and belts brake from here on
  if (plant.motion_allowed()) std::fill(refused.begin(), refused.end(), 0);
}

void Simulation::Impl::note_devices() {
  for (const auto& mechanism : mechanisms) {
    for (const DeviceNotice& notice : mechanism->notices()) {
      device_notices.push_back(notice);
      device_notices.back().time_s = time();
      device_notices.back().step = step_index;
    }
  }
}

void Simulation::Impl::park_pools() {
  for (const PartPool& pool : model->pools)
    for (const int part : pool.parts)
      exact_sleeping.set_parked(static_cast<std::size_t>(exact_sleeping.place_of(part)), true);
}

void Simulation::Impl::park(int part) {
  const auto place = static_cast<std::size_t>(exact_sleeping.place_of(part));
  if (exact_sleeping.is_parked(place)) return;
  const auto let_go = [this](int attached) {
    interaction.detach(attached);
    mechanism_let_go = true;
  };
  if (interaction.attached_to(part) != -1) let_go(part);
  for (const RigidBodyParameters& other : model->parts)
    if (interaction.attached_to(other.body) == part) let_go(other.body);
  exact_sleeping.set_parked(place, true);
  moved(place, model->parts[place].X_WB_initial, {});
  parts_hash -= part_hashes[place];
  part_hashes[place] = 0;
}

void Simulation::Impl::bring_in(int part, const Pose& X_WB, const Twist& V_WB) {
  const auto place = static_cast<std::size_t>(exact_sleeping.place_of(part));
  exact_sleeping.set_parked(place, false);
  moved(place, X_WB, V_WB);
}

void Simulation::Impl::moved(std::size_t part, const Pose& X_WB, const Twist& V_WB) {
  const int component = model->parts[part].body;
  if (!exact_sleeping.is_parked(part)) {
    BodyMotion motion;
    motion.X_WB = X_WB, motion.V_WB = V_WB, motion.p_WBcm = X_WB * model->parts[part].p_BBcm;
    watch.given(part, motion);
  }
  for (std::size_t i = 0; i < start_overlaps.size(); ++i) {
    const StartOverlap& overlap = model->start_overlaps[i];
    if (overlap.part == component || overlap.other == component) start_overlaps[i] = 0;
  }
  plant.put_part(part, X_WB, V_WB);
  wake_all();
  interaction.put_elsewhere(component);
  contacts.forget(component);
  motion_is_current = false;
  refresh_motion();
  find_near();
}

}  // namespace takt
