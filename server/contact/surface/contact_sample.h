#pragma once
// Wrench of surface contact (level of detail 3) between one pair of components at one time.
#include "server/contact/surface/polygonal_contact.h"

namespace takt {

struct ContactSample {
  int base = -1, target = -1;  ///< component ids
  Wrench F_base_W;             ///< on the base, about the centre of pressure, world axes
  Vec3 p_WC = Vec3::Zero();    ///< centre of pressure
  ContactResult result;
};

/// The sample of the largest normal force of a pair, with its time.
struct ContactPeak {
  double time_s = 0.0;
  ContactSample sample;
};

}  // namespace takt
