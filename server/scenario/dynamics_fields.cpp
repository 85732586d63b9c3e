// Drives and power of a robot in scenario files.
#include "server/fields/fields.h"
#include "server/scenario/scenario_dynamics.h"

namespace takt {

void describe(Fields& f, ScenarioDrives& s) {
  using Model = ScenarioDrives::Model;
  using Friction = ScenarioDrives::Friction;
  using Encoder = ScenarioDrives::PositionEncoder;
  const Choice<Model> models{
      {{"ideal", Model::ideal}, {"simplified", Model::simplified}, {"detailed", Model::detailed}}};
  const auto values = [&f](const char* key, JointValues& member, const NumberRange& range, const char* doc,
                           unsigned flags = 0) { f.field(key, member.values, ForJoints{range}, doc, flags); };
  f.field("model", s.model, models,
          "Ideal: servo without dynamics of its own; simplified: gear and cascade control, tuned by its "
          "bandwidth; "
          "detailed: motor, elastic gear, friction, cascade control.");
  f.when("model", models, s.model, {Model::ideal, Model::simplified}, [&] {
    values("bandwidth_rad_per_s", s.bandwidth_rad_per_s, positive("rad/s"), "Bandwidth of position control.");
  });
  const unsigned required = s.model == Model::detailed ? kRequired : 0U;
  f.when("model", models, s.model, {Model::simplified, Model::detailed}, [&] {
    values("gear_ratio", s.gear_ratio, {},
           "Motor speed over joint speed, not 0. Needed by the detailed model.", required);
    f.required_for("model", {"detailed"});
    for (const double ratio : s.gear_ratio.values)
      f.check(ratio != 0.0, "gear_ratio", "0", "a number other than 0: motor speed / joint speed");
    values("motor_inertia_kg_m2", s.motor_inertia_kg_m2, positive("kg m^2"),
           "Inertia of the rotor, motor side. Needed by the detailed model.", required);
    f.required_for("model", {"detailed"});
  });
  f.when("model", models, s.model, {Model::detailed}, [&] {
    values("torque_constant_N_m_per_A", s.torque_constant_N_m_per_A, positive("N m/A"),
           "Torque of the motor per current.", kRequired);
    values("current_loop_rad_per_s", s.current_loop_rad_per_s, positive("rad/s"),
           "Natural frequency of the closed current loop.", kRequired);
    values("current_loop_damping", s.current_loop_damping, positive(""),
           "Damping ratio of the closed current loop.", kRequired);
    values("armature_resistance_ohm", s.armature_resistance_ohm, positive("ohm"),
           "Resistance of the armature.");
    values("power_stage_gain", s.power_stage_gain, positive(""), "Gain of the power stage.");
    values("gear_stiffness_N_m_per_rad", s.gear_stiffness_N_m_per_rad,
           not_negative("N m/rad, motor side, 0: rigid"), "Stiffness of the gear, motor side; 0: rigid.");
    values("gear_damping_N_m_s_per_rad", s.gear_damping_N_m_s_per_rad, not_negative("N m s/rad, motor side"),
           "Damping of the gear, motor side.");
    f.field("friction", s.friction,
            Choice<Friction>{{{"stiction", Friction::stiction},
                              {"regularised", Friction::regularised},
                              {"none", Friction::none}}},
            "Law of friction: on the motor side of an elastic gear, on the joint side of a rigid one.");
    values("friction_zero_speed_N_m", s.friction_zero_speed_N_m, not_negative("N m"),
           "Sliding friction at speed 0.");
    values("friction_slope_N_m_s_per_rad", s.friction_slope_N_m_s_per_rad, not_negative("N m s/rad"),
           "Growth of friction with speed.");
    values("breakaway_factor", s.breakaway_factor, {.lower = 1.0},
           "Largest friction at rest over sliding friction at speed 0.");
    values("friction_regularisation_rad_per_s", s.friction_regularisation_rad_per_s, positive("rad/s"),
           "Speed up to which regularised friction grows from 0.");
    f.field("position_encoder", s.position_encoder,
            Choice<Encoder>{{{"motor", Encoder::motor}, {"joint", Encoder::joint}}},
            "Where the position is measured: at the motor, or by a second encoder at the joint.");
    values("position_gain_per_s", s.position_gain_per_s, positive("1/s"), "Gain of the position controller.");
    values("speed_gain_A_s_per_rad", s.speed_gain_A_s_per_rad, positive("A s/rad"),
           "Gain of the speed controller.");
    values("speed_integral_time_s", s.speed_integral_time_s, positive("s"),
           "Integral time of the speed controller.");
  });
}

void describe(Fields& f, ScenarioPower& s) {
  f.field("idle_W", s.idle_W, not_negative("W"), "Power that is always drawn: control cabinet, brakes.");
  f.field("loss_factor", s.loss_factor, NumberRange{.lower = 1.0},
          "Electrical over mechanical power of an axis without motor model.");
  f.field("regenerative", s.regenerative, Flag{}, "A braking axis feeds power back to the mains.");
}

}  // namespace takt
