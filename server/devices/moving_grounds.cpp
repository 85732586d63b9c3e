#include "server/devices/moving_grounds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "idl/common/text.h"
#include "plant_models/state_bytes.h"
#include "server/devices/axis_loads.h"
#include "server/devices/sliding_parts.h"

namespace takt {

namespace {

/// Over which the drive of an axis takes the mean of its force: peaks of contact last a few ms.
constexpr double kPeak_s = 0.02;
/// Of a piston with no force left (m/s^2): its speed stays.
constexpr double kLeastGain = 1e-6;
/// For so long a piston stands against its load before it counts as overloaded.
constexpr double kStood_s = 0.1;

/// The sections whose devices carry Grounds.
constexpr const char* kCarried = "carried grounds";

void describe_moved(Fields& f, ScenarioMovedGrounds& s) {
  f.field("grounds", s.grounds, ListOf<NameOf>{f.name_of({"grounds"}, "a ground"), "a list of grounds", 1},
          "Grounds that it carries. Their poses are those at the start.", kRequired);
  f.field("mounted_on", s.mounted_on, f.name_of({"grounds"}, "a ground"),
          "Ground that it stands on and moves with; without it: the world.");
  if (!f.reading()) return;
  for (const std::string& ground : s.grounds) {
    for (const auto& [section, name] : f.names())
      f.check(section != kCarried || name != ground, "grounds",
              "'" + ground + "', which another device carries", "each ground once");
    f.check(ground != s.mounted_on, "mounted_on", "'" + ground + "', which the device itself carries",
            "another ground");
    f.add_name(kCarried, ground);
  }
}

void describe_direction(Fields& f, Vec3& direction_W, const char* doc) {
  f.field("direction", direction_W, vector3(""), doc, kRequired);
  f.check(direction_W.norm() > 1e-6, "direction", "a vector without direction", "e.g. [0, 0, 1]");
}

void check_range(Fields& f, const char* key, const std::vector<double>& range, const char* position_key,
                 double position) {
  f.check(range[0] < range[1], key, number_text(range[0], 6) + " to " + number_text(range[1], 6),
          "the lower end, then a greater upper end");
  f.check(position >= range[0] && position <= range[1], position_key, number_text(position, 6),
          "a value within " + std::string(key));
}

MovingGroundsParameters of_moved(const ScenarioMovedGrounds& s, DeviceBuilder& b) {
  MovingGroundsParameters p;
  for (const std::string& ground : s.grounds) {
    const int id = b.cell.description.find_component(ground);
    p.grounds.push_back({id, b.pose_of_ground(ground)});
    b.cell.description.components[static_cast<std::size_t>(id)].carried = true;
  }
  if (!s.mounted_on.empty()) {
    p.mount = b.cell.description.find_component(s.mounted_on);
    p.X_WM = b.pose_of_ground(s.mounted_on);
  }
  p.drive.gravity_W = b.cell.description.gravity_m_per_s2;
  b.mechanism<SlidingParts>();
  return p;
}

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

/// The drive of an axis is the same in both directions.
void set_drive(AxisDrive& drive, double mass_kg, double friction, std::optional<double> limit) {
  drive.mass_kg = mass_kg;
  drive.friction = friction;
  drive.forward_limit = drive.backward_limit = limit.value_or(kUnlimited);
}

template <class Axis>
void add_axis(DeviceBuilder& b, const MovingGroundsParameters& p, std::vector<SignalDescription> signals) {
  const int device = b.add<Axis>(p, std::move(signals));
  b.mechanism<AxisLoads>().axes.push_back(device);
}

struct AxisWords {
  const char *unit, *unit_of_speed, *ends, *fastest, *load, *unit_of_load;
};
consteval std::array<KindSignal, PositionAxis::kSignals> signals_in(AxisWords axis) {
  return {
      commanded("set_position", axis.unit, axis.ends, "target; the axis goes there with `set_speed`"),
      commanded("set_speed", axis.unit_of_speed, axis.fastest,
                "runs at this speed up to an end; the later one of `set_position` and `set_speed` counts"),
      reported("position", axis.unit, "of the axis"),
      reported("speed", axis.unit_of_speed, "of the axis, with sign"),
      reported_flag("in_position", "the axis stands at `set_position`"),
      reported_flag("at_lower_end", "the axis is at its lower end"),
      reported_flag("at_upper_end", "the axis is at its upper end"),
      reported(axis.load, axis.unit_of_load,
               "of the drive, along the motion: it carries weight, inertia and contact; a robot counts from "
               "level 2 on"),
      reported("power", "W", "of the drive: negative while the load drives it"),
      reported("energy", "J", "work of the drive since the start"),
      reported_flag("overload",
                    "the load was beyond the drive's and stopped the axis; until `set_position` or "
                    "`set_speed` changes")};
}
constexpr auto kLinearSignals = signals_in({"m", "m/s", "`stroke_m`", "±`max_speed_m_per_s`", "force", "N"});
constexpr auto kRotarySignals =
    signals_in({"rad", "rad/s", "`range_rad`; without it ±1e6", "±`max_speed_rad_per_s`", "torque", "N m"});
constexpr KindSignal kCylinderSignals[] = {
    commanded_flag("extend", "1 extends, 0 retracts"),
    reported("position", "m", "0 is retracted"),
    reported_flag("extended", "end switch: within `switch_range_m` of the outer end"),
    reported_flag("retracted", "end switch: within `switch_range_m` of the inner end"),
    reported("force", "N",
             "on the piston, as it extends: it carries weight, inertia and contact; a robot counts from "
             "level 2 on"),
    reported_flag("overload", "the load has stopped the piston for 0.1 s: it exceeds pressure times area")};

std::vector<SignalDescription> described_axis(std::span<const KindSignal> signals,
                                              const MovingGroundsParameters& p) {
  constexpr double kEndless = 1e6;
  return described(signals, {{std::max(p.lower, -kEndless), std::min(p.upper, kEndless)},
                             {-p.backward_speed, p.forward_speed}});
}

}  // namespace

void describe(Fields& f, ScenarioLinearAxis& s) {
  describe_moved(f, s.moved);
  describe_direction(f, s.direction_W, "Direction of motion in the world, at the start; of any length.");
  f.field("stroke_m", s.stroke_m, Numbers{2, {.unit = "m"}}, "Lower and upper end.", kRequired);
  f.field("position_m", s.position_m, NumberRange{.unit = "m"}, "Position at the start.");
  f.field("moving_mass_kg", s.moving_mass_kg, not_negative("kg"),
          "Mass of what moves besides the load, at the origin of the first ground.");
  f.field("friction_N", s.friction_N, not_negative("N"), "Friction of the guides, against the motion.");
  f.field("max_force_N", s.max_force_N, positive("N"),
          "Largest force of the drive: a motion that needs more stops. Without it: unlimited.");
  f.field("max_speed_m_per_s", s.max_speed_m_per_s, positive("m/s"), "Largest speed.", kRequired);
  f.field("max_acceleration_m_per_s2", s.max_acceleration_m_per_s2, positive("m/s^2"),
          "Acceleration and deceleration.", kRequired);
  if (f.reading()) check_range(f, "stroke_m", s.stroke_m, "position_m", s.position_m);
}

void build(const ScenarioLinearAxis& s, DeviceBuilder& b) {
  MovingGroundsParameters p = of_moved(s.moved, b);
  p.axis_W = s.direction_W.normalized();
  p.lower = s.stroke_m[0], p.upper = s.stroke_m[1];
  p.start = s.position_m;
  p.forward_speed = p.backward_speed = s.max_speed_m_per_s;
  p.acceleration = s.max_acceleration_m_per_s2;
  p.switch_range = 1e-6;
  set_drive(p.drive, s.moving_mass_kg, s.friction_N, s.max_force_N);
  add_axis<PositionAxis>(b, p, described_axis(kLinearSignals, p));
}

DeviceType linear_axis_type() {
  return device_type<ScenarioLinearAxis>(DeviceType::Owner::cell, "linear_axes", "Linear axes and lifts.",
                                         "A linear axis that carries grounds.", true, kLinearSignals);
}

void describe(Fields& f, ScenarioTurntable& s) {
  describe_moved(f, s.moved);
  f.field("axis", s.axis_W, vector3(""), "Axis of rotation in the world, at the start; of any length.");
  f.check(s.axis_W.norm() > 1e-6, "axis", "a vector without direction", "e.g. [0, 0, 1]");
  f.field("center_m", s.center_W, vector3("m"), "A point on the axis in the world, at the start.", kRequired);
  f.field("range_rad", s.range_rad, Numbers{2, {.unit = "rad"}}, "Lower and upper end; without it: endless.");
  f.field("position_rad", s.position_rad, NumberRange{.unit = "rad"}, "Position at the start.");
  f.field("moving_mass_kg", s.moving_mass_kg, not_negative("kg"),
          "Mass of what turns besides the load, on the axis, at `center_m`.");
  f.field("moving_inertia_kg_m2", s.moving_inertia_kg_m2, not_negative("kg m^2"),
          "Inertia of what turns besides the load, about the axis.");
  f.field("friction_N_m", s.friction_N_m, not_negative("N m"),
          "Friction of the bearing, against the motion.");
  f.field("max_torque_N_m", s.max_torque_N_m, positive("N m"),
          "Largest torque of the drive: a motion that needs more stops. Without it: unlimited.");
  f.field("max_speed_rad_per_s", s.max_speed_rad_per_s, positive("rad/s"), "Largest speed.", kRequired);
  f.field("max_acceleration_rad_per_s2", s.max_acceleration_rad_per_s2, positive("rad/s^2"),
          "Acceleration and deceleration.", kRequired);
  if (f.reading() && s.range_rad) check_range(f, "range_rad", *s.range_rad, "position_rad", s.position_rad);
}

void build(const ScenarioTurntable& s, DeviceBuilder& b) {
  MovingGroundsParameters p = of_moved(s.moved, b);
  p.rotary = true;
  p.axis_W = s.axis_W.normalized();
  p.center_W = s.center_W;
  p.lower = -kUnlimited;
  p.upper = kUnlimited;
  if (s.range_rad) {
    p.lower = s.range_rad->front();
    p.upper = s.range_rad->back();
  }
  p.start = s.position_rad;
  p.forward_speed = p.backward_speed = s.max_speed_rad_per_s;
  p.acceleration = s.max_acceleration_rad_per_s2;
  p.switch_range = 1e-6;
  set_drive(p.drive, s.moving_mass_kg, s.friction_N_m, s.max_torque_N_m);
  p.drive.inertia_kg_m2 = s.moving_inertia_kg_m2;
  add_axis<PositionAxis>(b, p, described_axis(kRotarySignals, p));
}

DeviceType turntable_type() {
  return device_type<ScenarioTurntable>(DeviceType::Owner::cell, "turntables", "Turntables.",
                                        "A rotary axis that carries grounds.", true, kRotarySignals);
}

double trapezoid_speed(double way, double time_s, double acceleration) {
  const double gain = acceleration * time_s;
  return 0.5 * (gain - std::sqrt(std::max(0.0, gain * gain - 4.0 * acceleration * way)));
}

void describe(Fields& f, ScenarioCylinder& s) {
  describe_moved(f, s.moved);
  describe_direction(f, s.direction_W,
                     "Direction in which it extends, in the world, at the start; of any length.");
  f.field("stroke_m", s.stroke_m, positive("m"), "From retracted to extended.", kRequired);
  f.field("extend_time_s", s.extend_time_s, positive("s"), "Time of the whole stroke.", kRequired);
  f.field("retract_time_s", s.retract_time_s, positive("s"), "The same back; without it: extend_time_s.");
  f.field("acceleration_m_per_s2", s.acceleration_m_per_s2, positive("m/s^2"),
          "Acceleration at the start, and deceleration by the end cushion.");
  f.field("switch_range_m", s.switch_range_m, not_negative("m"), "Before its end an end switch is on.");
  f.field("extended", s.extended, Flag{}, "It is extended at the start.");
  f.field("moving_mass_kg", s.moving_mass_kg, not_negative("kg"),
          "Mass of piston, rod and what moves with them, at the origin of the first ground.");
  f.field("friction_N", s.friction_N, not_negative("N"), "Friction of the seals, against the motion.");
  f.field("bore_m", s.bore_m, positive("m"),
          "Diameter of the piston: a motion that needs more than pressure times area stops. Without it: "
          "unlimited.");
  f.field("rod_m", s.rod_m, not_negative("m"), "Diameter of the rod, on the side that retracts.");
  f.field("pressure_Pa", s.pressure_Pa, positive("Pa"), "Supply, above the surroundings.");
  f.check(!s.bore_m || s.rod_m < *s.bore_m, "rod_m", number_text(s.rod_m, 6), "less than bore_m");
  const double least_s = 2.0 * std::sqrt(s.stroke_m / s.acceleration_m_per_s2);
  const double time_s = std::min(s.extend_time_s, s.retract_time_s.value_or(s.extend_time_s));
  f.check(time_s >= least_s, s.extend_time_s >= least_s ? "retract_time_s" : "extend_time_s",
          number_text(time_s, 6),
          "at least 2 sqrt(stroke_m / acceleration_m_per_s2) = " + number_text(least_s, 6));
}

void build(const ScenarioCylinder& s, DeviceBuilder& b) {
  MovingGroundsParameters p = of_moved(s.moved, b);
  p.axis_W = s.direction_W.normalized();
  p.upper = s.stroke_m;
  p.start = s.extended ? s.stroke_m : 0.0;
  p.acceleration = s.acceleration_m_per_s2;
  p.forward_speed = trapezoid_speed(s.stroke_m, s.extend_time_s, p.acceleration);
  p.backward_speed = trapezoid_speed(s.stroke_m, s.retract_time_s.value_or(s.extend_time_s), p.acceleration);
  p.switch_range = s.switch_range_m;
  set_drive(p.drive, s.moving_mass_kg, s.friction_N, {});
  p.drive.piston = true;
  if (s.bore_m) {
    const double per_square = 0.25 * std::numbers::pi * s.pressure_Pa;
    p.drive.forward_limit = per_square * *s.bore_m * *s.bore_m;
    p.drive.backward_limit = per_square * (*s.bore_m * *s.bore_m - s.rod_m * s.rod_m);
  }
  add_axis<Cylinder>(b, p, described(kCylinderSignals));
}

DeviceType cylinder_type() {
  return device_type<ScenarioCylinder>(DeviceType::Owner::cell, "cylinders", "Pneumatic cylinders.",
                                       "A cylinder with two end switches, which carries grounds.", false,
                                       kCylinderSignals);
}

MovingGrounds::MovingGrounds(const MovingGroundsParameters& parameters) : p_(parameters) {
  for (const CarriedGround& ground : p_.grounds) carried_.push_back(ground.component);
  MovingGrounds::reset();
}

void MovingGrounds::write_motion(double t, const double*, CellMotion& motion) const {
  const double moved = motion_.position(t) - p_.start, rate = motion_.speed(t);
  const Mat3 R = p_.rotary ? Eigen::AngleAxisd(moved, p_.axis_W).toRotationMatrix() : Mat3::Identity();
  for (const CarriedGround& ground : p_.grounds) {
    BodyMotion& body = motion.bodies[static_cast<std::size_t>(ground.component)];
    if (p_.rotary) {
      const Vec3 arm = R * (ground.X_WG.p - p_.center_W);
      body.X_WB = {R * ground.X_WG.R, p_.center_W + arm};
      body.V_WB = {rate * p_.axis_W.cross(arm), rate * p_.axis_W};
    } else {
      body.X_WB = {ground.X_WG.R, ground.X_WG.p + moved * p_.axis_W};
      body.V_WB = {rate * p_.axis_W, Vec3::Zero()};
    }
    if (p_.mount >= 0) {
      const BodyMotion& mount = motion.bodies[static_cast<std::size_t>(p_.mount)];
      const Pose X = mount.X_WB * p_.X_WM.inverse();  // from the world at the start to the world now
      body.X_WB = X * body.X_WB;
      body.V_WB = {mount.V_WB.at(body.X_WB.p - mount.X_WB.p) + X.R * body.V_WB.v,
                   mount.V_WB.w + X.R * body.V_WB.w};
    }
    body.p_WBcm = body.X_WB.p;
    if (!motion.accelerations.empty()) write_acceleration(t, ground, motion);
  }
}

void MovingGrounds::write_acceleration(double t, const CarriedGround& ground, CellMotion& motion) const {
  const BodyMotion& body = motion.bodies[static_cast<std::size_t>(ground.component)];
  Twist& A = motion.accelerations[static_cast<std::size_t>(ground.component)];
  const double rate = motion_.speed(t), gain = motion_.acceleration(t);
  const BodyMotion* mount = p_.mount < 0 ? nullptr : &motion.bodies[static_cast<std::size_t>(p_.mount)];
  const Vec3 axis = turned(motion) * p_.axis_W;  // and all that follows: relative to the mount
  Twist V{rate * axis, Vec3::Zero()};
  A = {gain * axis, Vec3::Zero()};
  if (p_.rotary) {
    const Vec3 arm = body.X_WB.p - load_point(motion);
    V = {rate * axis.cross(arm), rate * axis};
    A = {gain * axis.cross(arm) + V.w.cross(V.v), gain * axis};
  }
  if (mount == nullptr) return;
  const Twist& A_M = motion.accelerations[static_cast<std::size_t>(p_.mount)];
  const Vec3& w = mount->V_WB.w;
  const Vec3 r = body.X_WB.p - mount->X_WB.p;
  A.v += A_M.at(r) + w.cross(w.cross(r)) + 2.0 * w.cross(V.v);
  A.w += A_M.w + w.cross(V.w);
}

Mat3 MovingGrounds::turned(const CellMotion& motion) const {
  if (p_.mount < 0) return Mat3::Identity();
  return motion.bodies[static_cast<std::size_t>(p_.mount)].X_WB.R * p_.X_WM.R.transpose();
}

Vec3 MovingGrounds::load_point(const CellMotion& motion) const {
  if (!p_.rotary) return motion.bodies[static_cast<std::size_t>(carried_.front())].X_WB.p;
  if (p_.mount < 0) return p_.center_W;
  return motion.bodies[static_cast<std::size_t>(p_.mount)].X_WB * (p_.X_WM.inverse() * p_.center_W);
}

Wrench MovingGrounds::own_load(double t, const CellMotion& motion) const {
  const double gain = motion_.acceleration(t);
  const Vec3 axis = turned(motion) * p_.axis_W;
  Twist A;  // of the point of the load, and angular
  if (p_.mount < 0) {
    (p_.rotary ? A.w : A.v) = gain * axis;
  } else {
    const auto ground = static_cast<std::size_t>(carried_.front());
    const BodyMotion& body = motion.bodies[ground];
    const Twist& A_G = motion.accelerations[ground];
    const Vec3 r = load_point(motion) - body.X_WB.p;
    A = {A_G.at(r) + body.V_WB.w.cross(body.V_WB.w.cross(r)), A_G.w};
  }
  return {p_.drive.mass_kg * (p_.drive.gravity_W - A.v), -p_.drive.inertia_kg_m2 * axis.dot(A.w) * axis};
}

double MovingGrounds::drive_force(double t, const Wrench& load_W, const CellMotion& motion) const {
  return p_.drive.friction * direction(t) - (turned(motion) * p_.axis_W).dot(p_.rotary ? load_W.t : load_W.f);
}

int MovingGrounds::direction(double t) const {
  const double rate = speed(t) != 0.0 ? speed(t) : motion_.acceleration(t);
  return (rate > 0.0 ? 1 : 0) - (rate < 0.0 ? 1 : 0);
}

bool MovingGrounds::take_load(double t, double h, double force) {
  mean_force_ += (loaded_ ? h / (h + kPeak_s) : 1.0) * (force - mean_force_);
  loaded_ = true;
  const double own = p_.drive.mass_kg * motion_.acceleration(t);
  const bool changed = p_.drive.piston ? limit_piston(t, h, force - own) : limit_axis(t);
  const double gained = changed && p_.drive.piston ? p_.drive.mass_kg * motion_.acceleration(t) - own : 0.0;
  work_.take(force + gained, speed(t), h);
  return changed;
}

bool MovingGrounds::limit_axis(double t) {
  const bool exceeds = mean_force_ > p_.drive.forward_limit || -mean_force_ > p_.drive.backward_limit;
  if (!exceeds || at_rest(t) || overloaded_) return false;
  overloaded_ = true;
  motion_.run_at(t, 0.0, limits());
  return true;
}

// Newton's law of a piston whose force is used up: mass * acceleration = limit - load, where the load excludes its own inertia. Its
// mass is at least the one that the limit gives its stated acceleration. It does not bounce: it stands at the least.
bool MovingGrounds::limit_piston(double t, double h, double load) {
  const bool was_limited = limited_ != 0, stood = was_limited && at_rest(t);
  const int way = was_limited ? limited_ : direction(t);
  const double most = way > 0 ? p_.drive.forward_limit : p_.drive.backward_limit;
  if (way == 0 || !std::isfinite(most)) return false;
  limited_ = 0;
  if (was_limited) follow_if_allowed(t);
  const double mass_kg = std::max(p_.drive.mass_kg, most / p_.acceleration);
  const double gain = (most - way * load) / mass_kg;
  if (direction(t) != way || way * motion_.acceleration(t) <= gain) {
    stood_s_ = 0.0;
    overloaded_ = false;
    return was_limited;
  }
  limited_ = way;
  const double rated = way > 0 ? p_.forward_speed : p_.backward_speed;
  const double to = std::clamp(way * speed(t) + gain * h, 0.0, rated);
  motion_.run_at(t, way * to, {.acceleration = std::max(std::abs(gain), kLeastGain)});
  stood_s_ = at_rest(t) ? stood_s_ + h : 0.0;
  overloaded_ = stood_s_ > kStood_s;
  return !(stood && at_rest(t));
}

void MovingGrounds::reset() {
  motion_.rest_at(p_.start);
  halted_ = overloaded_ = loaded_ = false;
  limited_ = 0;
  work_ = {};
  mean_force_ = stood_s_ = 0.0;
}

void MovingGrounds::allow_motion(double t, bool allowed) {
  if (halted_ != allowed) return;
  halted_ = !allowed;
  if (halted_)
    motion_.run_at(t, 0.0, limits());
  else
    follow_if_allowed(t);
}

void MovingGrounds::save(StateWriter& out) const {
  motion_.save(out);
  for (const bool flag : {halted_, overloaded_, loaded_}) out.put(flag);
  out.put(limited_);
  work_.save(out);
  out.put(mean_force_), out.put(stood_s_);
}

void MovingGrounds::load(StateReader& in) {
  motion_.load(in);
  halted_ = in.flag("'halted'");
  overloaded_ = in.flag("'overloaded'");
  loaded_ = in.flag("'loaded'");
  limited_ = in.integer<int>(-1, 1, "'limited'");
  work_.load(in);
  mean_force_ = in.number("the load of an axis");
  stood_s_ = in.number("how long a piston stood");
}

PositionAxis::PositionAxis(const MovingGroundsParameters& parameters) : MovingGrounds(parameters) {
  PositionAxis::reset();
}

void PositionAxis::reset() {
  MovingGrounds::reset();
  target_ = p_.start;
  run_ = 0.0;
  runs_ = false;
}

void PositionAxis::set_signal(double t, int signal, double value) {
  if (signal == set_position) {
    target_ = value;
  } else if (signal == set_speed) {
    run_ = value;
  } else {
    return;
  }
  runs_ = signal == set_speed;
  follow_changed(t);
}

void PositionAxis::follow(double t) {
  if (runs_) return motion_.run_at(t, run_, limits());
  const double fastest = target_ >= coordinate(t) ? p_.forward_speed : p_.backward_speed;
  motion_.move_to(t, target_, fastest, limits());
}

void PositionAxis::read_signals(double t, const double*, const CellMotion&, std::span<double> signals) const {
  signals[set_position] = target_;
  signals[set_speed] = run_;
  signals[position] = coordinate(t);
  signals[speed_now] = speed(t);
  signals[in_position] = at_rest(t) && coordinate(t) == target_ ? 1.0 : 0.0;
  signals[lower_end] = at_lower(t) ? 1.0 : 0.0;
  signals[upper_end] = at_upper(t) ? 1.0 : 0.0;
  signals[drive_force_now] = work().force;
  signals[drive_power] = work().power_W;
  signals[drive_energy] = work().energy_J;
  signals[overload] = overloaded() ? 1.0 : 0.0;
}

void PositionAxis::save(StateWriter& out) const {
  MovingGrounds::save(out);
  out.put(target_), out.put(run_), out.put(runs_);
}

void PositionAxis::load(StateReader& in) {
  MovingGrounds::load(in);
  target_ = in.number("the target of an axis");
  run_ = in.number("the commanded speed of an axis");
  runs_ = in.flag("'runs'");
}

Cylinder::Cylinder(const MovingGroundsParameters& parameters) : MovingGrounds(parameters) {
  Cylinder::reset();
}

void Cylinder::reset() {
  MovingGrounds::reset();
  extend_ = p_.start > 0.0;
}

void Cylinder::set_signal(double t, int signal, double value) {
  if (signal != extend) return;
  extend_ = value != 0.0;
  follow_changed(t);
}

void Cylinder::follow(double t) {
  motion_.move_to(t, extend_ ? p_.upper : p_.lower, extend_ ? p_.forward_speed : p_.backward_speed, limits());
}

void Cylinder::read_signals(double t, const double*, const CellMotion&, std::span<double> signals) const {
  signals[extend] = extend_ ? 1.0 : 0.0;
  signals[position] = coordinate(t);
  signals[extended] = at_upper(t) ? 1.0 : 0.0;
  signals[retracted] = at_lower(t) ? 1.0 : 0.0;
  signals[rod_force] = work().force;
  signals[overload] = overloaded() ? 1.0 : 0.0;
}

void Cylinder::save(StateWriter& out) const {
  MovingGrounds::save(out);
  out.put(extend_);
}

void Cylinder::load(StateReader& in) {
  MovingGrounds::load(in);
  extend_ = in.flag("'extend'");
}

}  // namespace takt
