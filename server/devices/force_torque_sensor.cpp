#include "server/devices/force_torque_sensor.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "idl/common/lockstep.h"
#include "server/contact/holding/component_interaction.h"
#include "server/devices/seeded_noise.h"
#include "server/simulation/step/cell_plant.h"

namespace takt {
namespace {

constexpr KindSignal kForceTorqueSignals[] = {
    reported("force_x", "N", "on the flange, in the axes of the sensor"),
    reported("force_y", "N", "the same"),
    reported("force_z", "N", "the same"),
    reported("torque_x", "N m", "on the flange, about the origin of the sensor"),
    reported("torque_y", "N m", "the same"),
    reported("torque_z", "N m", "the same"),
    reported_flag("overload", "a value is beyond the range"),
    commanded_flag("tare", "the change from 0 to 1 takes the present value as zero")};

/// Keys end in the unit, as everywhere.
struct AxisKeys {
  const char *unit, *drift_unit, *range, *noise, *bias, *drift, *resolution;
};
constexpr AxisKeys kForceKeys{"N",      "N/sqrt s",           "range_N",     "noise_N",
                              "bias_N", "drift_N_per_sqrt_s", "resolution_N"};
constexpr AxisKeys kTorqueKeys{"N m",      "N m/sqrt s",           "range_N_m",     "noise_N_m",
                               "bias_N_m", "drift_N_m_per_sqrt_s", "resolution_N_m"};

void describe_axes(Fields& f, const char* key, const char* doc, SensorAxes& axes, const AxisKeys& keys) {
  f.section(key, doc, [&] {
    f.field(keys.range, axes.range, not_negative(keys.unit),
            "Largest value reported, either way; 0: without bound.");
    f.field(keys.noise, axes.noise, not_negative(keys.unit),
            "Standard deviation of each sample, ahead of the filter.");
    f.field(keys.bias, axes.bias, vector3(keys.unit), "Added to the true value.");
    f.field(keys.drift, axes.drift_per_sqrt_s, not_negative(keys.drift_unit),
            "Standard deviation of the bias' random walk after one second.");
    f.field(keys.resolution, axes.resolution, not_negative(keys.unit),
            "Values are multiples of it; 0: continuous.");
  });
}

}  // namespace

void describe(Fields& f, ScenarioForceTorqueSensor& s) {
  f.field("robot", s.robot, f.name_of({"robots"}, "a robot"), "Robot whose flange carries it.", kRequired);
  f.pose("pose", s.X_FS, "Pose of the sensor's frame in the flange.");
  f.field("rate_Hz", s.rate_hz, not_negative("Hz"),
          "Samples in a second of simulated time; 0: one in each step.");
  f.field("filter_Hz", s.filter_hz, not_negative("Hz"),
          "Cut-off of a low-pass filter of first order; 0: none.");
  f.field("seed", s.seed, WholeRange{0, 2147483647}, "Of noise and drift: equal seeds give equal samples.");
  describe_axes(f, "force", "Of the forces.", s.force, kForceKeys);
  describe_axes(f, "torque", "Of the torques.", s.torque, kTorqueKeys);
}

void build(const ScenarioForceTorqueSensor& s, DeviceBuilder& b) {
  ForceTorqueSensorParameters p;
  p.robot = b.cell.description.find_robot(s.robot);
  p.X_FS = s.X_FS;
  p.rate_hz = s.rate_hz;
  p.filter_hz = s.filter_hz;
  p.seed = static_cast<std::uint64_t>(s.seed);
  p.force = s.force;
  p.torque = s.torque;
  for (const GripperDescription& gripper : b.cell.description.grippers)
    if (gripper.robot == p.robot) p.bodies += 3;
  p.device = b.add_signal_table(p, described(kForceTorqueSignals));
  DeviceDescription& description = b.cell.description.devices.back();
  description.robot = p.robot;
  description.X_FD = p.X_FS;
  b.mechanism<ForceTorqueSensors>().sensors.push_back(p);
  const auto robot = static_cast<std::size_t>(p.robot);
  if (p.bodies > 0 && !b.cell.dynamics[robot])
    b.cell.import_notes.push_back({b.name,
                                   "does not measure weight and inertia of the grippers of " + s.robot +
                                       ", which has no masses: " + b.cell.no_dynamics[robot],
                                   {}});
}

DeviceType force_torque_sensor_type() {
  return device_type<ScenarioForceTorqueSensor>(DeviceType::Owner::cell, "force_torque_sensors",
                                                "Force-torque sensors.",
                                                "Between the flange of a robot and its grippers: the wrench "
                                                "that they exert on the flange, about the origin and in the "
                                                "axes of the sensor. `tare` takes the present value as zero.",
                                                false, kForceTorqueSignals);
}

void SensorChannel::sample(const Wrench& wrench_S, double period_s) {
  // Exact for a value that is constant between two samples.
  const double share = p_.filter_hz > 0.0 && samples_ > 0
                           ? 1.0 - std::exp(-2.0 * std::numbers::pi * p_.filter_hz * period_s)
                           : 1.0;
  overloaded_ = false;
  for (std::size_t i = 0; i < 6; ++i) {
    const SensorAxes& axes = i < 3 ? p_.force : p_.torque;
    const auto axis = static_cast<Eigen::Index>(i % 3);
    const std::uint64_t place = 12 * samples_ + 2 * i;
    if (axes.drift_per_sqrt_s > 0.0 && samples_ > 0)
      drift_[i] += axes.drift_per_sqrt_s * std::sqrt(period_s) * seeded_normal(p_.seed, place);
    double raw = (i < 3 ? wrench_S.f : wrench_S.t)[axis] + axes.bias[axis] + drift_[i];
    if (axes.noise > 0.0) raw += axes.noise * seeded_normal(p_.seed, place + 1);
    filtered_[i] += share * (raw - filtered_[i]);
    double value = filtered_[i] - tare_[i];
    if (axes.range > 0.0 && std::abs(value) >= axes.range) {
      value = std::copysign(axes.range, value);
      overloaded_ = true;
    }
    if (axes.resolution > 0.0) value = axes.resolution * std::round(value / axes.resolution);
    values_[i] = value;
  }
  ++samples_;
}

void SensorChannel::save(StateWriter& out) const {
  out.put(samples_), out.put(drift_), out.put(filtered_), out.put(tare_), out.put(values_),
      out.put(overloaded_);
}

void SensorChannel::load(StateReader& in) {
  samples_ = in.get<std::uint64_t>();
  for (Values* values : {&drift_, &filtered_, &tare_, &values_}) in.numbers(*values, "a value of a sensor");
  overloaded_ = in.flag("'a sensor is overloaded'");
}

ForceTorqueSensors::ForceTorqueSensors(const Model& model) : model_(model) {
  for (const ForceTorqueSensorParameters& p : model.sensors)
    sensors_.push_back({SensorChannel(p), 0, false, std::vector<Twist>(p.bodies), false});
}

void ForceTorqueSensors::start(ComponentInteraction&) {
  steps_ = 0;
  starting_ = true;
  for (Sensor& sensor : sensors_) {
    sensor.channel.reset();
    sensor.next_sample = 0;
    sensor.tare_was_set = sensor.has_before = false;
  }
}

/// Level 1: the grippers as rigid bodies that move as their frames do.
Wrench ForceTorqueSensors::from_motion(const ForceTorqueSensorParameters& p, double h,
                                       const CellMotion& motion, const CellPlant& plant,
                                       std::span<const Wrench> wrenches, Sensor& sensor) {
  const DynamicRobotParameters* dynamics = plant.dynamics(static_cast<std::size_t>(p.robot));
  const Vec3 p_WF = motion.arms[static_cast<std::size_t>(p.robot)].X_WF.p;
  Wrench load;
  std::size_t place = 0, gripper = 0;
  const auto add = [&](int component, const BodyInertia* body) {
    const auto c = static_cast<std::size_t>(component);
    const BodyMotion& now = motion.bodies[c];
    load += {wrenches[c].f, wrenches[c].t + (now.p_WBcm - p_WF).cross(wrenches[c].f)};
    Twist& before = sensor.before[place++];
    if (body != nullptr) {
      const Twist A{sensor.has_before ? Vec3((now.V_WB.v - before.v) / h) : Vec3::Zero(),
                    sensor.has_before ? Vec3((now.V_WB.w - before.w) / h) : Vec3::Zero()};
      const Vec3& w = now.V_WB.w;
      const Vec3 r = now.X_WB.R * body->p_BBcm_B;
      const Mat3 I = now.X_WB.R * body->I_BBcm_B * now.X_WB.R.transpose();
      const Vec3 force = body->mass_kg * (dynamics->gravity_W - A.v - A.w.cross(r) - w.cross(w.cross(r)));
      load += {force, (now.X_WB.p + r - p_WF).cross(force) - I * A.w - w.cross(I * w)};
    }
    before = now.V_WB;
  };
  for (const ParallelGripper& each : plant.grippers()) {
    const ParallelGripperParameters& mounted = each.parameters();
    if (mounted.robot != p.robot) continue;
    const MountedGripper* body = dynamics != nullptr ? &dynamics->grippers[gripper] : nullptr;
    ++gripper;
    add(mounted.palm, body != nullptr ? &body->palm : nullptr);
    for (const int jaw : mounted.jaws) add(jaw, body != nullptr ? &body->jaw : nullptr);
  }
  sensor.has_before = true;
  return load;
}

bool ForceTorqueSensors::update(double h, const CellMotion& motion, CellPlant& plant, ComponentInteraction&) {
  if (std::exchange(starting_, false)) return false;
  const double t = static_cast<double>(steps_) * h;
  for (std::size_t i = 0; i < sensors_.size(); ++i) {
    const ForceTorqueSensorParameters& p = model_.sensors[i];
    Sensor& sensor = sensors_[i];
    const auto robot = static_cast<std::size_t>(p.robot);
    const DynamicRobot* dynamic = plant.dynamic(robot);
    const double period_s = p.rate_hz > 0.0 ? std::max(1.0 / p.rate_hz, h) : h;
    const bool due = steps_ >= period_boundary_step(sensor.next_sample, period_s, h);
    if (dynamic != nullptr) sensor.has_before = false;
    if (!due && dynamic != nullptr) continue;
    const std::span<const Wrench> wrenches = plant.system().update_wrenches();
    const Wrench load_W =
        dynamic != nullptr ? dynamic->output(t, plant.segment(robot).data(), motion, wrenches).flange_load_W
                           : from_motion(p, h, motion, plant, wrenches, sensor);
    if (!due) continue;
    ++sensor.next_sample;
    const Pose X_WS = motion.arms[robot].X_WF * p.X_FS;
    const Vec3 p_SF_W = motion.arms[robot].X_WF.p - X_WS.p;
    sensor.channel.sample(
        {X_WS.R.transpose() * load_W.f, X_WS.R.transpose() * (load_W.t + p_SF_W.cross(load_W.f))}, period_s);
    SignalTable& signals = signal_table(plant, p.device);
    const bool wanted = signals.value(tare) >= 0.5;
    if (wanted && !sensor.tare_was_set) sensor.channel.tare();
    sensor.tare_was_set = wanted;
    for (int signal = force_x; signal <= torque_z; ++signal)
      signals.report(signal, sensor.channel.values()[static_cast<std::size_t>(signal)]);
    signals.report(overload, sensor.channel.overloaded() ? 1.0 : 0.0);
  }
  ++steps_;
  return false;
}

void ForceTorqueSensors::save(StateWriter& out) const {
  out.put(steps_);
  for (const Sensor& sensor : sensors_) {
    sensor.channel.save(out);
    out.put(sensor.next_sample), out.put(sensor.tare_was_set), out.put(sensor.has_before);
    for (const Twist& before : sensor.before) out.put(before.v), out.put(before.w);
  }
}

void ForceTorqueSensors::load(StateReader& in) {
  steps_ = in.get<std::uint64_t>();
  for (Sensor& sensor : sensors_) {
    sensor.channel.load(in);
    sensor.next_sample = in.get<std::uint64_t>();
    sensor.tare_was_set = in.flag("'a sensor is tared'");
    sensor.has_before = in.flag("'a sensor has a velocity'");
    for (Twist& before : sensor.before) {
      before.v = in.vector("a velocity of a gripper");
      before.w = in.vector("an angular velocity of a gripper");
    }
  }
}

}  // namespace takt
