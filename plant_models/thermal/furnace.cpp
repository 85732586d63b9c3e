#include "plant_models/thermal/furnace.h"

#include <algorithm>
#include <cmath>

#include "plant_models/state_bytes.h"
#include "plant_models/thermal/heated_part.h"

namespace takt {

namespace {
constexpr double kStefanBoltzmann = 5.670374419e-8;  // W/(m^2 K^4)
// A Part that rests just at the opening must not come and go with every tremor.
constexpr double kHysteresis_m = 1e-3;

double fourth(double x) {
  return x * x * x * x;
}
}  // namespace

Furnace::Furnace(const FurnaceParameters& parameters) : p_(parameters) {
  reset();
}

void Furnace::reset() {
  inside_.assign(p_.parts.size(), 0);
  looked_ = door_open_ = opened_ = false;
  set_degC_ = p_.set_K - kZeroCelsius_K;
  air_J_ = 0.0;
}

void Furnace::initial_state(double* x) const {
  std::fill(x, x + kStates, 0.0);
  x[body_K] = x[air_K] = p_.initial_K;
  // As in a furnace that has stood at its set point for long.
  x[integral_W] = p_.loss_W_per_m2_K * p_.outer_surface_m2 * (p_.set_K - p_.environment_K);
}

double Furnace::heater_W(const double* x) const {
  return std::clamp(p_.gain_W_per_K * (set_degC_ + kZeroCelsius_K - x[body_K]) + x[integral_W], 0.0,
                    p_.max_power_W);
}

double Furnace::loss_W(const double* x) const {
  return p_.loss_W_per_m2_K * p_.outer_surface_m2 * (x[body_K] - p_.environment_K);
}

double Furnace::flow_W(const FurnaceParameters::Candidate& part, double furnace_K, double part_K) const {
  return part.surface_m2 * (p_.convection_W_per_m2_K * (furnace_K - part_K) +
                            kStefanBoltzmann * part.emissivity * (fourth(furnace_K) - fourth(part_K)));
}

void Furnace::write_motion(double, const double* x, CellMotion& motion) const {
  for (std::size_t i = 0; i < inside_.size(); ++i) {
    if (inside_[i] == 0) continue;
    BodyHeat& heat = motion.heat[static_cast<std::size_t>(p_.parts[i].body)];
    heat.flow_W += flow_W(p_.parts[i], x[body_K], heat.temperature_K);
    heat.enclosed = true;
  }
}

double Furnace::flow_to_parts_W(const double* x, const CellMotion& motion) const {
  double flow = 0.0;
  for (std::size_t i = 0; i < inside_.size(); ++i)
    if (inside_[i] != 0)
      flow += flow_W(p_.parts[i], x[body_K],
                     motion.heat[static_cast<std::size_t>(p_.parts[i].body)].temperature_K);
  return flow;
}

void Furnace::derivatives(double, const double* x, const CellMotion& motion, std::span<const Wrench>,
                          double* xdot) const {
  const double heater = heater_W(x), outwards = loss_W(x), to_parts = flow_to_parts_W(x, motion);
  const double air = p_.convection_W_per_m2_K * p_.inner_surface_m2 * (x[body_K] - x[air_K]);
  const double error = set_degC_ + kZeroCelsius_K - x[body_K];
  const bool held = (heater >= p_.max_power_W && error > 0.0) || (heater <= 0.0 && error < 0.0);
  xdot[body_K] = (heater - outwards - air - to_parts) / p_.capacity_J_per_K;
  xdot[air_K] = air / p_.air_capacity_J_per_K;
  xdot[integral_W] = held ? 0.0 : p_.gain_W_per_K / p_.integral_time_s * error;
  xdot[drawn_J] = heater;
  xdot[lost_J] = outwards;
  xdot[to_parts_J] = to_parts;
}

void Furnace::state_scales(double* scales) const {
  scales[body_K] = scales[air_K] = 1.0;
  scales[integral_W] = 0.1 * p_.max_power_W;
  scales[drawn_J] = scales[lost_J] = scales[to_parts_J] = p_.capacity_J_per_K;
}

bool Furnace::contains(const Vec3& p_W, double margin_m) const {
  const Vec3 p_V = p_.X_WV.R.transpose() * (p_W - p_.X_WV.p);
  return ((0.5 * p_.size_m - p_V.cwiseAbs()).array() > margin_m).all();
}

bool Furnace::decide(double, double* x, const CellMotion& motion) {
  bool passed = false;
  for (std::size_t i = 0; i < inside_.size(); ++i) {
    const Vec3& p = motion.bodies[static_cast<std::size_t>(p_.parts[i].body)].p_WBcm;
    const char now = contains(p, inside_[i] != 0 ? -kHysteresis_m : kHysteresis_m) ? 1 : 0;
    if (now == inside_[i]) continue;
    inside_[i] = now;
    passed = true;
  }
  const bool exchanged = opened_ || (passed && looked_ && !door_open_);
  if (exchanged) {
    air_J_ += p_.air_capacity_J_per_K * (x[air_K] - p_.environment_K);
    x[air_K] = p_.environment_K;
  }
  opened_ = false;
  looked_ = true;
  return passed || exchanged;
}

void Furnace::set_signal(double, int signal, double value) {
  if (signal == set_temperature) set_degC_ = value;
  if (signal != door) return;
  const bool open = value >= 0.5;
  opened_ = opened_ || (open && !door_open_);
  door_open_ = open;
}

void Furnace::read_signals(double, const double* x, const CellMotion& motion,
                           std::span<double> signals) const {
  signals[set_temperature] = set_degC_;
  signals[door] = door_open_ ? 1.0 : 0.0;
  signals[temperature] = x[body_K] - kZeroCelsius_K;
  signals[air_temperature] = x[air_K] - kZeroCelsius_K;
  signals[power] = heater_W(x);
  signals[energy] = x[drawn_J];
  signals[loss] = loss_W(x);
  signals[heat_to_parts] = flow_to_parts_W(x, motion);
  signals[energy_lost] = x[lost_J];
  signals[energy_to_parts] = x[to_parts_J];
  signals[energy_of_air] = air_J_;
  signals[parts_inside] = static_cast<double>(std::count(inside_.begin(), inside_.end(), 1));
}

void Furnace::save(StateWriter& out) const {
  for (const char inside : inside_) out.put(static_cast<std::uint8_t>(inside));
  out.put(looked_), out.put(door_open_), out.put(opened_), out.put(set_degC_), out.put(air_J_);
}

void Furnace::load(StateReader& in) {
  for (char& inside : inside_) inside = in.flag("'is in the furnace'") ? 1 : 0;
  looked_ = in.flag("'looked'");
  door_open_ = in.flag("'door is open'");
  opened_ = in.flag("'door was opened'");
  set_degC_ = in.number(-300.0, 1e4, "the set temperature of a furnace");
  air_J_ = in.number("the energy of exchanged air");
}

}  // namespace takt
