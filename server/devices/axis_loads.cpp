#include "server/devices/axis_loads.h"

#include <algorithm>
#include <cmath>

#include "server/contact/holding/component_interaction.h"
#include "server/devices/conveyor.h"
#include "server/devices/moving_grounds.h"
#include "server/simulation/step/cell_plant.h"

namespace takt {

namespace {

/// The same wrench about another point: `r` from there to the present one.
Wrench shifted(const Wrench& wrench, const Vec3& r) {
  return {wrench.f, wrench.t + r.cross(wrench.f)};
}

}  // namespace

AxisLoads::AxisLoads(const Model& model) : model_(model) {
  notices_.reserve(model.axes.size());
}

void AxisLoads::start(ComponentInteraction& interaction) {
  loads_W_.resize(interaction.graph().vertices.size());
  notices_.clear();
}

void AxisLoads::begin_step(StepControl&) {
  notices_.clear();
}

void AxisLoads::note(const MovingGrounds& axis, CellPlant& plant) {
  DeviceNotice notice;
  for (const int device : model_.axes)
    if (&plant.device(static_cast<std::size_t>(device)) == &axis) notice.device = device;
  notice.kind = axis.rotary() ? DeviceNotice::Kind::table_overloaded : DeviceNotice::Kind::axis_overloaded;
  notice.load_N = std::abs(axis.force());
  notice.force_N = axis.force_limit();
  notices_.push_back(notice);
}

bool AxisLoads::update(double h, const CellMotion& motion, CellPlant& plant, ComponentInteraction&) {
  const double t = motion.time_s;
  const std::span<const Wrench> wrenches = plant.system().update_wrenches();
  const std::span<GroundCarrier* const> carriers = plant.carriers();
  std::fill(loads_W_.begin(), loads_W_.end(), Wrench{});
  for (const GroundCarrier* carrier : carriers) {
    for (const int ground : carrier->carried()) {
      const auto g = static_cast<std::size_t>(ground);
      loads_W_[g] = wrenches[g];  // about its centre of mass, which is its origin
    }
  }
  for (GroundCarrier* carrier : carriers)
    if (auto* conveyor = dynamic_cast<Conveyor*>(carrier); conveyor != nullptr)
      conveyor->take_load(t, h, wrenches[static_cast<std::size_t>(conveyor->belt())], motion);
  for (std::size_t r = 0; r < plant.robots().size(); ++r) {
    const int mount = plant.robots()[r].parameters().mount;
    if (mount < 0 || plant.dynamic(r) == nullptr) continue;
    const auto g = static_cast<std::size_t>(mount);
    const Wrench base_W =
        plant.dynamic(r)->output(t, plant.segment(r).data(), motion, wrenches).base_reaction_W;
    loads_W_[g] += shifted(base_W, motion.arms[r].base.X_WR.p - motion.bodies[g].X_WB.p);
  }
  // An axis comes after the one that it stands on.
  bool changed = false;
  for (auto carrier = carriers.rbegin(); carrier != carriers.rend(); ++carrier) {
    auto* axis = dynamic_cast<MovingGrounds*>(*carrier);
    if (axis == nullptr) continue;
    const Vec3 p_W = axis->load_point(motion);
    Wrench load_W = axis->own_load(t, motion);
    for (const int ground : axis->carried()) {
      const auto g = static_cast<std::size_t>(ground);
      load_W += shifted(loads_W_[g], motion.bodies[g].X_WB.p - p_W);
    }
    const bool was_overloaded = axis->overloaded();
    changed |= axis->take_load(t, h, axis->drive_force(t, load_W, motion));
    if (axis->overloaded() && !was_overloaded) note(*axis, plant);
    if (axis->mount() < 0) continue;
    const auto m = static_cast<std::size_t>(axis->mount());
    loads_W_[m] += shifted(load_W, p_W - motion.bodies[m].X_WB.p);
  }
  if (changed) plant.integrator().restart();
  return false;
}

}  // namespace takt
