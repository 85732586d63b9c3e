#include "server/simulation/solver/error_scales.h"

#include <algorithm>

#include "plant_models/mechanics/rigid_body.h"

namespace takt {

ErrorScales::ErrorScales(const OdeSystem& system, double looseness, double most_rotation_rad_per_s)
    : scales_(static_cast<std::size_t>(system.state_count())), relative_(scales_.size(), 1.0) {
  system.state_scales(scales_);
  for (const OdeSystem::Segment& segment : system.segments())
    for (std::size_t i = segment.begin;
         i < segment.begin + static_cast<std::size_t>(segment.model->absolute_states()); ++i)
      relative_[i] = 0.0, scales_[i] *= looseness;
  for (const OdeSystem::Block& block : system.blocks()) {
    if (block.body < 0 || block.states.end - block.states.begin != RigidBody::kStates) continue;
    for (std::size_t i = block.states.end - 3; i < block.states.end; ++i)
      scales_[i] = std::min(scales_[i], most_rotation_rad_per_s);
  }
}

}  // namespace takt
