#include "server/devices/moving_grounds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "idl/common/text.h"
#include "plant_models/state_bytes.h"
#include "server/devices/sliding_parts.h"

namespace takt {

namespace {

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
  b.mechanism<SlidingParts>();
  return p;
}

struct AxisWords {
  const char *unit, *unit_of_speed, *ends, *fastest;
};
consteval std::array<KindSignal, 7> signals_in(AxisWords axis) {
  return {
      commanded("set_position", axis.unit, axis.ends, "target; the axis goes there with `set_speed`"),
      commanded("set_speed", axis.unit_of_speed, axis.fastest,
                "runs at this speed up to an end; the later one of `set_position` and `set_speed` counts"),
      reported("position", axis.unit, "of the axis"),
      reported("speed", axis.unit_of_speed, "of the axis, with sign"),
      reported_flag("in_position", "the axis stands at `set_position`"),
      reported_flag("at_lower_end", "the axis is at its lower end"),
      reported_flag("at_upper_end", "the axis is at its upper end")};
}
constexpr auto kLinearSignals = signals_in({"m", "m/s", "`stroke_m`", "±`max_speed_m_per_s`"});
constexpr auto kRotarySignals =
    signals_in({"rad", "rad/s", "`range_rad`; without it ±1e6", "±`max_speed_rad_per_s`"});
constexpr KindSignal kCylinderSignals[] = {
    commanded_flag("extend", "1 extends, 0 retracts"), reported("position", "m", "0 is retracted"),
    reported_flag("extended", "end switch: within `switch_range_m` of the outer end"),
    reported_flag("retracted", "end switch: within `switch_range_m` of the inner end")};

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
  b.add<PositionAxis>(p, described_axis(kLinearSignals, p));
}

DeviceType linear_axis_type() {
  return device_type<ScenarioLinearAxis>(DeviceType::Owner::cell, "linear_axes", "Linear axes and lifts.",
                                         "A linear axis that carries grounds.", false, kLinearSignals);
}

void describe(Fields& f, ScenarioTurntable& s) {
  describe_moved(f, s.moved);
  f.field("axis", s.axis_W, vector3(""), "Axis of rotation in the world, at the start; of any length.");
  f.check(s.axis_W.norm() > 1e-6, "axis", "a vector without direction", "e.g. [0, 0, 1]");
  f.field("center_m", s.center_W, vector3("m"), "A point on the axis in the world, at the start.", kRequired);
  f.field("range_rad", s.range_rad, Numbers{2, {.unit = "rad"}}, "Lower and upper end; without it: endless.");
  f.field("position_rad", s.position_rad, NumberRange{.unit = "rad"}, "Position at the start.");
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
  constexpr double kEndless = std::numeric_limits<double>::infinity();
  p.lower = -kEndless;
  p.upper = kEndless;
  if (s.range_rad) {
    p.lower = s.range_rad->front();
    p.upper = s.range_rad->back();
  }
  p.start = s.position_rad;
  p.forward_speed = p.backward_speed = s.max_speed_rad_per_s;
  p.acceleration = s.max_acceleration_rad_per_s2;
  p.switch_range = 1e-6;
  b.add<PositionAxis>(p, described_axis(kRotarySignals, p));
}

DeviceType turntable_type() {
  return device_type<ScenarioTurntable>(DeviceType::Owner::cell, "turntables", "Turntables.",
                                        "A rotary axis that carries grounds.", false, kRotarySignals);
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
  b.add<Cylinder>(p, described(kCylinderSignals));
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
  // Relative to the mount, in its axes now; the mount at the start has those of the world.
  const BodyMotion* mount = p_.mount < 0 ? nullptr : &motion.bodies[static_cast<std::size_t>(p_.mount)];
  const Mat3 R = mount == nullptr ? Mat3::Identity() : Mat3(mount->X_WB.R * p_.X_WM.R.transpose());
  const Vec3 axis = R * p_.axis_W;
  Twist V{rate * axis, Vec3::Zero()};
  A = {gain * axis, Vec3::Zero()};
  if (p_.rotary) {
    const Pose X = mount == nullptr ? Pose{} : mount->X_WB * p_.X_WM.inverse();
    const Vec3 arm = body.X_WB.p - X * p_.center_W;
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

void MovingGrounds::reset() {
  motion_.rest_at(p_.start);
  halted_ = false;
}

void MovingGrounds::allow_motion(double t, bool allowed) {
  if (halted_ != allowed) return;
  halted_ = !allowed;
  halted_ ? motion_.run_at(t, 0.0, limits()) : follow(t);
}

void MovingGrounds::save(StateWriter& out) const {
  motion_.save(out);
  out.put(halted_);
}

void MovingGrounds::load(StateReader& in) {
  motion_.load(in);
  halted_ = in.flag("'halted'");
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
  follow_if_allowed(t);
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
  follow_if_allowed(t);
}

void Cylinder::follow(double t) {
  motion_.move_to(t, extend_ ? p_.upper : p_.lower, extend_ ? p_.forward_speed : p_.backward_speed, limits());
}

void Cylinder::read_signals(double t, const double*, const CellMotion&, std::span<double> signals) const {
  signals[extend] = extend_ ? 1.0 : 0.0;
  signals[position] = coordinate(t);
  signals[extended] = at_upper(t) ? 1.0 : 0.0;
  signals[retracted] = at_lower(t) ? 1.0 : 0.0;
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
