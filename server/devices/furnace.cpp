#include "server/devices/furnace.h"

#include <algorithm>

#include "plant_models/state_bytes.h"
#include "server/devices/heated_part.h"

namespace takt {

namespace {
constexpr double kStefanBoltzmann = 5.670374419e-8;  // W/(m^2 K^4)
// Air at 20 degC and 1013 hPa.
constexpr double kAirHeat_J_per_m3_K = 1.204 * 1005.0;
// A Part that rests just at the opening must not come and go with every tremor.
constexpr double kHysteresis_m = 1e-3;

constexpr KindSignal kFurnaceSignals[] = {
    commanded("set_temperature", "degC", "surroundings to `max_set_temperature_degC`",
              "set point of the controller"),
    commanded("door", "", 0.0, 1.0,
              "0.5 and more opens the door: the air inside is exchanged for that of the surroundings"),
    reported("temperature", "degC", "of the lined body"),
    reported("air_temperature", "degC", "of the air inside"),
    reported("power", "W", "of the heater"),
    reported("energy", "J", "drawn by the heater since the start"),
    reported("loss", "W", "through the walls to the surroundings"),
    reported("heat_to_parts", "W", "to the parts inside"),
    reported("energy_lost", "J", "through the walls since the start"),
    reported("energy_to_parts", "J", "to parts since the start"),
    reported("energy_of_air", "J", "lost with exchanged air since the start"),
    reported_count("parts_inside", "parts with `heat` whose centre of mass is in the chamber")};

double fourth(double x) {
  return x * x * x * x;
}
}  // namespace

void describe(Fields& f, ScenarioFurnace& s) {
  f.field("ground", s.ground, f.name_of({"grounds"}, "a ground"),
          "Ground in whose frame the chamber is given; without it: the world.");
  f.section(
      "chamber", "The space inside.",
      [&] {
        f.pose("center", s.X_GV, "Pose of the centre.");
        f.field("size_m", s.chamber_size_m, Vector3{positive("m")}, "Lengths along the axes of `center`.",
                kRequired);
        f.field("inner_surface_m2", s.inner_surface_m2, positive("m^2"),
                "Surface towards the air inside; without it: that of the chamber.");
        f.field("outer_surface_m2", s.outer_surface_m2, positive("m^2"),
                "Surface towards the surroundings; without it: that of the chamber.");
        f.field("air_capacity_J_per_K", s.air_capacity_J_per_K, positive("J/K"),
                "Heat capacity of the air inside; without it: by the volume, at 20 degC.");
      },
      kRequired);
  f.field("mass_kg", s.mass_kg, positive("kg"), "Mass of the lined body.", kRequired);
  f.field("specific_heat_J_per_kg_K", s.specific_heat_J_per_kg_K, positive("J/(kg K)"),
          "Specific heat of the lined body.", kRequired);
  f.field("convection_W_per_m2_K", s.convection_W_per_m2_K, not_negative("W/(m^2 K)"),
          "Heat transfer to the air inside and to parts.", kRequired);
  f.field("loss_W_per_m2_K", s.loss_W_per_m2_K, not_negative("W/(m^2 K)"),
          "Heat transfer to the surroundings.", kRequired);
  f.field("max_set_temperature_degC", s.max_set_temperature_degC, kTemperature_degC,
          "Largest temperature that may be commanded.");
  f.field("set_temperature_degC", s.set_temperature_degC, kTemperature_degC,
          "Set point until another one is commanded; not below the surroundings.", kRequired);
  f.check(s.set_temperature_degC <= s.max_set_temperature_degC, "set_temperature_degC",
          rounded_number(s.set_temperature_degC),
          "a number <= " + rounded_number(s.max_set_temperature_degC) + " degC");
  s.place_of_set_temperature = f.place("set_temperature_degC");
  f.field("temperature_degC", s.temperature_degC, kTemperature_degC,
          "Temperature at the start; without it: the set point.");
  f.section(
      "control", "PI controller of the heater.",
      [&] {
        f.field("gain_W_per_K", s.gain_W_per_K, positive("W/K"), "Gain.", kRequired);
        f.field("integral_time_s", s.integral_time_s, positive("s"), "Integral time.", kRequired);
        f.field("max_power_W", s.max_power_W, positive("W"), "Largest power of the heater.", kRequired);
      },
      kRequired);
}

void build(const ScenarioFurnace& s, DeviceBuilder& b) {
  if (s.set_temperature_degC < b.surroundings_degC)
    throw ScenarioError(s.place_of_set_temperature + ": found " + rounded_number(s.set_temperature_degC) +
                        "; allowed: a number >= " + rounded_number(b.surroundings_degC) +
                        " degC, the surroundings");
  const Vec3& size = s.chamber_size_m;
  const double surface = 2.0 * (size.x() * size.y() + size.y() * size.z() + size.z() * size.x());
  FurnaceParameters p;
  p.capacity_J_per_K = s.mass_kg * s.specific_heat_J_per_kg_K;
  p.air_capacity_J_per_K = s.air_capacity_J_per_K.value_or(kAirHeat_J_per_m3_K * size.prod());
  p.inner_surface_m2 = s.inner_surface_m2.value_or(surface);
  p.outer_surface_m2 = s.outer_surface_m2.value_or(surface);
  p.convection_W_per_m2_K = s.convection_W_per_m2_K;
  p.loss_W_per_m2_K = s.loss_W_per_m2_K;
  p.environment_K = kelvin(b.surroundings_degC);
  p.set_K = kelvin(s.set_temperature_degC);
  p.initial_K = kelvin(s.temperature_degC.value_or(s.set_temperature_degC));
  p.gain_W_per_K = s.gain_W_per_K;
  p.integral_time_s = s.integral_time_s;
  p.max_power_W = s.max_power_W;
  p.X_WV = s.ground.empty() ? s.X_GV : b.pose_of_ground(s.ground) * s.X_GV;
  p.size_m = size;
  p.parts = b.heated;
  b.add<Furnace>(p, described(kFurnaceSignals, {{b.surroundings_degC, s.max_set_temperature_degC}}));
}

DeviceType furnace_type() {
  return device_type<ScenarioFurnace>(DeviceType::Owner::cell, "furnaces", "Chamber furnaces.",
                                      "Heats the parts with `heat` whose centre of mass is in its chamber.",
                                      true, kFurnaceSignals);
}

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
