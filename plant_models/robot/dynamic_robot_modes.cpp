// True friction of a robot's drives: zero-crossing functions and the switching between accepted steps.
#include "plant_models/robot/dynamic_robot_impl.h"

namespace takt {

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

// Sliding that came to rest or reversed sticks first. Then: solve with the present stuck set, release those
// beyond break-away, and repeat, as stuck joints are coupled through the arm. A released one that would move
// against its direction, because others were released as well, sticks again and stays so: each drive changes
// at most twice, so the loop ends.
bool DynamicRobot::switch_modes(double t, double* x, const CellMotion& motion,
                                std::span<const Wrench> wrenches) {
  Impl& m = *impl_;
  if (m.indicators == 0) return false;
  const int n = m.joints;
  std::array<FrictionMode, kMaxJoints> before{};
  std::array<bool, kMaxJoints> keeps{};
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
    for (int i = 0; i < n; ++i) {
      const auto k = static_cast<size_t>(i);
      const Drive& drive = m.drive(i);
      if (!drive.has_modes() || keeps[k]) continue;
      double* z = x + m.z_begin[k];
      double& qd = x[n + i];
      const FrictionMode mode = drive.mode(z);
      if (mode == FrictionMode::stuck) {
        const double torque = drive.stuck_torque(x[i], qd, m.solution.holding[k], z);
        if (std::abs(torque) <= drive.break_away_torque()) continue;
        drive.set_mode(torque > 0.0 ? FrictionMode::forward : FrictionMode::backward, qd, z);
        again = true;
      } else if (drive.friction_speed(qd, z) == 0.0 &&
                 static_cast<double>(mode) * drive.friction_acceleration(x[i], qd, m.solution.qdd[k], z) <=
                     0.0) {
        drive.set_mode(FrictionMode::stuck, qd, z);
        keeps[k] = true;
        again = true;
      }
    }
  }
  for (int i = 0; i < n; ++i) {
    if (m.drive(i).has_modes() && m.drive(i).mode(m.drive_states(x, i)) != before[static_cast<size_t>(i)])
      changed = true;
  }
  return changed;
}

}  // namespace takt
