#include "client_lib/view/scene_channel.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>

#include "client_lib/recording/message_types.h"
#include "foxglove_msgs.h"
#include "idl/common/cdr.h"
#include "idl/common/frames.h"

namespace takt::view {

namespace {

constexpr std::chrono::milliseconds kPeriod{50};
constexpr double kMetresPerNewton = 0.01;

builtin_interfaces::msg::Time to_time(std::uint64_t ns) {
  return {static_cast<std::int32_t>(ns / 1'000'000'000U), static_cast<std::uint32_t>(ns % 1'000'000'000U)};
}

geometry_msgs::msg::Vector3 to_vector(const takt_msgs::msg::Vector3& v) {
  return {v.x, v.y, v.z};
}

/// An entity without primitives.
foxglove_msgs::msg::SceneEntity entity(std::uint64_t time_ns, std::string frame, std::string id) {
  foxglove_msgs::msg::SceneEntity made;
  made.timestamp = to_time(time_ns);
  made.frame_id = std::move(frame);
  made.id = std::move(id);
  made.frame_locked = true;
  return made;
}

/// Removes what is shown.
foxglove_msgs::msg::SceneUpdate fresh_scene(std::uint64_t time_ns) {
  constexpr std::uint8_t kAll = 1;
  foxglove_msgs::msg::SceneUpdate update;
  update.deletions.push_back({to_time(time_ns), kAll, ""});
  return update;
}

std::vector<geometry_msgs::msg::Point> points_of(const std::vector<float>& coordinates) {
  std::vector<geometry_msgs::msg::Point> points(coordinates.size() / 3);
  for (std::size_t i = 0; i < points.size(); ++i)
    points[i] = {coordinates[3 * i], coordinates[3 * i + 1], coordinates[3 * i + 2]};
  return points;
}

/// Blue where there is next to no pressure, over green and yellow to red at the largest.
foxglove_msgs::msg::Color color_of(double part) {
  constexpr std::array<std::array<double, 3>, 5> colors{
      {{0.17, 0.24, 1.0}, {0.09, 0.72, 0.85}, {0.18, 0.75, 0.29}, {0.95, 0.82, 0.11}, {0.89, 0.14, 0.10}}};
  const double at = std::clamp(part, 0.0, 1.0) * static_cast<double>(colors.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(at), colors.size() - 2);
  const double beyond = at - static_cast<double>(i);
  const auto mixed = [&](std::size_t k) { return (1.0 - beyond) * colors[i][k] + beyond * colors[i + 1][k]; };
  return {mixed(0), mixed(1), mixed(2), 1.0};
}

std::string frame_of(const takt_msgs::msg::ComponentDescription& component) {
  return "takt/" + component.name;
}

template <typename Message>
Message read(const std::string& sample) {
  Message message;
  if (!cdr::read(std::span(reinterpret_cast<const std::uint8_t*>(sample.data()), sample.size()), message))
    throw recording::RecordingError("it is no sample of " + std::string(message_info<Message>().name));
  return message;
}

/// Rotation that takes the x axis, along which Foxglove's arrows point, into a direction.
geometry_msgs::msg::Quaternion rotation_to(double x, double y, double z) {
  if (x < -0.999999) return {0.0, 0.0, 1.0, 0.0};
  const double w = std::sqrt(2.0 * (1.0 + x));
  return {0.0, -z / w, y / w, 0.5 * w};
}

}  // namespace

SceneChannel::SceneChannel(Stream& stream) : stream_(stream) {
  recording::MessageTypes types;
  const auto add = [&](const char* topic, const MessageInfo& message) {
    types.add(message);
    const std::string type(message.name);
    return stream_.add_channel({0, topic, "cdr", type, "ros2msg", types.ros2msg(type), false});
  };
  scene_ = add("/takt/scene", message_info<foxglove_msgs::msg::SceneUpdate>());
  frames_ = add("/takt/frames", message_info<foxglove_msgs::msg::FrameTransforms>());
  forces_ = add("/takt/forces", message_info<foxglove_msgs::msg::SceneUpdate>());
  pressures_ = add("/takt/pressures", message_info<foxglove_msgs::msg::SceneUpdate>());
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
      // Any participant in the network may send an invalid sample, and the next may be valid: one note is enough.
      if (!complained_) std::fprintf(stderr, "takt: note: a sample cannot be drawn: %s\n", error.what());
      complained_ = true;
    }
    lock.lock();
    changed_.wait_for(lock, kPeriod, [&] { return over_ || wanted_ == 0; });
  }
}

void SceneChannel::find_sources() {
  for (const Channel& channel : stream_.channels_from(0)) {
    if (channel.type == message_info<takt_msgs::msg::CellDescription>().name)
      description_channel_ = channel.id;
    if (channel.type == message_info<takt_msgs::msg::CellState>().name) state_channel_ = channel.id;
    if (channel.type == message_info<takt_msgs::msg::ContactPressures>().name)
      pressures_channel_ = channel.id;
  }
}

