#pragma once
// The messages of ABB's Externally Guided Motion as plain structs. Degrees and millimetres. The wire format is egm.proto;
// protobuf stays in messages.cpp. Sources: ros-industrial/abb_libegm and FLo-ABB/ABB-EGM-Python (GitHub); ABB 3HAC073318-001.
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace takt::gateway::egm {

enum class MessageType : std::uint32_t {
  undefined = 0,
  command = 1,
  data = 2,
  correction = 3,
  path_correction = 4
};

struct Header {
  std::uint32_t seqno = 0;
  std::optional<std::uint32_t> tm_ms{};
  MessageType type = MessageType::undefined;
  bool has_seqno = true;  ///< as read: a sensor may leave it out
};

struct EgmPose {
  std::array<double, 3> position_mm{};
  std::array<double, 4> quaternion{1.0, 0.0, 0.0, 0.0};  ///< scalar part first
  std::optional<std::array<double, 3>> euler_deg{};      ///< x, y, z; counts before the quaternion
};

/// feedBack, planned, and the reference of a sensor.
struct Motion {
  std::vector<double> joints{};
  std::optional<EgmPose> pose{};
  std::vector<double> external_joints{};
  std::optional<std::uint64_t> time_us{};  ///< since 1970
};

enum class MotorState : std::uint32_t { undefined = 0, on = 1, off = 2 };
enum class MciState : std::uint32_t { undefined = 0, error = 1, stopped = 2, running = 3 };
enum class RapidState : std::uint32_t { undefined = 0, stopped = 1, running = 2 };

/// Signals in RAPID of RobotWare 7: one digital signal and at most 40 numbers.
struct RapidData {
  std::optional<bool> digital{};
  std::vector<double> numbers{};
};

struct Robot {
  Header header{0, 0, MessageType::data};
  Motion feed_back{}, planned{};
  MotorState motors = MotorState::undefined;
  MciState mci = MciState::undefined;
  bool converged = false;
  RapidState rapid = RapidState::undefined;
  std::vector<double> force{};  ///< N, N m; empty: not sent
  int robotware = 6;            ///< layout of the force: 6 or 7
  std::optional<double> utilization{};
  std::optional<RapidData> rapid_data{};
};

struct Sensor {
  Header header{0, {}, MessageType::correction};
  std::optional<Motion> planned{};
  std::vector<double> joint_speeds{}, cartesian_speeds{}, external_speeds{};  ///< speedRef
  bool has_speeds = false;
  std::optional<RapidData> rapid_data{};
  /// Of a message of type path_correction, which has nothing else: x, y, z in the axes of the path.
  std::optional<std::array<double, 3>> path_correction_mm{};
};

template <class Message>
struct Parsed {
  std::optional<Message> message{};
  std::string fault{};
};

inline constexpr std::size_t kMaxMessage = 8192;
inline constexpr std::size_t kMaxRapidNumbers = 40;

/// Fields in the order of their numbers, repeated numbers not packed. Numbers that are not finite are sent as 0.
std::string encode(const Robot& robot);
std::string encode(const Sensor& sensor);

/// Faults: no protocol buffer, no header, another message type, numbers that are not finite or too many. Unknown fields
/// are skipped.
Parsed<Robot> decode_robot(std::string_view bytes);
Parsed<Sensor> decode_sensor(std::string_view bytes);

}  // namespace takt::gateway::egm
