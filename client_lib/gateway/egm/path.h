#pragma once
// The programmed path of EGM path correction: straight lines between poses of the tool (EGMMoveL), at constant speed, and the
// axes in which a sensor corrects it. Source: ABB 3HAC073318-001, 1.4.
#include <vector>

#include "plant_models/spatial.h"

namespace takt::gateway::egm {

/// A pose of the tool, in the robot's base frame.
struct PathPoint {
  Pose X_RT;
};

/// Axes of the path coordinate system: x along the path, y across it and across z of the tool, z = x cross y.
Mat3 path_axes(const Vec3& tangent, const Vec3& tool_z);

class Path {
 public:
  /// Throws std::invalid_argument for a point at the place of the one before it, and where the tool's z axis lies along the
  /// path.
  Path(const Pose& start, const std::vector<PathPoint>& points);

  double length_m() const { return ends_m_.back(); }
  /// At this length from the start; `offset_m` is in the axes of the path there.
  Pose at(double along_m, const Vec3& offset_m) const;

 private:
  std::vector<Pose> poses_;
  std::vector<double> ends_m_;  ///< of each line, from the start
};

}  // namespace takt::gateway::egm
