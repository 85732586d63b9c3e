// True friction of a robot's drives: zero-crossing functions and the switching between accepted steps.
#include "plant_models/robot/dynamic_robot_impl.h"

namespace takt {

namespace {
constexpr int kMaxReleases = 4;  // of one drive in one switch
// Accelerations below this are rounding (rad/s^2): if break-away and sliding friction are equal, a drive
// released at an exactly located crossing has an acceleration of rounding error, of either sign.
constexpr double kNoAcceleration = 1e-9;
}  // namespace

int DynamicRobot::indicator_count() const {
  return impl_->indicators;
}

void DynamicRobot::indicators(double t, const double* x, const CellMotion& motion,
                              std::span<const Wrench> wrenches, double* g) const {
  Impl& m = *impl_;
  if (m.indicators == 0) return;
  m.solve(t, x, motion, wrenches, m.solution);
  for (int i = 0; i < m.joints; ++i) {
    if (m.drive(i).has_modes())
      *g++ = m.drive(i).indicator(x[i], x[m.joints + i], m.solution.holding[static_cast<size_t>(i)],
                                  m.drive_states(x, i));
  }
}

// Sliding that came to rest or reversed sticks first. Then, because stuck joints are coupled through the arm:
// solve with the present stuck set, release the joint furthest beyond break-away (exact equality counts,
// because a located crossing may end there), and repeat. A released joint that would move against its
// direction, because of later releases, sticks again. The number of releases of each drive is bounded, so the
// loop ends.
bool DynamicRobot::switch_modes(double t, double* x, const CellMotion& motion,
                                std::span<const Wrench> wrenches) {
  Impl& m = *impl_;
  if (m.indicators == 0) return false;
  const int n = m.joints;
  std::array<FrictionMode, kMaxJoints> before{};
  std::array<int, kMaxJoints> releases{};
  bool changed = false;
  for (int i = 0; i < n; ++i) {
    const Drive& drive = m.drive(i);
    if (!drive.has_modes()) continue;
    double* z = x + m.z_begin[static_cast<size_t>(i)];
    double& qd = x[n + i];
    const FrictionMode mode = before[static_cast<size_t>(i)] = drive.mode(z);
    const double speed = drive.friction_speed(qd, z);
    if (mode != FrictionMode::stuck && static_cast<double>(mode) * speed <= 0.0) {
      if (speed != 0.0) changed = true;
      drive.set_mode(FrictionMode::stuck, qd, z);
    }
  }
  for (bool again = true; again;) {
    again = false;
    m.solve(t, x, motion, wrenches, m.solution);
    int furthest = -1;
    double largest = Drive::kReleaseShare, direction = 0.0;
    for (int i = 0; i < n; ++i) {
      const auto k = static_cast<size_t>(i);
      const Drive& drive = m.drive(i);
      if (!drive.has_modes()) continue;
      double* z = x + m.z_begin[k];
      double& qd = x[n + i];
      const FrictionMode mode = drive.mode(z);
      if (mode == FrictionMode::stuck) {
        const double torque = drive.stuck_torque(x[i], qd, m.solution.holding[k], z);
        const double share = std::abs(torque) / drive.break_away_torque();
        if (share < largest || releases[k] >= kMaxReleases) continue;
        furthest = i, largest = share, direction = torque;
      } else if (drive.friction_speed(qd, z) == 0.0 &&
                 static_cast<double>(mode) * drive.friction_acceleration(x[i], qd, m.solution.qdd[k], z) <
                     -kNoAcceleration) {
        drive.set_mode(FrictionMode::stuck, qd, z);
        again = true;
      }
    }
    if (again || furthest < 0) continue;
    const auto k = static_cast<size_t>(furthest);
    m.drive(furthest).set_mode(direction > 0.0 ? FrictionMode::forward : FrictionMode::backward,
                               x[n + furthest], x + m.z_begin[k]);
    ++releases[k];
    again = true;
  }
  for (int i = 0; i < n; ++i) {
    if (m.drive(i).has_modes() && m.drive(i).mode(m.drive_states(x, i)) != before[static_cast<size_t>(i)])
      changed = true;
  }
  return changed;
}

}  // namespace takt
