#pragma once
// The springs of the stick law: per element a point of the Target to which it is tied.
#include <cstdint>
#include <span>
#include <vector>

#include "plant_models/spatial.h"

namespace takt {

struct ContactSpring {
  std::int32_t element = -1;
  /// Position of the element's point without spring force; on a surface that moves, in the frame of its material.
  Vec3 anchor_T = Vec3::Zero();
};

/// Four numbers per spring: element, anchor.
std::vector<double> save_springs(const std::vector<ContactSpring>& springs);

/// Throws std::invalid_argument unless save_springs made the numbers for a Base of `element_count` elements.
std::vector<ContactSpring> restore_springs(std::span<const double> kept, std::size_t element_count);

}  // namespace takt
