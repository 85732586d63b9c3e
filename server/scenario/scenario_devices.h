#pragma once
// What a scenario says about heat and about devices (furnaces). Units are in the names; temperatures in
// degrees Celsius.
#include <optional>
#include <string>

#include "plant_models/spatial.h"

namespace takt {

/// A Part that has a temperature.
struct ScenarioHeat {
  double specific_heat_J_per_kg_K = 0.0;
  double temperature_degC = 20.0;    ///< at the start
  double emissivity = 0.0;           ///< towards a furnace around it
  std::optional<double> surface_m2;  ///< exposed; unset: that of the mesh
  double cooling_W_per_m2_K = 0.0;   ///< to the surroundings; 0: it keeps its temperature
};

/// A Part that is screwed in (server/simulation/step/screw_joints.h).
struct ScenarioThread {
  std::string in;  ///< a Part or Ground
  std::string place;
  double pitch_m = 0.0, length_m = 0.0, driving_torque_Nm = 0.0;
  Vec3 axis_B = Vec3::UnitZ();     ///< along which it comes out, in the Part's frame
  Vec3 p_BH = Vec3::Zero();        ///< `head_m`: where a screwdriver meets it
  double stiffness_N_per_m = 1e6;  ///< at level of detail 3
};

/// A bit at the tool centre point of a Gripper.
struct ScenarioScrewdriver {
  std::string name;
  std::string gripper;
  double max_speed_rad_per_s = 0.0, max_torque_Nm = 0.0;
  double reach_m = 0.01;  ///< from the tool centre point to the head
};

/// A chamber furnace (plant_models/thermal/furnace.h).
struct ScenarioFurnace {
  std::string name;
  std::string ground;  ///< whose frame `chamber` is given in; empty: the world
  Pose X_GV;           ///< centre of the chamber
  Vec3 chamber_size_m = Vec3::Zero();
  double mass_kg = 0.0, specific_heat_J_per_kg_K = 0.0;
  std::optional<double> air_capacity_J_per_K;                ///< unset: air at 20 degC in the chamber
  std::optional<double> inner_surface_m2, outer_surface_m2;  ///< unset: that of the chamber
  double convection_W_per_m2_K = 0.0, loss_W_per_m2_K = 0.0;
  double set_temperature_degC = 0.0;
  double max_set_temperature_degC = 1200.0;  ///< of what may be commanded
  std::optional<double> temperature_degC;    ///< at the start; unset: the set temperature
  double gain_W_per_K = 0.0, integral_time_s = 1.0, max_power_W = 0.0;
};

}  // namespace takt
