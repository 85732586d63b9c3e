#include "server/devices/conveyor.h"

#include <cmath>

#include "idl/common/text.h"
#include "plant_models/state_bytes.h"
#include "server/devices/axis_loads.h"
#include "server/devices/sliding_parts.h"

namespace takt {

namespace {
constexpr const char* kBelts = "belts";
constexpr KindSignal kConveyorSignals[] = {
    commanded_flag("run", "1 runs the belt at `set_speed`, 0 stops it"),
    commanded("set_speed", "m/s", "±`max_speed_m_per_s`", "negative: backwards"),
    reported("speed", "m/s", "of the belt, with sign"),
    reported("position", "m", "travel of the belt since the start"),
    reported(
        "force", "N",
        "of the drive, along the belt, or at `radius_m` of a curve: friction and inertia of belt and load"),
    reported("power", "W", "of the drive: negative while the load drives it"),
    reported("energy", "J", "work of the drive since the start")};

void describe_curve(Fields& f, ScenarioConveyorCurve& s) {
  f.field("center_m", s.center_G, vector3("m"),
          "A point on the axis of the curve, in the frame of the ground.", kRequired);
  f.field("axis", s.axis_G, vector3(""), "Axis of the curve, in the frame of the ground; of any length.");
  f.check(s.axis_G.norm() > 1e-6, "axis", "a vector without direction", "e.g. [0, 0, 1]");
  f.field("radius_m", s.radius_m, positive("m"), "Radius at which the belt has its speed.", kRequired);
}
}  // namespace

void describe(Fields& f, ScenarioConveyor& s) {
  f.field("ground", s.ground, f.name_of({"grounds"}, "a ground"), "Ground whose surface moves.", kRequired);
  if (f.reading()) {
    for (const auto& [section, name] : f.names())
      f.check(section != kBelts || name != s.ground, "ground",
              "'" + s.ground + "', the belt of another conveyor", "a ground of its own");
    f.add_name(kBelts, s.ground);
  }
  f.field("direction", s.direction_G, vector3(""),
          "Direction of a straight belt, in the frame of the ground; of any length.");
  f.check(s.direction_G.norm() > 1e-6, "direction", "a vector without direction", "e.g. [1, 0, 0]");
  f.section("curve", "A belt that runs around an axis.", s.curve,
            [&f](auto& curve) { describe_curve(f, curve); });
  f.field("max_speed_m_per_s", s.max_speed_m_per_s, positive("m/s"), "Largest speed.", kRequired);
  f.field("max_acceleration_m_per_s2", s.max_acceleration_m_per_s2, positive("m/s^2"),
          "Acceleration and deceleration of the belt.", kRequired);
  f.field("speed_m_per_s", s.speed_m_per_s, NumberRange{.unit = "m/s"},
          "Speed until another one is commanded; without it: the largest.");
  f.check(!s.speed_m_per_s || std::abs(*s.speed_m_per_s) <= s.max_speed_m_per_s, "speed_m_per_s",
          s.speed_m_per_s ? number_text(*s.speed_m_per_s, 6) : "", "at most max_speed_m_per_s, either way");
  f.field("moving_mass_kg", s.moving_mass_kg, not_negative("kg"),
          "Mass of the belt and, at its speed, of the rollers.");
  f.field("friction_N", s.friction_N, not_negative("N"), "Friction of belt and rollers, against the motion.");
  f.field("running", s.running, Flag{}, "The belt runs at the start.");
}

void build(const ScenarioConveyor& s, DeviceBuilder& b) {
  ConveyorParameters p;
  p.ground = b.cell.description.find_component(s.ground);
  p.axis_G = s.direction_G.normalized();
  if (s.curve) {
    p.curved = true;
    p.axis_G = s.curve->axis_G.normalized();
    p.center_G = s.curve->center_G;
    p.radius_m = s.curve->radius_m;
  }
  p.max_speed = s.max_speed_m_per_s;
  p.acceleration = s.max_acceleration_m_per_s2;
  p.set_speed = s.speed_m_per_s.value_or(s.max_speed_m_per_s);
  p.running = s.running;
  p.mass_kg = s.moving_mass_kg;
  p.friction_N = s.friction_N;
  b.mechanism<SlidingParts>();
  b.mechanism<AxisLoads>();
  b.cell.contact.belts.push_back(p.ground);
  b.add<Conveyor>(p, described(kConveyorSignals, {{-p.max_speed, p.max_speed}}));
}

DeviceType conveyor_type() {
  return device_type<ScenarioConveyor>(DeviceType::Owner::cell, "conveyors", "Conveyors.",
                                       "A ground whose surface moves.", true, kConveyorSignals);
}

Conveyor::Conveyor(const ConveyorParameters& parameters) : p_(parameters) {
  Conveyor::reset();
}

void Conveyor::reset() {
  motion_.rest_at(0.0);
  run_ = p_.running;
  set_speed_ = p_.set_speed;
  halted_ = false;
  work_ = {};
  if (run_) motion_.run_at(0.0, set_speed_, {.acceleration = p_.acceleration});
}

void Conveyor::set_signal(double t, int signal, double value) {
  if (signal == run)
    run_ = value != 0.0;
  else if (signal == set_speed)
    set_speed_ = value;
  else
    return;
  follow(t);
}

void Conveyor::follow(double t) {
  motion_.run_at(t, run_ && !halted_ ? set_speed_ : 0.0, {.acceleration = p_.acceleration});
}

void Conveyor::allow_motion(double t, bool allowed) {
  if (halted_ != allowed) return;
  halted_ = !allowed;
  follow(t);
}

void Conveyor::take_load(double t, double h, const Wrench& load_W, const CellMotion& motion) {
  const BodyMotion& body = motion.bodies[static_cast<std::size_t>(p_.ground)];
  const Vec3 axis_W = body.X_WB.R * p_.axis_G;
  double along = axis_W.dot(load_W.f);
  if (p_.curved) along = axis_W.dot(load_W.t - (body.X_WB.R * p_.center_G).cross(load_W.f)) / p_.radius_m;
  const double rate = speed(t), gain = motion_.acceleration(t);
  const double friction_N = rate == 0.0 ? 0.0 : std::copysign(p_.friction_N, rate);
  work_.take(p_.mass_kg * gain + friction_N - along, rate, h);
}

void Conveyor::write_motion(double t, const double*, CellMotion& motion) const {
  const auto ground = static_cast<std::size_t>(p_.ground);
  const BodyMotion& body = motion.bodies[ground];
  SurfaceMotion& surface = motion.surfaces[ground];
  const double travel = motion_.position(t), rate = motion_.speed(t);
  surface.exists = true;
  if (p_.curved) {
    surface.X_TS.R = Eigen::AngleAxisd(travel / p_.radius_m, p_.axis_G).toRotationMatrix();
    surface.X_TS.p = p_.center_G - surface.X_TS.R * p_.center_G;
    surface.V_TS_T.w = rate / p_.radius_m * p_.axis_G;
    surface.V_TS_T.v = -surface.V_TS_T.w.cross(p_.center_G);
  } else {
    surface.X_TS.p = travel * p_.axis_G;
    surface.V_TS_T.v = rate * p_.axis_G;
  }
  // The field of velocities at the origin of T, then at the origin of S.
  const Twist at_ground{body.V_WB.v + body.X_WB.R * surface.V_TS_T.v,
                        body.V_WB.w + body.X_WB.R * surface.V_TS_T.w};
  surface.in_W.X_WB = body.X_WB * surface.X_TS;
  surface.in_W.V_WB = {at_ground.at(surface.in_W.X_WB.p - body.X_WB.p), at_ground.w};
  surface.in_W.p_WBcm = body.p_WBcm;
}

void Conveyor::read_signals(double t, const double*, const CellMotion&, std::span<double> signals) const {
  signals[run] = run_ ? 1.0 : 0.0;
  signals[set_speed] = set_speed_;
  signals[speed_now] = speed(t);
  signals[position] = coordinate(t);
  signals[force] = work_.force;
  signals[power] = work_.power_W;
  signals[energy] = work_.energy_J;
}

void Conveyor::save(StateWriter& out) const {
  motion_.save(out);
  out.put(run_), out.put(set_speed_), out.put(halted_);
  work_.save(out);
}

void Conveyor::load(StateReader& in) {
  motion_.load(in);
  run_ = in.flag("'run'");
  set_speed_ = in.number("the commanded speed of a conveyor");
  halted_ = in.flag("'halted'");
  work_.load(in);
}

}  // namespace takt
