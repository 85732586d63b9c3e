#include "client_lib/view/scene_channel.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>

#include "client_lib/recording/cdr.h"

namespace takt::view {

using recording::CdrWriter;
using recording::Json;

namespace {

constexpr std::chrono::milliseconds kPeriod{50};
constexpr double kMetresPerNewton = 0.01;
constexpr const char* kWorld = "world";

/// Foxglove's messages, as far as they are needed to write a SceneUpdate and FrameTransforms
/// (foxglove/foxglove-sdk, schemas; MIT).
constexpr std::string_view kFoxgloveMessages = R"(
module geometry_msgs { module msg {
@final struct Point { double x; double y; double z; };
@final struct Vector3 { double x; double y; double z; };
@final struct Quaternion { double x; double y; double z; double w; };
@final struct Pose { Point position; Quaternion orientation; };
}; };
module builtin_interfaces { module msg {
@final struct Time { long sec; unsigned long nanosec; };
@final struct Duration { long sec; unsigned long nanosec; };
}; };
module foxglove_msgs { module msg {
@final struct Color { double r; double g; double b; double a; };
@final struct KeyValuePair { string key; string value; };
@final struct ArrowPrimitive { geometry_msgs::msg::Pose pose; double shaft_length; double shaft_diameter;
  double head_length; double head_diameter; Color color; };
@final struct CubePrimitive { geometry_msgs::msg::Pose pose; geometry_msgs::msg::Vector3 size; Color color; };
@final struct SpherePrimitive { geometry_msgs::msg::Pose pose; geometry_msgs::msg::Vector3 size; Color color; };
@final struct CylinderPrimitive { geometry_msgs::msg::Pose pose; geometry_msgs::msg::Vector3 size;
  double bottom_scale; double top_scale; Color color; };
@final struct LinePrimitive { octet type; geometry_msgs::msg::Pose pose; double thickness; boolean scale_invariant;
  sequence<geometry_msgs::msg::Point> points; Color color; sequence<Color> colors;
  sequence<unsigned long> indices; };
@final struct TriangleListPrimitive { geometry_msgs::msg::Pose pose; sequence<geometry_msgs::msg::Point> points;
  Color color; sequence<Color> colors; sequence<unsigned long> indices; };
@final struct TextPrimitive { geometry_msgs::msg::Pose pose; boolean billboard; double font_size;
  boolean scale_invariant; Color color; string text; };
@final struct ModelPrimitive { geometry_msgs::msg::Pose pose; geometry_msgs::msg::Vector3 scale; Color color;
  boolean override_color; string url; string media_type; sequence<octet> data; };
@final struct SceneEntityDeletion { builtin_interfaces::msg::Time timestamp; octet type; string id; };
@final struct SceneEntity { builtin_interfaces::msg::Time timestamp; string frame_id; string id;
  builtin_interfaces::msg::Duration lifetime; boolean frame_locked; sequence<KeyValuePair> metadata;
  sequence<ArrowPrimitive> arrows; sequence<CubePrimitive> cubes; sequence<SpherePrimitive> spheres;
  sequence<CylinderPrimitive> cylinders; sequence<LinePrimitive> lines;
  sequence<TriangleListPrimitive> triangles; sequence<TextPrimitive> texts; sequence<ModelPrimitive> models; };
@final struct SceneUpdate { sequence<SceneEntityDeletion> deletions; sequence<SceneEntity> entities; };
@final struct FrameTransform { builtin_interfaces::msg::Time timestamp; string parent_frame_id;
  string child_frame_id; geometry_msgs::msg::Vector3 translation; geometry_msgs::msg::Quaternion rotation; };
@final struct FrameTransforms { sequence<FrameTransform> transforms; };
}; };
)";

void put_time(CdrWriter& out, std::uint64_t ns) {
  out.put(static_cast<std::int32_t>(ns / 1'000'000'000U));
  out.put(static_cast<std::uint32_t>(ns % 1'000'000'000U));
}

void put(CdrWriter& out, std::initializer_list<double> values) {
  for (const double value : values) out.put(value);
}

void put_members(CdrWriter& out, const Json& object, std::initializer_list<const char*> names) {
  for (const char* name : names) out.put(object.at(name).get<double>());
}

/// An entity up to its primitives.
void begin_entity(CdrWriter& out, std::uint64_t time_ns, const std::string& frame, const std::string& id) {
  put_time(out, time_ns);
  out.put(frame);
  out.put(id);
  put_time(out, 0);
  out.put(std::uint8_t{1});
  out.count(0);
}

/// Blue where there is next to no pressure, over green and yellow to red at the largest.
std::array<double, 3> color_of(double part) {
  constexpr std::array<std::array<double, 3>, 5> colors{
      {{0.17, 0.24, 1.0}, {0.09, 0.72, 0.85}, {0.18, 0.75, 0.29}, {0.95, 0.82, 0.11}, {0.89, 0.14, 0.10}}};
  const double at = std::clamp(part, 0.0, 1.0) * static_cast<double>(colors.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(at), colors.size() - 2);
  const double beyond = at - static_cast<double>(i);
  std::array<double, 3> color{};
  for (std::size_t k = 0; k < 3; ++k) color[k] = (1.0 - beyond) * colors[i][k] + beyond * colors[i + 1][k];
  return color;
}

std::string frame_of(const Json& component) {
  return "takt/" + component.at("name").get<std::string>();
}

/// Rotation that takes the x axis, along which Foxglove's arrows point, into a direction.
std::array<double, 4> rotation_to(double x, double y, double z) {
  if (x < -0.999999) return {0.0, 0.0, 1.0, 0.0};
  const double w = std::sqrt(2.0 * (1.0 + x));
  return {0.0, -z / w, y / w, 0.5 * w};
}

}  // namespace

SceneChannel::SceneChannel(Stream& stream) : stream_(stream) {
  recording::MessageTypes types;
  types.add_idl(kFoxgloveMessages);
  const auto add = [&](const char* topic, const char* type) {
    return stream_.add_channel({0, topic, "cdr", type, "ros2msg", types.ros2msg(type), false});
  };
  scene_ = add("/takt/scene", "foxglove_msgs/msg/SceneUpdate");
  frames_ = add("/takt/frames", "foxglove_msgs/msg/FrameTransforms");
  forces_ = add("/takt/forces", "foxglove_msgs/msg/SceneUpdate");
  pressures_ = add("/takt/pressures", "foxglove_msgs/msg/SceneUpdate");
  stream_.on_wanted(this, [this](const Channel& channel, bool wanted) {
    if (channel.id != scene_ && channel.id != frames_ && channel.id != forces_ && channel.id != pressures_)
      return;
    const std::lock_guard lock(mutex_);
    wanted_ += wanted ? 1 : -1;
    if (channel.id == pressures_) pressures_wanted_ += wanted ? 1 : -1;
    changed_.notify_all();
  });
  thread_ = std::thread([this] { run(); });
}

SceneChannel::~SceneChannel() {
  stream_.forget(this);
  {
    const std::lock_guard lock(mutex_);
    over_ = true;
    changed_.notify_all();
  }
  thread_.join();
}

void SceneChannel::run() {
  std::unique_lock lock(mutex_);
  while (!over_) {
    if (wanted_ == 0) {
      const bool was = follows_state_;
      lock.unlock();
      if (was) stream_.set_wanted(state_channel_, false);
      follow_pressures(false);
      lock.lock();
      follows_state_ = false;
      changed_.wait(lock, [&] { return over_ || wanted_ > 0; });
      continue;
    }
    const bool pressures = pressures_wanted_ > 0;
    lock.unlock();
    try {
      follow();
      follow_pressures(pressures);
    } catch (const std::exception& error) {
      // Anybody in the network may send such a sample, and the next is a whole one again: told once.
      if (!complained_) std::fprintf(stderr, "takt: note: a sample cannot be drawn: %s\n", error.what());
      complained_ = true;
    }
    lock.lock();
    changed_.wait_for(lock, kPeriod, [&] { return over_ || wanted_ == 0; });
  }
}

void SceneChannel::find_sources() {
  for (const Channel& channel : stream_.channels_from(0)) {
    if (channel.type == "takt_msgs/msg/CellDescription") description_channel_ = channel.id;
    if (channel.type == "takt_msgs/msg/CellState") state_channel_ = channel.id;
    if (channel.type == "takt_msgs/msg/ContactPressures") pressures_channel_ = channel.id;
  }
}

void SceneChannel::follow() {
  if (description_channel_ == 0 || state_channel_ == 0) find_sources();
  if (description_channel_ == 0 || state_channel_ == 0) return;
  if (!follows_state_) {
    stream_.set_wanted(state_channel_, true);
    follows_state_ = true;
  }
  const auto& types = recording::known_types();
  const Sample description = stream_.newest(description_channel_);
  if (description.bytes && description.number != description_number_) {
    description_number_ = description.number;
    description_ = recording::to_json(types, "takt_msgs/msg/CellDescription", *description.bytes);
    make_scene(description.time_ns);
  }
  const Sample sample = stream_.newest(state_channel_);
  if (!sample.bytes || sample.number == state_number_ || description_.is_null()) return;
  state_number_ = sample.number;
  const Json state = recording::to_json(types, "takt_msgs/msg/CellState", *sample.bytes);
  if (state.at("components").size() != description_.at("components").size()) return;
  make_frames(state, sample.time_ns);
  make_forces(state, sample.time_ns);
}

void SceneChannel::follow_pressures(bool wanted) {
  if (wanted && pressures_channel_ == 0) find_sources();
  if (pressures_channel_ == 0) return;
  if (wanted != follows_pressures_) {
    stream_.set_wanted(pressures_channel_, wanted);
    follows_pressures_ = wanted;
  }
  if (!wanted || description_.is_null()) return;
  const Sample sample = stream_.newest(pressures_channel_);
  if (!sample.bytes || sample.number == pressures_number_) return;
  pressures_number_ = sample.number;
  make_pressures(
      recording::to_json(recording::known_types(), "takt_msgs/msg/ContactPressures", *sample.bytes),
      sample.time_ns);
}

void SceneChannel::make_scene(std::uint64_t time_ns) {
  CdrWriter out;
  out.count(1);  // what was shown before goes
  put_time(out, time_ns);
  out.put(std::uint8_t{1});
  out.put("");
  const Json& components = description_.at("components");
  out.count(components.size());
  for (const Json& component : components) {
    begin_entity(out, time_ns, frame_of(component), component.at("name").get<std::string>());
    for (int kind = 0; kind < 5; ++kind) out.count(0);
    out.count(1);
    put(out, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0});
    const Json &vertices = component.at("vertices"), &color = component.at("color");
    out.count(vertices.size() / 3);
    for (const Json& value : vertices) out.put(value.get<double>());
    for (std::size_t i = 0; i < 4; ++i) out.put(i < color.size() ? color[i].get<double>() : 1.0);
    out.count(0);
    const Json& triangles = component.at("triangles");
    out.count(triangles.size());
    for (const Json& index : triangles) out.put(index.get<std::uint32_t>());
    out.count(0);
    out.count(0);
  }
  stream_.push(scene_, time_ns, out.bytes());
}

void SceneChannel::make_frames(const Json& state, std::uint64_t time_ns) {
  CdrWriter out;
  const Json &components = description_.at("components"), &samples = state.at("components");
  out.count(components.size());
  for (std::size_t i = 0; i < components.size(); ++i) {
    put_time(out, time_ns);
    out.put(kWorld);
    out.put(frame_of(components[i]));
    put_members(out, samples[i].at("position"), {"x", "y", "z"});
    put_members(out, samples[i].at("orientation"), {"x", "y", "z", "w"});
  }
  stream_.push(frames_, time_ns, out.bytes());
}

void SceneChannel::make_forces(const Json& state, std::uint64_t time_ns) {
  CdrWriter out;
  out.count(0);
  const Json &components = description_.at("components"), &samples = state.at("components");
  const auto is_part = [](const Json& component) { return component.at("type") == 0; };
  out.count(static_cast<std::size_t>(std::count_if(components.begin(), components.end(), is_part)));
  for (std::size_t i = 0; i < components.size(); ++i) {
    if (!is_part(components[i])) continue;
    begin_entity(out, time_ns, kWorld, "force on " + components[i].at("name").get<std::string>());
    const Json& f = samples[i].at("force");
    const double x = f.at("x"), y = f.at("y"), z = f.at("z");
    const double size = std::sqrt(x * x + y * y + z * z), length = kMetresPerNewton * size;
    const bool seen = length > 1e-3;
    out.count(seen ? 1 : 0);
    if (seen) {
      put_members(out, samples[i].at("position"), {"x", "y", "z"});
      for (const double value : rotation_to(x / size, y / size, z / size)) out.put(value);
      const double head = std::min(0.03, 0.5 * length);
      put(out, {length - head, 0.008, head, 0.02, 0.84, 0.13, 0.31, 1.0});
    }
    for (int kind = 0; kind < 7; ++kind) out.count(0);
  }
  stream_.push(forces_, time_ns, out.bytes());
}

/// One entity of coloured triangles for each pair, in the frame of its base; what pressed before goes.
void SceneChannel::make_pressures(const Json& sample, std::uint64_t time_ns) {
  CdrWriter out;
  out.count(1);
  put_time(out, time_ns);
  out.put(std::uint8_t{1});
  out.put("");
  const Json &components = description_.at("components"), &pairs = sample.at("pairs");
  const auto component = [&](const Json& pair, const char* side) -> const Json& {
    return components.at(pair.at(side).get<std::size_t>());
  };
  out.count(pairs.size());
  for (const Json& pair : pairs) {
    const Json &base = component(pair, "base"), &target = component(pair, "target");
    begin_entity(
        out, time_ns, frame_of(base),
        "pressure " + base.at("name").get<std::string>() + "-" + target.at("name").get<std::string>());
    for (int kind = 0; kind < 5; ++kind) out.count(0);
    out.count(1);
    put(out, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0});
    const Json &corners = pair.at("corners"), &pressures = pair.at("pressures");
    out.count(corners.size() / 3);
    for (const Json& value : corners) out.put(value.get<double>());
    put(out, {1.0, 1.0, 1.0, 1.0});
    out.count(3 * pressures.size());
    const double largest = std::max(pair.at("largest_pressure").get<double>(), 1e-300);
    for (const Json& pressure : pressures) {
      const std::array<double, 3> color = color_of(pressure.get<double>() / largest);
      for (int corner = 0; corner < 3; ++corner) put(out, {color[0], color[1], color[2], 1.0});
    }
    out.count(0);
    out.count(0);
    out.count(0);
  }
  stream_.push(pressures_, time_ns, out.bytes());
}

}  // namespace takt::view
