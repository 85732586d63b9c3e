#include "client_lib/gateway/rsi/krc.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "idl/common/text.h"

namespace takt::gateway::rsi {
namespace {

constexpr std::array<const char*, 6> kPoseNames{"X", "Y", "Z", "A", "B", "C"};
constexpr std::size_t kMaxUnknown = 64;
/// Beyond any axis, pose and signal; sums of relative corrections stay finite.
constexpr double kMostValue = 1e9;

std::array<int, 6> channels_of(const Configuration& configuration, const std::string& element,
                               const char* letter) {
  std::array<int, 6> places{};
  for (std::size_t i = 0; i < 6; ++i)
    places[i] = Configuration::find(
        configuration.receive,
        element + "." + (letter == nullptr ? kPoseNames[i] : letter + std::to_string(i + 1)));
  return places;
}

bool any(const std::array<int, 6>& places) {
  return std::any_of(places.begin(), places.end(), [](int place) { return place >= 0; });
}

}  // namespace

Krc::Krc(Configuration configuration, const KrcOptions& options, PoseKinematics kinematics)
    : configuration_(std::move(configuration)),
      options_(options),
      kinematics_(std::move(kinematics)),
      axis_channels_(channels_of(configuration_, options_.axes_element, "A")),
      external_channels_(channels_of(configuration_, options_.external_axes_element, "E")),
      pose_channels_(channels_of(configuration_, options_.pose_element, nullptr)),
      stop_channel_(Configuration::find(configuration_.receive, "Stop")),
      has_pose_(any(pose_channels_)),
      values_(configuration_.receive.size(), 0.0) {
  const bool axes = any(axis_channels_) || any(external_channels_);
  if (has_pose_ && axes)
    throw ConfigurationError(
        "The list RECEIVE has corrections of axes and of the pose; takt applies one of the two. Remove one.");
  if (has_pose_ && (!kinematics_.forward || !kinematics_.inverse))
    throw ConfigurationError("The list RECEIVE has " + options_.pose_element +
                             ", which needs a robot of six joints. Correct axes.");
  if (!configuration_.only_send && !has_pose_ && !axes)
    throw ConfigurationError("The list RECEIVE has no correction. Allowed: " + options_.axes_element +
                             ".A1 to .A6, " + options_.external_axes_element + ".E1 to .E6, " +
                             options_.pose_element +
                             ".X to .C (other names: key elements of the mapping), or ONLYSEND TRUE for a "
                             "robot that only reports.");
}

void Krc::start(const Six& axes, const Six& external_axes) {
  start_axes_ = target_ = axes;
  start_external_axes_ = external_target_ = external_axes;
  if (has_pose_) start_pose_ = kinematics_.forward(axes);
  axis_sum_ = external_sum_ = {};
  translation_sum_ = Vec3::Zero();
  rotation_sum_ = Mat3::Identity();
  std::fill(values_.begin(), values_.end(), 0.0);
  late_ = packets_ = 0;
  awaiting_ = answered_ = heard_ = false;
  message_.clear();
  fault_.clear();
  reason_.clear();
  state_ = KrcState::running;
}

std::string Krc::begin_cycle(Rob measured) {
  ipoc_ = packets_ == 0 ? options_.first_ipoc : ipoc_ + static_cast<std::uint64_t>(options_.cycle_ms);
  ++packets_;
  measured.ipoc = ipoc_;
  measured.delay = late_;
  awaiting_ = running() && !configuration_.only_send;
  answered_ = false;
  return write_rob(configuration_, measured);
}

Taken Krc::answer(std::string_view bytes) {
  if (!awaiting_) return Taken::not_awaited;
  auto parsed = parse_sen(configuration_, bytes);
  for (std::string& name : parsed.unknown)
    if (unknown_.size() < kMaxUnknown && unknown_.insert(name).second)
      new_unknown_.push_back(std::move(name));
  if (!parsed.message) {
    fault_ = std::move(parsed.fault);
    return Taken::invalid;
  }
  if (parsed.message->ipoc != ipoc_) return Taken::other_ipoc;
  for (std::size_t i = 0; i < values_.size(); ++i) {
    if (std::abs(parsed.message->values[i].value_or(0.0)) <= kMostValue) continue;
    fault_ = configuration_.receive[i].tag + ": found " + number_text(*parsed.message->values[i]) +
             "; allowed: at most " + number_text(kMostValue);
    return Taken::invalid;
  }
  awaiting_ = false;
  answered_ = heard_ = true;
  if (!parsed.message->message.empty()) message_ = std::move(parsed.message->message);
  for (std::size_t i = 0; i < values_.size(); ++i) {
    const auto& value = parsed.message->values[i];
    if (value)
      values_[i] = *value;
    else if (!configuration_.receive[i].hold)
      values_[i] = 0.0;
  }
  apply();
  return Taken::applied;
}

void Krc::end_cycle() {
  if (!awaiting_) return;
  awaiting_ = false;
  if (options_.waits_for_sensor && !heard_) return;
  ++late_;
  if (late_ >= static_cast<std::uint64_t>(options_.timeout)) {
    end(KrcState::connection_lost,
        "KSS29002: " + std::to_string(late_) +
            " packets had no answer in their cycle; RSI stops and the robot holds.");
    return;
  }
  for (std::size_t i = 0; i < values_.size(); ++i)
    if (!configuration_.receive[i].hold) values_[i] = 0.0;
  apply();  // a relative correction that is held counts again: the output of the ETHERNET object stays
}

std::vector<std::string> Krc::new_unknown() {
  return std::exchange(new_unknown_, {});
}

void Krc::apply() {
  if (stop_channel_ >= 0 && values_[static_cast<std::size_t>(stop_channel_)] != 0.0) {
    end(KrcState::stopped_by_sensor, "The sensor PC has ended RSI (Stop).");
    return;
  }
  if (has_pose_)
    apply_pose();
  else
    apply_axes();
}

bool Krc::apply_axes() {
  Six axes{}, external{};
  for (std::size_t i = 0; i < 6; ++i) {
    const auto value = [&](const std::array<int, 6>& places) {
      return places[i] < 0 ? 0.0 : values_[static_cast<std::size_t>(places[i])];
    };
    axes[i] = std::clamp(value(axis_channels_) + (options_.relative ? axis_sum_[i] : 0.0),
                         -options_.axis_limit[i], options_.axis_limit[i]);
    external[i] = value(external_channels_) + (options_.relative ? external_sum_[i] : 0.0);
  }
  for (std::size_t i = 0; i < 6; ++i) {
    if (!(std::abs(axes[i]) <= options_.axis_monitor[i])) {
      end(KrcState::limit_exceeded, "KSS29000: the correction of axis A" + std::to_string(i + 1) + " is " +
                                        number_text(axes[i], 6) +
                                        " degrees; allowed: " + number_text(options_.axis_monitor[i], 6) +
                                        ". RSI stops and the robot holds.");
      return false;
    }
  }
  Six target{};
  for (std::size_t i = 0; i < 6; ++i) target[i] = start_axes_[i] + axes[i];
  if (!within_switches(target)) return false;
  axis_sum_ = axes;
  external_sum_ = external;
  target_ = target;
  for (std::size_t i = 0; i < 6; ++i) external_target_[i] = start_external_axes_[i] + external_sum_[i];
  return true;
}

bool Krc::within_switches(const Six& axes) {
  for (std::size_t i = 0; i < 6; ++i) {
    if (axes[i] >= options_.axis_lower[i] && axes[i] <= options_.axis_upper[i]) continue;
    end(KrcState::limit_exceeded,
        "Software limit switch: axis A" + std::to_string(i + 1) + " would be at " + number_text(axes[i], 6) +
            " degrees; allowed: " + number_text(options_.axis_lower[i], 6) + " to " +
            number_text(options_.axis_upper[i], 6) + ". RSI stops and the robot holds.");
    return false;
  }
  return true;
}

bool Krc::apply_pose() {
  Six correction{};
  for (std::size_t i = 0; i < 6; ++i)
    if (pose_channels_[i] >= 0) correction[i] = values_[static_cast<std::size_t>(pose_channels_[i])];
  const Pose step = pose_of_xyzabc(correction);
  Vec3 translation = options_.relative ? Vec3(translation_sum_ + step.p) : step.p;
  Mat3 rotation = options_.relative ? Mat3(step.R * rotation_sum_) : step.R;
  const double limit = options_.translation_limit_mm * 1e-3;
  for (int i = 0; i < 3; ++i) translation[i] = std::clamp(translation[i], -limit, limit);
  Eigen::AngleAxisd turn(rotation);
  const double most = options_.rotation_limit_deg;
  if (degrees_of(turn.angle()) > most) {
    turn.angle() = radians_of(most);
    rotation = turn.toRotationMatrix();
  }
  const double length_mm = translation.norm() * 1e3, angle_deg = degrees_of(turn.angle());
  if (!(length_mm <= options_.translation_monitor_mm) || !(angle_deg <= options_.rotation_monitor_deg)) {
    end(KrcState::limit_exceeded,
        "KSS29000: the correction of the pose is " + number_text(length_mm, 6) + " mm and " +
            number_text(angle_deg, 6) +
            " degrees; allowed: " + number_text(options_.translation_monitor_mm, 6) + " mm and " +
            number_text(options_.rotation_monitor_deg, 6) + " degrees. RSI stops and the robot holds.");
    return false;
  }
  // Both in the axes of the base frame: the tool's origin is moved, and the tool is turned about it.
  const Pose wanted{rotation * start_pose_.R, start_pose_.p + translation};
  const auto axes = kinematics_.inverse(wanted, target_);
  if (!axes) {
    const Six at = xyzabc_of(wanted);
    end(KrcState::unreachable, "The corrected pose X " + number_text(at[0], 6) + ", Y " +
                                   number_text(at[1], 6) + ", Z " + number_text(at[2], 6) +
                                   " mm is out of reach. RSI stops and the robot holds.");
    return false;
  }
  if (!within_switches(*axes)) return false;
  translation_sum_ = translation;
  rotation_sum_ = Quat(rotation).normalized().toRotationMatrix();
  target_ = *axes;
  return true;
}

void Krc::end(KrcState state, std::string reason) {
  state_ = state;
  reason_ = std::move(reason);
  awaiting_ = false;
}

}  // namespace takt::gateway::rsi
