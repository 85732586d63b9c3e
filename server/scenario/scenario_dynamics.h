#pragma once
// Dynamics of a robot in a scenario (level of detail 2 and above): its drives, its power, its own trajectory.
// Plain structs.
#include <string>
#include <vector>

#include "takt_enumerations.h"

namespace takt {

/// One value for all joints, or one for each.
struct JointValues {
  std::vector<double> values;
  bool given() const { return !values.empty(); }
  double at(std::size_t joint) const { return values[values.size() == 1 ? 0 : joint]; }
};

class Fields;

struct ScenarioDrives {
  enum class Model { ideal, simplified, detailed } model = Model::simplified;
  // ideal, simplified
  JointValues bandwidth_rad_per_s{{60.0}};
  // simplified, detailed
  JointValues gear_ratio;           ///< motor / joint
  JointValues motor_inertia_kg_m2;  ///< rotor
  // detailed: motor with current control
  JointValues torque_constant_N_m_per_A, current_loop_rad_per_s, current_loop_damping;
  JointValues armature_resistance_ohm{{250.0}}, power_stage_gain{{5.0}};
  // gear; stiffness 0: rigid
  JointValues gear_stiffness_N_m_per_rad{{0.0}}, gear_damping_N_m_s_per_rad{{0.0}};
  // friction, on the motor side of an elastic gear, on the joint side of a rigid one
  enum class Friction { stiction, regularised, none } friction = Friction::stiction;
  JointValues friction_zero_speed_N_m{{0.0}}, friction_slope_N_m_s_per_rad{{0.0}}, breakaway_factor{{1.0}};
  JointValues friction_regularisation_rad_per_s{{0.01}};
  // controller; where its position is measured: at the motor, or by a second encoder at the joint
  enum class PositionEncoder { motor, joint } position_encoder = PositionEncoder::motor;
  JointValues position_gain_per_s{{5.0}}, speed_gain_A_s_per_rad{{0.5}}, speed_integral_time_s{{0.05}};
};

/// Reaction of a robot to missing set-points.
struct ScenarioCommandDeadline {
  /// Longest silence of a stream of set-points (simulated); 0: without deadline.
  double command_deadline_s = 0.0;
  SafeAction safe_action = SafeAction::hold;
  JointValues max_acceleration_rad_per_s2;  ///< of that stop; m for prismatic joints
};

struct ScenarioPower {
  double idle_W = 0.0;
  double loss_factor = 1.3;  ///< thesis 5.5.2
  bool regenerative = false;
};

/// A synchronous point-to-point motion with trapezoidal speed, followed from time 0 on without a controller.
/// It starts at initial_joints_rad.
struct ScenarioTrajectory {
  std::vector<double> end_rad, max_velocity_rad_per_s, max_acceleration_rad_per_s2;
};

void describe(Fields& f, ScenarioDrives& s);
void describe(Fields& f, ScenarioPower& s);

}  // namespace takt
