#pragma once
// Messages of the external control program that drivers of Universal Robots upload (Universal_Robots_Client_Library,
// resources/external_control.urscript): int32, most significant byte first, values times 10^6.
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace takt::rtde {

enum class ControlMode : std::int32_t {
  stopped = -2,
  uninitialized = -1,
  idle = 0,
  servoj = 1,
  speedj = 2,
  forward = 3,
  speedl = 4,
  pose = 5,
  freedrive = 6,
  tool_in_contact = 7,
  torque = 8,
};

/// The reverse socket, driver to robot: 32 bytes.
struct ReverseMessage {
  static constexpr std::size_t kBytes = 32;
  std::int32_t timeout_ms = 0;        ///< of the next read; 0: none
  std::array<std::int32_t, 6> raw{};  ///< as they came: actions of trajectories are not scaled
  std::array<double, 6> values{};     ///< rad, rad/s, m
  ControlMode mode = ControlMode::idle;
};

enum class TrajectoryAction : std::int32_t {
  cancel = -1,
  noop = 0,
  start = 1,
  stream_start = 2,
  stream_end = 3
};

enum class PointType : std::int32_t {
  movej = 0,
  movel = 1,
  movep = 2,
  movec = 3,
  optimovej = 4,
  optimovel = 5,
  movej_pose = 6,
  movel_joint = 7,
  movep_joint = 8,
  movec_joint = 9,
  movec_joint_pose = 10,  ///< target joints, via pose
  movec_pose_joint = 11,  ///< target pose, via joints
  optimovej_pose = 12,
  optimovel_joint = 13,
  spline = 51,
};

/// The trajectory socket, driver to robot: 84 bytes.
struct TrajectoryPoint {
  static constexpr std::size_t kBytes = 84;
  std::array<double, 6> target{}, second{}, third{};
  double time_s = 0.0;
  double blend_radius_m = 0.0;
  std::int32_t spline_type = 0;  ///< 1 cubic, 2 quintic
  PointType type = PointType::movej;
};

enum class TrajectoryResult : std::int32_t { success = 0, canceled = 1, failure = 2 };

enum class ScriptCommandType : std::int32_t {
  zero_ftsensor = 0,
  set_payload = 1,
  set_tool_voltage = 2,
  start_force_mode = 3,
  end_force_mode = 4,
  start_tool_contact = 5,
  end_tool_contact = 6,
  set_friction_compensation = 7,
  ft_rtde_input_enable = 8,
  set_gravity = 9,
  set_tcp_offset = 10,
  set_friction_scales = 11,
  set_target_payload = 12,
};

/// The script command socket, driver to robot: 112 bytes.
struct ScriptCommand {
  static constexpr std::size_t kBytes = 112;
  ScriptCommandType type = ScriptCommandType::zero_ftsensor;
  std::array<double, 27> values{};
};

/// Each takes exactly kBytes bytes.
ReverseMessage reverse_message(std::string_view bytes);
TrajectoryPoint trajectory_point(std::string_view bytes);
ScriptCommand script_command(std::string_view bytes);
/// An answer: one int32.
std::string int32_bytes(std::int32_t value);

/// Cuts a stream into messages of a constant size.
class Chopper {
 public:
  explicit Chopper(std::size_t size) : size_(size) {}
  void add(std::string_view bytes) { buffer_.append(bytes); }
  /// Empty where no whole message is left.
  std::optional<std::string> next() {
    if (buffer_.size() - begin_ < size_) {
      buffer_.erase(0, begin_);
      begin_ = 0;
      return std::nullopt;
    }
    begin_ += size_;
    return buffer_.substr(begin_ - size_, size_);
  }
  std::size_t whole_messages() const { return (buffer_.size() - begin_) / size_; }

 private:
  std::size_t size_, begin_ = 0;
  std::string buffer_;
};

}  // namespace takt::rtde
