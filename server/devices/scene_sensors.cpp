#include "server/devices/scene_sensors.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "server/simulation/step/cell_plant.h"

namespace takt {

namespace {

using Kind = SceneSensorParameters::Kind;
constexpr double kNone = std::numeric_limits<double>::infinity();
constexpr int kMostBeams = 64;

constexpr KindSignal kClear =
    reported_flag("clear", "the opposite of `blocked`: the output of a safe device");
constexpr KindSignal kBarrierSignals[] = {
    kClear, reported_flag("blocked", "a mesh crosses or surrounds the beam, after the delays")};
constexpr KindSignal kCurtainSignals[] = {
    kClear, reported_flag("blocked", "a mesh breaks a beam and `muting` is 0, after the delays"),
    reported_count("broken_beams", "beams that are broken, without delays and muting"),
    commanded_flag("muting", "1 holds the output clear")};
constexpr KindSignal kBoxSignals[] = {
    reported_flag("detected", "a mesh reaches into the box, after the delays")};
constexpr KindSignal kDistanceSignals[] = {
    reported("distance", "m", "from the sensor to the nearest mesh on the ray; without one the range"),
    reported_flag("in_range", "a mesh is on the ray"),
    reported_flag("near", "`distance` is at most `switch_m`, after hysteresis and delays")};
constexpr KindSignal kReaderSignals[] = {
    reported_count("part", "index of the nearest part in range among the components, or -1"),
    reported_flag("present", "a part is in range, after the delays"),
    reported_count("reads", "parts that have become the nearest one")};

bool same(const Pose& a, const Pose& b) {
  return a.p == b.p && a.R == b.R;
}

void describe(Fields& f, SensorPlace& s) {
  NameOf places = f.name_of({"parts", "grounds", "grippers", "robots"}, "a part, ground, gripper or robot");
  f.field(
      "at", s.at, places,
      "What carries the sensor: a part, ground or gripper, or the flange of a robot; without it: the world.");
  f.pose("pose", s.X_PS, "Pose of the sensor in the frame of what carries it.");
}

void describe_grounds(Fields& f, bool& sees_grounds) {
  f.field("sees_grounds", sees_grounds, Flag{}, "Grounds count as parts and grippers do.");
}

struct Seen {
  bool parts = true, grippers = true, grounds = true;
};

/// Adds the sensor with its carrier and the bodies that it sees.
void add(const SensorPlace& place, Seen seen, SceneSensorParameters& p,
         std::vector<SignalDescription> signals, const std::vector<double>& initial, DeviceBuilder& b) {
  const CellDescription& cell = b.cell.description;
  p.X_PS = place.X_PS;
  p.robot = cell.find_robot(place.at);
  p.component = p.robot >= 0 ? -1 : cell.find_component(place.at);
  auto& model = b.mechanism<SceneSensors>();
  model.meshes.resize(b.cell.components.size());
  for (std::size_t c = 0; c < b.cell.components.size(); ++c) {
    const Component& component = b.cell.components[c];
    const auto id = static_cast<int>(c);
    bool sees = component.type == ComponentType::part     ? seen.parts
                : component.type == ComponentType::ground ? seen.grounds
                                                          : seen.grippers;
    sees = sees && id != p.component;
    if (component.type == ComponentType::gripper) {
      const GripperDescription& gripper = cell.grippers[static_cast<std::size_t>(component.gripper)];
      sees = sees && gripper.component != p.component && (p.robot < 0 || gripper.robot != p.robot);
    }
    if (!sees) continue;
    p.seen.push_back(id);
    if (model.meshes[c] != nullptr || p.kind == Kind::reader) continue;
    const SharedMesh* mesh = b.meshes[c].get();
    const auto made = std::find_if(model.shared.begin(), model.shared.end(),
                                   [&](const auto& entry) { return entry.first == mesh; });
    if (made != model.shared.end()) {
      model.meshes[c] = model.meshes[made->second];
    } else {
      model.meshes[c] = std::make_shared<const MeshRays>(mesh->mesh());
      model.shared.emplace_back(mesh, c);
    }
  }
  p.device = b.add_signal_table(p, std::move(signals), initial);
  DeviceDescription& description = b.cell.description.devices.back();
  if (p.robot >= 0) {
    description.robot = p.robot;
    description.X_FD = p.X_PS;
  }
  model.sensors.push_back(p);
}

}  // namespace

void describe(Fields& f, ScenarioLightBarrier& s) {
  describe(f, s.place);
  f.field("from_m", s.from, vector3("m"), "One end of the beam, in the frame of the sensor.", kRequired);
  f.field("to_m", s.to, vector3("m"), "The other end.", kRequired);
  f.check((s.to - s.from).norm() > 1e-6, "to_m", "the same point as from_m", "two points that are apart");
  describe_grounds(f, s.sees_grounds);
  describe_delays(f, s.output);
}

void build(const ScenarioLightBarrier& s, DeviceBuilder& b) {
  SceneSensorParameters p;
  p.kind = Kind::barrier;
  p.from = s.from;
  p.to = s.to;
  p.output = s.output;
  add(s.place, {true, true, s.sees_grounds}, p, described(kBarrierSignals), {1.0, 0.0}, b);
}

DeviceType light_barrier_type() {
  return device_type<ScenarioLightBarrier>(
      DeviceType::Owner::cell, "light_barriers", "Light barriers.",
      "A beam without width between two points; blocked where the mesh of a part or gripper crosses it or "
      "surrounds it.",
      false, kBarrierSignals);
}

void describe(Fields& f, ScenarioLightCurtain& s) {
  describe(f, s.place);
  f.field("width_m", s.width_m, positive("m"),
          "Length of the beams. They lie along the x axis of the sensor, the first one from its origin.",
          kRequired);
  f.field("beams", s.beams, WholeRange{2, kMostBeams}, "Number of the beams.", kRequired);
  f.field("pitch_m", s.pitch_m, positive("m"), "From beam to beam, along the z axis of the sensor.",
          kRequired);
  describe_grounds(f, s.sees_grounds);
  describe_delays(f, s.output);
}

void build(const ScenarioLightCurtain& s, DeviceBuilder& b) {
  SceneSensorParameters p;
  p.kind = Kind::curtain;
  p.to = {s.width_m, 0.0, 0.0};
  p.pitch = {0.0, 0.0, s.pitch_m};
  p.beams = s.beams;
  p.output = s.output;
  add(s.place, {true, true, s.sees_grounds}, p, described(kCurtainSignals), {1.0, 0.0, 0.0, 0.0}, b);
}

DeviceType light_curtain_type() {
  return device_type<ScenarioLightCurtain>(DeviceType::Owner::cell, "light_curtains", "Light curtains.",
                                           "Parallel beams as one device; blocked while the mesh of a part "
                                           "or gripper breaks one. `muting` holds the "
                                           "output clear.",
                                           false, kCurtainSignals);
}

void describe(Fields& f, ScenarioProximityBox& s) {
  describe(f, s.place);
  f.field("size_m", s.size_m, Vector3{positive("m")}, "Extents of the box, around the origin of the sensor.",
          kRequired);
  f.field("hysteresis_m", s.hysteresis_m, not_negative("m"),
          "While it detects, the box is larger by this on every side.");
  describe_grounds(f, s.sees_grounds);
  describe_delays(f, s.output);
}

void build(const ScenarioProximityBox& s, DeviceBuilder& b) {
  SceneSensorParameters p;
  p.kind = Kind::box;
  p.half_m = 0.5 * s.size_m;
  p.hysteresis_m = s.hysteresis_m;
  // look() gives 0 inside the box, 0.5 inside the larger one, else 1.
  p.output = s.output;
  p.output.below = true;
  p.output.threshold = 0.25;
  p.output.hysteresis = 0.5;
  add(s.place, {true, true, s.sees_grounds}, p, described(kBoxSignals), {0.0}, b);
}

DeviceType proximity_box_type() {
  return device_type<ScenarioProximityBox>(DeviceType::Owner::cell, "proximity_boxes", "Proximity switches.",
                                           "Detects when the mesh of a part or gripper reaches into a box.",
                                           false, kBoxSignals);
}

void describe(Fields& f, ScenarioDistanceSensor& s) {
  describe(f, s.place);
  f.field("range_m", s.range_m, positive("m"), "Length of the ray, along the z axis of the sensor.",
          kRequired);
  describe_grounds(f, s.sees_grounds);
  describe(f, s.measuring, {"m", "noise_m", "resolution_m"});
  f.field("switch_m", s.switch_m, positive("m"),
          "`near` is on up to this distance; without it: it is always off.");
  f.field("hysteresis_m", s.hysteresis_m, not_negative("m"), "Further than that it goes off again.");
  describe_delays(f, s.output);
}

void build(const ScenarioDistanceSensor& s, DeviceBuilder& b) {
  SceneSensorParameters p;
  p.kind = Kind::distance;
  p.range_m = s.range_m;
  p.to = {0.0, 0.0, s.range_m};
  p.measuring = s.measuring;
  p.switches = s.switch_m.has_value();
  p.output = s.output;
  p.output.below = true;
  p.output.threshold = s.switch_m.value_or(0.0);
  p.output.hysteresis = s.hysteresis_m;
  add(s.place, {true, true, s.sees_grounds}, p, described(kDistanceSignals), {s.range_m, 0.0, 0.0}, b);
}

DeviceType distance_sensor_type() {
  return device_type<ScenarioDistanceSensor>(
      DeviceType::Owner::cell, "distance_sensors", "Distance sensors.",
      "Distance of the nearest mesh on a ray along the z axis of the sensor; without one: the range.", false,
      kDistanceSignals);
}

void describe(Fields& f, ScenarioIdentificationReader& s) {
  describe(f, s.place);
  f.field("range_m", s.range_m, positive("m"),
          "Largest distance of the centre of mass of a part from the origin of the sensor.", kRequired);
  f.field("hysteresis_m", s.hysteresis_m, not_negative("m"), "Further than that the part is lost again.");
  describe_delays(f, s.output);
}

void build(const ScenarioIdentificationReader& s, DeviceBuilder& b) {
  SceneSensorParameters p;
  p.kind = Kind::reader;
  p.range_m = s.range_m;
  p.hysteresis_m = s.hysteresis_m;
  p.output = s.output;
  add(s.place, {true, false, false}, p, described(kReaderSignals), {-1.0, 0.0, 0.0}, b);
}

DeviceType identification_reader_type() {
  return device_type<ScenarioIdentificationReader>(
      DeviceType::Owner::cell, "identification_readers", "Readers of identification (RFID).",
      "Reads the number of the nearest part in range: its index among the components.", false,
      kReaderSignals);
}

SceneSensors::SceneSensors(const Model& model) : model_(model) {
  for (const SceneSensorParameters& p : model.sensors) {
    Sensor sensor;
    sensor.measuring = MeasuringFilter(p.measuring);
    sensor.output = SwitchFilter(p.output);
    sensor.values.assign(p.seen.size(), kNone);
    if (p.kind == Kind::curtain) sensor.broken.assign(p.seen.size(), 0);
    sensors_.push_back(std::move(sensor));
  }
  last_.resize(model.meshes.size());
  moved_.assign(model.meshes.size(), 0);
  moved_list_.reserve(model.meshes.size());
  watched_.reserve(model.meshes.size());
}

void SceneSensors::start(ComponentInteraction&) {
  for (Sensor& sensor : sensors_) {
    sensor.measuring.reset();
    sensor.output.reset();
    sensor.reads = 0.0;
    sensor.read = -1;
  }
  all_ = true;
  starting_ = true;
}

void SceneSensors::note_moved(const CellMotion& motion, const CellPlant& plant) {
  for (const int c : moved_list_) moved_[static_cast<std::size_t>(c)] = 0;
  moved_list_.clear();
  const auto note = [&](int component) {
    const auto c = static_cast<std::size_t>(component);
    if (moved_[c] != 0 || same(last_[c], motion.bodies[c].X_WB)) return;
    last_[c] = motion.bodies[c].X_WB;
    moved_[c] = 1;
    moved_list_.push_back(component);
  };
  if (all_)
    for (std::size_t c = 0; c < last_.size(); ++c) last_[c] = motion.bodies[c].X_WB;
  // A body that has just come to rest moved in its last step.
  for (const int component : watched_) note(component);
  const std::span<const int> active = plant.system().active_bodies();
  for (const int component : active) note(component);
  watched_.assign(active.begin(), active.end());
}

double SceneSensors::look(const SceneSensorParameters& p, const Sensor& sensor, int component,
                          const CellMotion& motion) const {
  const auto c = static_cast<std::size_t>(component);
  const BodyMotion& body = motion.bodies[c];
  if (p.kind == Kind::reader) return (body.p_WBcm - sensor.X_WS.p).norm();
  const MeshRays& mesh = *model_.meshes[c];
  const Aabb around = mesh.bounds().at(body.X_WB, 0.0);
  const double nothing = p.kind == Kind::distance ? kNone : 1.0;
  if (p.kind == Kind::box) {
    const Vec3 larger = p.half_m + Vec3::Constant(p.hysteresis_m);
    if (!around.overlaps(BodyBox{Vec3::Zero(), larger}.at(sensor.X_WS, 0.0))) return nothing;
    const Pose X_BS = body.X_WB.inverse() * sensor.X_WS;
    if (mesh.meets_box(X_BS, p.half_m)) return 0.0;
    return p.hysteresis_m > 0.0 && mesh.meets_box(X_BS, larger) ? 0.5 : nothing;
  }
  const Vec3 from = sensor.X_WS * p.from, to = sensor.X_WS * p.to;
  if (!around.overlaps({from.cwiseMin(to), from.cwiseMax(to)})) return nothing;
  const Pose X_BW = body.X_WB.inverse();
  if (p.kind == Kind::barrier) return mesh.meets_segment(X_BW * from, X_BW * to) ? 0.0 : nothing;
  const double share = mesh.first_hit(X_BW * from, X_BW * to);
  return share <= 1.0 ? share * p.range_m : nothing;
}

std::uint64_t SceneSensors::broken_by(const SceneSensorParameters& p, const Sensor& sensor, int component,
                                      const CellMotion& motion) const {
  const auto c = static_cast<std::size_t>(component);
  const MeshRays& mesh = *model_.meshes[c];
  const Aabb around = mesh.bounds().at(motion.bodies[c].X_WB, 0.0);
  const Pose X_BW = motion.bodies[c].X_WB.inverse();
  std::uint64_t broken = 0;
  for (int beam = 0; beam < p.beams; ++beam) {
    const Vec3 up = beam * p.pitch, from = sensor.X_WS * (p.from + up), to = sensor.X_WS * (p.to + up);
    if (around.overlaps({from.cwiseMin(to), from.cwiseMax(to)}) && mesh.meets_segment(X_BW * from, X_BW * to))
      broken |= std::uint64_t{1} << static_cast<unsigned>(beam);
  }
  return broken;
}

bool SceneSensors::look_again(const SceneSensorParameters& p, Sensor& sensor, const CellMotion& motion) {
  Pose X_WS = p.X_PS;
  if (p.robot >= 0) X_WS = motion.arms[static_cast<std::size_t>(p.robot)].X_WF * p.X_PS;
  if (p.component >= 0) X_WS = motion.bodies[static_cast<std::size_t>(p.component)].X_WB * p.X_PS;
  const bool whole = all_ || !same(X_WS, sensor.X_WS);
  if (!whole && moved_list_.empty()) return false;
  sensor.X_WS = X_WS;
  bool changed = false;
  for (std::size_t i = 0; i < p.seen.size(); ++i) {
    if (!whole && moved_[static_cast<std::size_t>(p.seen[i])] == 0) continue;
    if (p.kind == Kind::curtain) {
      const std::uint64_t broken = broken_by(p, sensor, p.seen[i], motion);
      changed |= broken != sensor.broken[i];
      sensor.broken[i] = broken;
      sensor.values[i] = broken != 0 ? 0.0 : 1.0;
      continue;
    }
    const double value = look(p, sensor, p.seen[i], motion);
    changed |= value != sensor.values[i];
    sensor.values[i] = value;
  }
  if (!changed && !whole) return false;
  const auto nearest = std::min_element(sensor.values.begin(), sensor.values.end());
  sensor.nearest_seen =
      nearest == sensor.values.end() ? -1 : static_cast<int>(nearest - sensor.values.begin());
  sensor.nearest = nearest == sensor.values.end() ? kNone : *nearest;
  return true;
}

void SceneSensors::report(const SceneSensorParameters& p, Sensor& sensor, double h, bool looked,
                          CellPlant& plant) const {
  SignalTable& signals = signal_table(plant, p.device);
  switch (p.kind) {
    case Kind::barrier: {
      const bool on = sensor.output.sample_flag(sensor.nearest == 0.0, h);
      signals.report(blocked, on ? 1.0 : 0.0);
      signals.report(clear, on ? 0.0 : 1.0);
      break;
    }
    case Kind::curtain: {
      std::uint64_t broken = 0;
      for (const std::uint64_t beams : sensor.broken) broken |= beams;
      const bool on = sensor.output.sample_flag(broken != 0 && signals.value(muting) == 0.0, h);
      signals.report(blocked, on ? 1.0 : 0.0);
      signals.report(clear, on ? 0.0 : 1.0);
      signals.report(broken_beams, std::popcount(broken));
      break;
    }
    case Kind::box:
      signals.report(detected, sensor.output.sample(std::min(sensor.nearest, 1.0), h) ? 1.0 : 0.0);
      break;
    case Kind::distance: {
      const double measured =
          std::clamp(sensor.measuring.sample(std::min(sensor.nearest, p.range_m), h), 0.0, p.range_m);
      signals.report(distance, measured);
      signals.report(in_range, sensor.nearest <= p.range_m ? 1.0 : 0.0);
      if (p.switches) signals.report(near, sensor.output.sample(measured, h) ? 1.0 : 0.0);
      break;
    }
    case Kind::reader: {
      if (looked) {
        const int before = sensor.read;
        const auto at = [&](int component) {
          const auto place = std::lower_bound(p.seen.begin(), p.seen.end(), component) - p.seen.begin();
          return sensor.values[static_cast<std::size_t>(place)];
        };
        if (sensor.nearest <= p.range_m)
          sensor.read = p.seen[static_cast<std::size_t>(sensor.nearest_seen)];
        else if (sensor.read >= 0 && !(at(sensor.read) <= p.range_m + p.hysteresis_m))
          sensor.read = -1;
        if (sensor.read >= 0 && sensor.read != before) sensor.reads += 1.0;
      }
      const bool on = sensor.output.sample_flag(sensor.read >= 0, h);
      signals.report(present, on ? 1.0 : 0.0);
      signals.report(part, on ? sensor.read : -1.0);
      signals.report(reads, sensor.reads);
      break;
    }
  }
}

bool SceneSensors::update(double h, const CellMotion& motion, CellPlant& plant, ComponentInteraction&) {
  // The first step looks at the same motion again.
  const bool initial = std::exchange(starting_, false);
  note_moved(motion, plant);
  for (std::size_t i = 0; i < sensors_.size(); ++i) {
    const bool looked = look_again(model_.sensors[i], sensors_[i], motion);
    report(model_.sensors[i], sensors_[i], h, looked, plant);
    if (initial) sensors_[i].measuring.reset();
  }
  all_ = false;
  return false;
}

void SceneSensors::save(StateWriter& out) const {
  for (const Sensor& sensor : sensors_) {
    sensor.measuring.save(out);
    sensor.output.save(out);
    out.put(sensor.reads), out.put(sensor.read);
  }
  out.put(starting_);
}

void SceneSensors::load(StateReader& in) {
  for (std::size_t i = 0; i < sensors_.size(); ++i) {
    Sensor& sensor = sensors_[i];
    sensor.measuring.load(in);
    sensor.output.load(in);
    sensor.reads = in.number(0.0, 1e15, "a number of reads");
    const std::vector<int>& seen = model_.sensors[i].seen;
    sensor.read = in.index(model_.meshes.size(), "a Part that is read");
    if (sensor.read >= 0 && std::find(seen.begin(), seen.end(), sensor.read) == seen.end())
      in.fail("a reader has no Part");
  }
  starting_ = in.flag("'sensors start'");
  all_ = true;
}

}  // namespace takt
