#include "client_lib/gateway/egm/path.h"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace takt::gateway::egm {
namespace {

constexpr double kShortest_m = 1e-6;
/// Sine of the least angle between the path and the tool's z axis.
constexpr double kLeastSine = 1e-3;

}  // namespace

Mat3 path_axes(const Vec3& tangent, const Vec3& tool_z) {
  Mat3 axes;
  axes.col(0) = tangent.normalized();
  axes.col(1) = axes.col(0).cross(tool_z).normalized();
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return axes;
}

Path::Path(const Pose& start, const std::vector<PathPoint>& points) : poses_{start} {
  double length_m = 0.0;
  for (const PathPoint& point : points) {
    const Pose& before = poses_.back();
    const Vec3 way = point.X_RT.p - before.p;
    const std::string name = "path: point " + std::to_string(poses_.size());
    if (way.norm() < kShortest_m)
      throw std::invalid_argument(name + " is where the one before it is; allowed: points apart.");
    for (const Pose* end : {&before, &point.X_RT})
      if (way.normalized().cross(Vec3(end->R.col(2))).norm() < kLeastSine)
        throw std::invalid_argument(
            name + ": the z axis of the tool lies along the line to it; allowed: across it.");
    length_m += way.norm();
    poses_.push_back(point.X_RT);
    ends_m_.push_back(length_m);
  }
  if (ends_m_.empty()) throw std::invalid_argument("path: found no point; allowed: one or more.");
}

Pose Path::at(double along_m, const Vec3& offset_m) const {
  const auto end = std::lower_bound(ends_m_.begin(), std::prev(ends_m_.end()), along_m);
  const auto line = static_cast<std::size_t>(end - ends_m_.begin());
  const double begin_m = line == 0 ? 0.0 : ends_m_[line - 1];
  const double share = std::clamp((along_m - begin_m) / (*end - begin_m), 0.0, 1.0);
  const Pose &from = poses_[line], &to = poses_[line + 1];
  const Quat q = from.quaternion().slerp(share, to.quaternion());
  const Pose X = Pose::from_quaternion(from.p + share * (to.p - from.p), q);
  return {X.R, X.p + path_axes(to.p - from.p, X.R.col(2)) * offset_m};
}

}  // namespace takt::gateway::egm
