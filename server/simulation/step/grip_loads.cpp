#include "server/simulation/step/grip_loads.h"

#include <algorithm>
#include <cmath>

#include "plant_models/state_bytes.h"
#include "server/contact/surface/contact_law.h"

namespace takt {

GripLoads::GripLoads(const CellModel& model)
    : model_(model), loads_(model.grippers.size()), reported_(model.grippers.size(), 0) {
  weak_.reserve(model.grippers.size());
}

void GripLoads::reset() {
  std::fill(loads_.begin(), loads_.end(), GripLoad{});
  std::fill(reported_.begin(), reported_.end(), 0);
  weak_.clear();
}

double GripLoads::least_friction(std::size_t gripper, std::span<const int> parts) const {
  const std::vector<double>& friction = model_.grippers[gripper].friction;
  if (friction.empty()) return ContactParameters{}.friction;
  double least = friction[static_cast<std::size_t>(parts.front())];
  for (const int part : parts) least = std::min(least, friction[static_cast<std::size_t>(part)]);
  return least;
}

void GripLoads::update(double t, std::uint64_t step, const CellMotion& motion,
                       const ComponentInteraction& interaction, const Grasping& grasping,
                       const CellPlant& plant) {
  weak_.clear();
  for (std::size_t g = 0; g < loads_.size(); ++g) {
    GripLoad& load = loads_[g];
    load = {};
    const int part = grasping.by_contact(g) ? -1 : grasping.part_present(g);
    if (part < 0) {
      reported_[g] = 0;
      continue;
    }
    const int palm = model_.grippers[g].parameters.palm;
    Vec3 force_W = Vec3::Zero();
    for (const PairConnection& pair : interaction.connections())
      if (pair.connection.partner == palm && interaction.attached_to(pair.base) != palm)
        force_W += interaction.pair_wrench(pair, motion).f;
    const Vec3 force_G = motion.bodies[static_cast<std::size_t>(palm)].X_WB.R.transpose() * force_W;
    const double across_N = std::hypot(force_G.x(), force_G.z()), along_N = std::abs(force_G.y());
    const double friction = least_friction(g, grasping.states()[g].held);
    load.part = part;
    load.force_N = grasping.grip_force_N(g, plant);
    // Without friction no force acts across: the lower limit keeps the number finite.
    load.needed_N = 0.5 * (across_N / std::max(friction, 1e-6) + along_N);
    if (reported_[g] != 0 || load.needed_N <= load.force_N) continue;
    reported_[g] = 1;
    weak_.push_back({t, step, static_cast<int>(g), part, load.needed_N, load.force_N});
  }
}

void GripLoads::save(StateWriter& out) const {
  for (std::size_t g = 0; g < loads_.size(); ++g) {
    out.put(loads_[g].part), out.put(loads_[g].needed_N), out.put(loads_[g].force_N);
    out.put(reported_[g] != 0);
  }
}

void GripLoads::load(StateReader& in) {
  for (std::size_t g = 0; g < loads_.size(); ++g) {
    loads_[g].part = in.index(model_.components.size(), "a gripped Part");
    loads_[g].needed_N = in.number("a force");
    loads_[g].force_N = in.number("a force");
    reported_[g] = in.flag("'a weak grip was reported'") ? 1 : 0;
  }
  weak_.clear();
}

}  // namespace takt
