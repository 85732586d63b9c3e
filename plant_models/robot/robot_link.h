#pragma once
// A link of a robot by its name, as others refer to it: fixed to the base or to what one joint moves.
#include <string>

#include "plant_models/spatial.h"

namespace takt {

struct RobotLink {
  std::string name;
  int joint = -1;  ///< index of the moving joint it hangs on; -1: the base
  Pose X_JL;       ///< link frame in the frame of that joint, or in the base
};

}  // namespace takt
