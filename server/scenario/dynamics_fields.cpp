#include "server/scenario/dynamics_fields.h"

namespace takt {

namespace {

// A number for all joints, or a list with one for each; how many joints there are is checked when the URDF is
// known.
void read_values(YamlFields& fields, const char* key, const NumberRange& range, JointValues& values) {
  const YAML::Node node = fields.optional(key);
  if (!node.IsDefined()) return;
  if (node.IsSequence())
    values.values = fields.numbers(key, 0, range);
  else
    values.values = {fields.number(key, range)};
}

void require(YamlFields& fields, const char* key, const JointValues& values, const char* what) {
  if (!values.given()) fields.required(key, what);
}

}  // namespace

ScenarioDrives read_drives(YamlFields fields) {
  using Model = ScenarioDrives::Model;
  using Friction = ScenarioDrives::Friction;
  ScenarioDrives drives;
  const std::string model = fields.choice("model", {"ideal", "simplified", "detailed"}, "simplified");
  drives.model = model == "ideal" ? Model::ideal : model == "detailed" ? Model::detailed : Model::simplified;
  if (drives.model != Model::detailed) {
    read_values(fields, "bandwidth_rad_per_s", positive("rad/s"), drives.bandwidth_rad_per_s);
  }
  if (drives.model != Model::ideal) {
    read_values(fields, "gear_ratio", {}, drives.gear_ratio);
    read_values(fields, "motor_inertia_kg_m2", positive("kg m^2"), drives.motor_inertia_kg_m2);
    for (const double ratio : drives.gear_ratio.values)
      if (ratio == 0.0) fields.fail("gear_ratio", "0", "a number other than 0: motor speed / joint speed");
  }
  if (drives.model == Model::detailed) {
    read_values(fields, "torque_constant_N_m_per_A", positive("N m/A"), drives.torque_constant_N_m_per_A);
    read_values(fields, "current_loop_rad_per_s", positive("rad/s"), drives.current_loop_rad_per_s);
    read_values(fields, "current_loop_damping", positive(""), drives.current_loop_damping);
    read_values(fields, "armature_resistance_ohm", positive("ohm"), drives.armature_resistance_ohm);
    read_values(fields, "power_stage_gain", positive(""), drives.power_stage_gain);
    read_values(fields, "gear_stiffness_N_m_per_rad", not_negative("N m/rad, motor side, 0: rigid"),
                drives.gear_stiffness_N_m_per_rad);
    read_values(fields, "gear_damping_N_m_s_per_rad", not_negative("N m s/rad, motor side"),
                drives.gear_damping_N_m_s_per_rad);
    const std::string friction = fields.choice("friction", {"stiction", "regularised", "none"}, "stiction");
    drives.friction = friction == "none"          ? Friction::none
                      : friction == "regularised" ? Friction::regularised
                                                  : Friction::stiction;
    read_values(fields, "friction_zero_speed_N_m", not_negative("N m"), drives.friction_zero_speed_N_m);
    read_values(fields, "friction_slope_N_m_s_per_rad", not_negative("N m s/rad"),
                drives.friction_slope_N_m_s_per_rad);
    read_values(fields, "breakaway_factor", {.lower = 1.0}, drives.breakaway_factor);
    read_values(fields, "friction_regularisation_rad_per_s", positive("rad/s"),
                drives.friction_regularisation_rad_per_s);
    const std::string encoder = fields.choice("position_encoder", {"motor", "joint"}, "motor");
    drives.position_encoder =
        encoder == "joint" ? ScenarioDrives::PositionEncoder::joint : ScenarioDrives::PositionEncoder::motor;
    read_values(fields, "position_gain_per_s", positive("1/s"), drives.position_gain_per_s);
    read_values(fields, "speed_gain_A_s_per_rad", positive("A s/rad"), drives.speed_gain_A_s_per_rad);
    read_values(fields, "speed_integral_time_s", positive("s"), drives.speed_integral_time_s);
    require(fields, "gear_ratio", drives.gear_ratio, "a number, or one for each joint");
    require(fields, "motor_inertia_kg_m2", drives.motor_inertia_kg_m2, "a number, or one for each joint");
    require(fields, "torque_constant_N_m_per_A", drives.torque_constant_N_m_per_A,
            "a number, or one for each joint");
    require(fields, "current_loop_rad_per_s", drives.current_loop_rad_per_s,
            "a number, or one for each joint");
    require(fields, "current_loop_damping", drives.current_loop_damping, "a number, or one for each joint");
  }
  fields.finish();
  return drives;
}

ScenarioCommandDeadline read_command_deadline(YamlFields& fields, double command_period_s,
                                              std::size_t joints) {
  ScenarioCommandDeadline deadline;
  deadline.command_deadline_s = fields.number_or("command_deadline_s", positive("s"), 0.0);
  deadline.stops = fields.choice("safe_action", {"hold", "stop"}, "hold") == "stop";
  read_values(fields, "max_acceleration_rad_per_s2", positive("rad/s^2"),
              deadline.max_acceleration_rad_per_s2);
  const std::size_t count = deadline.max_acceleration_rad_per_s2.values.size();
  if (count > 1 && count != joints) {
    fields.fail("max_acceleration_rad_per_s2", std::to_string(count) + " values",
                "one, or " + std::to_string(joints) + ", one for each joint");
  }
  if (deadline.stops && count == 0)
    require(fields, "max_acceleration_rad_per_s2", deadline.max_acceleration_rad_per_s2,
            "needed for safe_action: stop, in rad/s^2");
  if (deadline.command_deadline_s > 0.0 && deadline.command_deadline_s < command_period_s) {
    fields.fail("command_deadline_s", std::to_string(deadline.command_deadline_s) + " s",
                "at least command_period_s, " + std::to_string(command_period_s) + " s");
  }
  return deadline;
}

ScenarioPower read_power(YamlFields fields) {
  ScenarioPower power;
  power.idle_W = fields.number_or("idle_W", not_negative("W"), power.idle_W);
  power.loss_factor = fields.number_or("loss_factor", {.lower = 1.0}, power.loss_factor);
  power.recovers = fields.boolean_or("recovers", power.recovers);
  fields.finish();
  return power;
}

ScenarioTrajectory read_trajectory(YamlFields fields, std::size_t joints) {
  ScenarioTrajectory trajectory;
  fields.choice("profile", {"trapezoid"}, "trapezoid");
  trajectory.end_rad = fields.angles("end", joints);
  trajectory.max_velocity_rad_per_s = fields.numbers("max_velocity_rad_per_s", joints, positive("rad/s"));
  trajectory.max_acceleration_rad_per_s2 =
      fields.numbers("max_acceleration_rad_per_s2", joints, positive("rad/s^2"));
  fields.finish();
  return trajectory;
}

}  // namespace takt
