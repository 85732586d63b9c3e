#pragma once
// The mass and the centre of mass of what a flange carries, from wrenches in several orientations (estimate_payload of
// URScript): least squares, with a constant error of the sensor.
#include <span>

#include "plant_models/spatial.h"

namespace takt::ur {

struct WeighedPose {
  Mat3 R_BF;   ///< flange in the base
  Wrench F_B;  ///< force and torque about the flange's origin, axes of the base
};

struct PayloadEstimate {
  double mass_kg = 0.0;
  Vec3 moment_F = Vec3::Zero();  ///< mass times centre of mass, kg m
};

/// `up_B`: acceleration of a body that rests, m/s^2. Throws std::invalid_argument for fewer than four poses, and where the
/// orientations of two differ by less than pi / (2 n).
PayloadEstimate estimate_payload(std::span<const WeighedPose> poses, const Vec3& up_B);

}  // namespace takt::ur
