// Robots whose joints are commanded torques.
#include <optional>
#include <span>

#include "server/simulation/step/simulation_impl.h"

namespace takt {

bool Simulation::Impl::refuses_torques(std::size_t robot) {
  const DynamicRobot* dynamic = plant.dynamic(robot);
  int joint = -1;
  if (dynamic != nullptr) {
    const int joints = model->description.robots[robot].arm.joint_count();
    for (int j = joints; j-- > 0;)
      if (!dynamic->takes_torques(j)) joint = j;
    if (joint < 0) return false;
  }
  if (torques_refused[robot] == 0) {
    MotionNotice notice{.kind = MotionNotice::Kind::torques_refused};
    notice.time_s = time(), notice.step = step_index, notice.robot = static_cast<int>(robot);
    notice.joint = joint;
    motion_notices.push_back(notice);
  }
  torques_refused[robot] = 1;
  return true;
}

void Simulation::Impl::follow_torques() {
  for (std::size_t r = 0; r < reference_motions.size(); ++r) {
    const KinematicRobot& robot = plant.robots()[r];
    torques_before[r].reset();
    if (!robot.torque_mode()) continue;
    torques_before[r] = robot.feed_forward();
    const std::span<const double> x = plant.segment(r);
    reference_motions[r].follow(time(), x.data(), x.data() + plant.dynamic(r)->joint_count());
  }
}

void Simulation::Impl::set_torques() {
  for (std::size_t r = 0; r < reference_motions.size(); ++r) {
    const bool now = plant.robots()[r].torque_mode(), before = torques_before[r].has_value();
    if (!now && !before) continue;
    const DynamicRobot& dynamic = *plant.dynamic(r);
    const std::span<double> x = plant.segment(r);
    if (now) {
      reference_motions[r].add_torques(dynamic.weight_torques(x.data()));
    } else {
      JointArray torques = *torques_before[r];
      for (std::size_t j = 0; j < torques.size(); ++j) torques[j] -= plant.robots()[r].feed_forward()[j];
      dynamic.begin_position_control(torques, x.data());
    }
    if (now == before) continue;
    dynamic.control_changed();
    input_changed();
  }
}

}  // namespace takt
