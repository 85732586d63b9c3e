#pragma once
// A chamber furnace: its lined body, its air, a heater with PI control, loss to the surroundings, and heat
// exchange with every Part inside that has a temperature (heated_part.h). Thesis section 5.5.2 and Fig. 5.18;
// there the user gives the times of insertion and removal, here the positions of the Parts decide.
//
//   C_F dT_F/dt = Q - h_loss A_out (T_F - T_env) - h A_in (T_F - T_A) - sum over Parts (q_conv + q_rad)
//   C_A dT_A/dt = h A_in (T_F - T_A)
//   q_conv = h A_P (T_F - T_P),  q_rad = sigma eps A_P (T_F^4 - T_P^4)
//   Q = clip(k_p e + I, 0, Q_max),  dI/dt = k_p / T_i e,  e = T_set - T_F
// (I is held while Q is at a limit and e would push it further.) Opening the door exchanges the air at once:
// T_A becomes T_env. A Part that enters or leaves while the door is closed opens it for that instant.
#include <optional>
#include <string>
#include <vector>

#include "server/devices/device_type.h"

namespace takt {

/// The keys of a furnace in a scenario.
struct ScenarioFurnace {
  std::string ground;  ///< frame of `chamber`; empty: the world
  Pose X_GV;           ///< centre of the chamber
  Vec3 chamber_size_m = Vec3::Zero();
  double mass_kg = 0.0, specific_heat_J_per_kg_K = 0.0;
  std::optional<double> air_capacity_J_per_K, inner_surface_m2, outer_surface_m2;
  double convection_W_per_m2_K = 0.0, loss_W_per_m2_K = 0.0;
  double set_temperature_degC = 0.0;
  std::string place_of_set_temperature;
  double max_set_temperature_degC = 1200.0;
  std::optional<double> temperature_degC;
  double gain_W_per_K = 0.0, integral_time_s = 1.0, max_power_W = 0.0;
};
DeviceType furnace_type();

struct FurnaceParameters {
  double capacity_J_per_K = 0.0;      ///< C_F
  double air_capacity_J_per_K = 0.0;  ///< C_A
  double inner_surface_m2 = 0.0, outer_surface_m2 = 0.0;
  double convection_W_per_m2_K = 0.0;  ///< h, to the air inside and to Parts
  double loss_W_per_m2_K = 0.0;        ///< h_loss
  double environment_K = 293.15;
  double initial_K = 293.15;  ///< of body and air
  double set_K = 293.15;      ///< set point until another one is commanded
  double gain_W_per_K = 0.0, integral_time_s = 1.0, max_power_W = 0.0;
  Pose X_WV;                   ///< centre of the chamber in the world
  Vec3 size_m = Vec3::Zero();  ///< of the chamber, along the axes of V
  /// Parts that have a temperature. A Part is inside while its centre of mass is.
  using Candidate = DeviceBuilder::Heated;
  std::vector<Candidate> parts;
};

class Furnace final : public DeviceModel {
 public:
  enum Signal : int {
    set_temperature,
    door,
    temperature,
    air_temperature,
    power,
    energy,
    loss,
    heat_to_parts,
    energy_lost,
    energy_to_parts,
    energy_of_air,
    parts_inside,
    kSignals
  };
  enum State : int { body_K, air_K, integral_W, drawn_J, lost_J, to_parts_J, kStates };

  explicit Furnace(const FurnaceParameters& parameters);

  int state_count() const override { return kStates; }
  void initial_state(double* x) const override;
  void write_motion(double t, const double* x, CellMotion& motion) const override;
  void derivatives(double t, const double* x, const CellMotion& motion, std::span<const Wrench> wrenches,
                   double* xdot) const override;
  void state_scales(double* scales) const override;
  bool decide(double t, double* x, const CellMotion& motion) override;
  void reset() override;
  void set_signal(double t, int signal, double value) override;
  void read_signals(double t, const double* x, const CellMotion& motion,
                    std::span<double> signals) const override;
  void save(StateWriter& out) const override;
  void load(StateReader& in) override;

 private:
  double heater_W(const double* x) const;
  double loss_W(const double* x) const;
  double flow_W(const FurnaceParameters::Candidate& part, double furnace_K, double part_K) const;
  double flow_to_parts_W(const double* x, const CellMotion& motion) const;
  bool contains(const Vec3& p_W, double margin_m) const;

  FurnaceParameters p_;
  std::vector<char> inside_;  ///< by candidate
  /// False: the first decision only lists the Parts inside at the start.
  bool looked_ = false;
  double set_degC_ = 0.0;                    ///< as commanded, to the bit
  bool door_open_ = false, opened_ = false;  ///< `opened_`: since the last decision
  double air_J_ = 0.0;                       ///< carried off by exchanged air
};

}  // namespace takt
