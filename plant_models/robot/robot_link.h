#pragma once
// A named link of a robot: fixed to the base or to the link that one joint moves.
#include <string>

#include "plant_models/spatial.h"

namespace takt {

struct RobotLink {
  std::string name;
  int joint = -1;  ///< index of the moving joint that carries it; -1: the base
  Pose X_JL;       ///< link frame in the frame of that joint, or in the base
};

}  // namespace takt