void SceneChannel::follow() {
  if (description_channel_ == 0 || state_channel_ == 0) find_sources();
  if (description_channel_ == 0 || state_channel_ == 0) return;
  if (!follows_state_) {
    stream_.set_wanted(state_channel_, true);
    follows_state_ = true;
  }
  const Sample description = stream_.newest(description_channel_);
  if (description.bytes && description.number != description_number_) {
    description_number_ = description.number;
    description_ = read<takt_msgs::msg::CellDescription>(*description.bytes);
    make_scene(description.time_ns);
  }
  const Sample sample = stream_.newest(state_channel_);
  if (!sample.bytes || sample.number == state_number_ || !description_) return;
  state_number_ = sample.number;
  const auto state = read<takt_msgs::msg::CellState>(*sample.bytes);
  if (state.components.size() != description_->components.size()) return;
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
  if (!wanted || !description_) return;
  const Sample sample = stream_.newest(pressures_channel_);
  if (!sample.bytes || sample.number == pressures_number_) return;
  pressures_number_ = sample.number;
  make_pressures(read<takt_msgs::msg::ContactPressures>(*sample.bytes), sample.time_ns);
}

template <typename Message>
void SceneChannel::push(std::uint32_t channel, std::uint64_t time_ns, const Message& message) {
  std::string bytes;
  if (cdr::write(message, bytes)) stream_.push(channel, time_ns, std::move(bytes));
}

void SceneChannel::make_scene(std::uint64_t time_ns) {
  foxglove_msgs::msg::SceneUpdate update = fresh_scene(time_ns);
  for (const auto& component : description_->components) {
    auto& made = update.entities.emplace_back(entity(time_ns, frame_of(component), component.name));
    auto& mesh = made.triangles.emplace_back();
    mesh.pose.orientation.w = 1.0;
    mesh.points = points_of(component.vertices);
    const auto shade = [&](std::size_t i) { return i < component.color.size() ? component.color[i] : 1.0; };
    mesh.color = {shade(0), shade(1), shade(2), shade(3)};
    mesh.indices = component.triangles;
  }
  push(scene_, time_ns, update);
}

void SceneChannel::make_frames(const takt_msgs::msg::CellState& state, std::uint64_t time_ns) {
  foxglove_msgs::msg::FrameTransforms frames;
  for (std::size_t i = 0; i < state.components.size(); ++i) {
    const auto& q = state.components[i].orientation;
    frames.transforms.push_back({to_time(time_ns),
                                 kWorldFrame,
                                 frame_of(description_->components[i]),
                                 to_vector(state.components[i].position),
                                 {q.x, q.y, q.z, q.w}});
  }
  push(frames_, time_ns, frames);
}

void SceneChannel::make_forces(const takt_msgs::msg::CellState& state, std::uint64_t time_ns) {
  foxglove_msgs::msg::SceneUpdate update;
  for (std::size_t i = 0; i < state.components.size(); ++i) {
    const auto& component = description_->components[i];
    if (component.type != ComponentType::part) continue;
    auto& made = update.entities.emplace_back(entity(time_ns, kWorldFrame, "force on " + component.name));
    const auto& f = state.components[i].force;
    const auto& p = state.components[i].position;
    const double size = std::sqrt(f.x * f.x + f.y * f.y + f.z * f.z), length = kMetresPerNewton * size;
    if (!(length > 1e-3)) continue;
    const double head = std::min(0.03, 0.5 * length);
    made.arrows.push_back({{{p.x, p.y, p.z}, rotation_to(f.x / size, f.y / size, f.z / size)},
                           length - head,
                           0.008,
                           head,
                           0.02,
                           {0.84, 0.13, 0.31, 1.0}});
  }
  push(forces_, time_ns, update);
}

/// One entity of coloured triangles for each pair, in the frame of its base; what pressed before goes.
void SceneChannel::make_pressures(const takt_msgs::msg::ContactPressures& sample, std::uint64_t time_ns) {
  foxglove_msgs::msg::SceneUpdate update = fresh_scene(time_ns);
  for (const auto& pair : sample.pairs) {
    const auto& base = description_->components.at(static_cast<std::size_t>(pair.base));
    const auto& target = description_->components.at(static_cast<std::size_t>(pair.target));
    auto& made = update.entities.emplace_back(
        entity(time_ns, frame_of(base), "pressure " + base.name + "-" + target.name));
    auto& mesh = made.triangles.emplace_back();
    mesh.pose.orientation.w = 1.0;
    mesh.points = points_of(pair.corners);
    mesh.color = {1.0, 1.0, 1.0, 1.0};
    const double largest = std::max(pair.largest_pressure, 1e-300);
    for (const float pressure : pair.pressures)
      mesh.colors.insert(mesh.colors.end(), 3, color_of(pressure / largest));
  }
  push(pressures_, time_ns, update);
}

}  // namespace takt::view
