#pragma once
// The robot controller's side of RSI: packets, corrections, late answers and the reasons to stop. Pure: no clock, no
// socket; the caller decides when a cycle begins and ends.
//
//   Krc krc(configuration, options);
//   krc.start(axes);                                   // RSI_ON
//   each cycle:  send(krc.begin_cycle(measured));      // the packet
//                krc.answer(bytes) for each datagram   // only the one with the IPOC of this cycle counts
//                krc.end_cycle();                      // without an answer: late
//                the robot goes to krc.target()
//
// Corrections come from elements for axes (AK), external axes (EK) and the pose (RKorr), those that the configuration
// receives. Absolute ones are offsets to the start, relative ones add up. Units: degrees and millimetres.
// Sources: kroshu/kuka-external-control-sdk and kroshu/kuka_drivers (GitHub).
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "client_lib/gateway/rsi/messages.h"

namespace takt::gateway::rsi {

inline constexpr double kUnlimited = std::numeric_limits<double>::infinity();

inline constexpr Six all_axes(double value) {
  return {value, value, value, value, value, value};
}

struct KrcOptions {
  int cycle_ms = 4;                         ///< 4 (#IPO_FAST) or 12 (#IPO)
  bool relative = false;                    ///< RSI_ON(#RELATIVE): corrections are increments
  std::uint64_t first_ipoc = 4208163634;    ///< of the first packet
  int timeout = 100;                        ///< Timeout of the ETHERNET object: late packets until it stops
  bool waits_for_sensor = false;            ///< late packets count from the first answer on
  Six axis_limit = all_axes(kUnlimited);    ///< AXISCORR: corrections are cut to +- this, degrees
  Six axis_monitor = all_axes(kUnlimited);  ///< AXISCORRMON: larger corrections stop RSI, degrees
  Six axis_lower =
      all_axes(-kUnlimited);  ///< software limit switches, degrees; a target beyond them stops RSI
  Six axis_upper = all_axes(kUnlimited);
  double translation_limit_mm = kUnlimited;    ///< POSCORR, of each of X Y Z
  double rotation_limit_deg = kUnlimited;      ///< POSCORR, of the angle of rotation
  double translation_monitor_mm = kUnlimited;  ///< POSCORRMON, length
  double rotation_monitor_deg = kUnlimited;    ///< POSCORRMON, angle
  // Elements whose attributes are wired to AXISCORR, AXISCORREXT and POSCORR: the RSI context is free in their names.
  std::string axes_element = "AK", external_axes_element = "EK", pose_element = "RKorr";
};

enum class KrcState {
  off,
  running,
  stopped_by_sensor,  ///< element Stop
  connection_lost,    ///< KSS29002: too many late packets
  limit_exceeded,     ///< KSS29000: the correction is beyond its monitor
  unreachable,        ///< a corrected pose that the robot cannot reach
};

/// How an answer was taken.
enum class Taken {
  applied,
  not_awaited,  ///< RSI is off, or this cycle has its answer already
  other_ipoc,   ///< late or of another packet
  invalid,      ///< fault() has the reason
};

/// Kinematics of the robot for RKorr, in the robot's base frame. Both take and return axes in degrees.
struct PoseKinematics {
  std::function<Pose(const Six& axes)> forward;
  /// The axes near `near` that reach the pose; empty: none.
  std::function<std::optional<Six>(const Pose& pose, const Six& near)> inverse;
};

class Krc {
 public:
  /// Without `kinematics` an RKorr in the configuration is refused: throws ConfigurationError, as for a configuration
  /// without any correction that is not ONLYSEND.
  Krc(Configuration configuration, const KrcOptions& options, PoseKinematics kinematics = {});

  /// RSI_ON: corrections are relative to these positions.
  void start(const Six& axes, const Six& external_axes = {});
  /// RSI_OFF.
  void stop() { state_ = KrcState::off; }

  /// The next packet: IPOC one cycle later, D, and the values of `measured` (delay and IPOC in it do not count).
  std::string begin_cycle(Rob measured);
  Taken answer(std::string_view bytes);
  /// Counts the answer as late if it has not come, and applies HOLDON.
  void end_cycle();
  /// True from the answer of this cycle on.
  bool answered() const { return answered_; }

  KrcState state() const { return state_; }
  bool running() const { return state_ == KrcState::running; }
  /// Why RSI is not running; a sentence.
  const std::string& reason() const { return reason_; }
  /// Where the robot has to be one cycle later.
  const Six& target() const { return target_; }
  const Six& external_target() const { return external_target_; }
  /// Where ASPos stands: corrections do not move it.
  const Six& start_axes() const { return start_axes_; }
  const Six& start_external_axes() const { return start_external_axes_; }
  std::uint64_t ipoc() const { return ipoc_; }
  std::uint64_t late() const { return late_; }        ///< D: late packets since the start
  std::uint64_t packets() const { return packets_; }  ///< since the start
  /// Values of the user channels, in the order of Configuration::receive, with HOLDON; 0 before the first answer.
  const std::vector<double>& values() const { return values_; }
  const std::string& message() const { return message_; }  ///< newest EStr
  const std::string& fault() const { return fault_; }      ///< of the newest invalid answer
  /// Elements that the configuration does not have, which were not reported yet.
  std::vector<std::string> new_unknown();
  const Configuration& configuration() const { return configuration_; }

 private:
  void apply();
  bool apply_axes();
  bool apply_pose();
  bool within_switches(const Six& axes);
  void end(KrcState state, std::string reason);

  const Configuration configuration_;
  const KrcOptions options_;
  const PoseKinematics kinematics_;
  /// Places in Configuration::receive, -1: not there.
  std::array<int, 6> axis_channels_{}, external_channels_{}, pose_channels_{};
  int stop_channel_ = -1;
  bool has_pose_ = false;

  KrcState state_ = KrcState::off;
  std::string reason_ = "RSI has not been started.";
  Six start_axes_{}, start_external_axes_{}, target_{}, external_target_{};
  Pose start_pose_;
  Six axis_sum_{}, external_sum_{};  ///< corrections in effect
  Vec3 translation_sum_ = Vec3::Zero();
  Mat3 rotation_sum_ = Mat3::Identity();
  std::vector<double> values_;
  std::uint64_t ipoc_ = 0, late_ = 0, packets_ = 0;
  bool awaiting_ = false, answered_ = false, heard_ = false;
  std::string message_, fault_;
  std::set<std::string> unknown_;
  std::vector<std::string> new_unknown_;
};

}  // namespace takt::gateway::rsi
