#pragma once
// The controller's side of EGM: follows the references of a sensor by the control law of position guidance (EGMRunJoint,
// EGMRunPose), or moves along a path that the sensor corrects (EGMMoveL). Pure: no clock, no socket.
//
//   speed   = gain * (reference - position) + speed reference      of each axis, low-pass filtered
//   position <- position + factor * speed * dt                     one factor for all axes: the largest speed is limited
//
// `position` is the controller's own set-point (planned). The gain of a real controller is not published: the default
// is an assumption. Degrees and millimetres. Sources: ros-industrial/abb_libegm and FLo-ABB/ABB-EGM-Python (GitHub); ABB 3HAC073318-001.
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client_lib/gateway/egm/messages.h"
#include "client_lib/gateway/egm/path.h"
#include "client_lib/gateway/vendor_units.h"

namespace takt::gateway::egm {

/// EGMActJoint, EGMActPose or EGMActMove.
enum class Guidance { joint, pose, path };

struct ControllerOptions {
  Guidance guidance = Guidance::joint;
  double position_gain_per_s = 20.0;              ///< PosCorrGain 1; ASSUMED. 0: speed references alone
  double max_speed_deviation_deg_per_s = 1000.0;  ///< MaxSpeedDeviation; of the fastest joint
  double max_position_deviation_deg = 1000.0;     ///< MaxPosDeviation, from the positions at the start
  double low_pass_Hz = 0.0;                       ///< LpFilter; 0: none
  double ramp_in_s = 0.0;                         ///< RampInTime: the speed grows to its full value
  double comm_timeout_s = 1.0;                    ///< CommTimeout: silence until RAPID stops
  double convergence_deg = 0.5,
         convergence_mm = 1.0;           ///< tolerance of each joint, or of rotation and position
  double condition_time_s = 1.0;         ///< CondTime: so long within it
  std::vector<double> lower{}, upper{};  ///< limits of joints, degrees or mm; empty: none
  /// Of guidance `path`, from the pose at the start on. The robot moves along it from the sensor's first message on. Corrections
  /// across it (y, z) are led to by the gain; one along it (x) has no effect.
  std::vector<PathPoint> path{};
  double path_speed_mm_per_s = 10.0;
};

enum class Session {
  off,
  running,
  lost,  ///< no message for CommTimeout: RAPID has stopped, the robot holds
};

/// How a message was taken.
enum class Taken {
  applied,
  old,      ///< doubled or overtaken
  invalid,  ///< fault() has the reason
};

/// Kinematics of the robot for pose guidance, in its base frame; joints in degrees.
struct PoseKinematics {
  std::function<Pose(const std::vector<double>& joints)> forward;
  std::function<std::optional<std::vector<double>>(const Pose& pose, const std::vector<double>& near)>
      inverse;
};

class Controller {
 public:
  /// Joints beyond the sixth are external joints of the messages. Throws std::invalid_argument for pose guidance without
  /// kinematics.
  Controller(const ControllerOptions& options, std::size_t joint_count, PoseKinematics kinematics = {});

  /// EGMRun: the reference is the present position; seqno counts from 0. Throws std::invalid_argument for a path that cannot
  /// be corrected.
  void start(const std::vector<double>& joints);

  /// A message of the sensor. After silence it begins another session, from the present position.
  Taken receive(std::string_view bytes);

  /// One cycle of the control law. `measured` are the joints of the robot.
  void step(double dt_s, const std::vector<double>& measured);

  /// The message of this cycle; the header, motors, states, convergence and planned joints are filled in. `robot` has the
  /// measured joints, poses, time, force and RAPID data.
  std::string message(Robot robot, std::uint32_t tm_ms, bool motors_on);

  Session session() const { return session_; }
  /// Messages of the sensor have come, the newest within CommTimeout.
  bool hears() const { return session_ == Session::running && heard_; }
  const std::vector<double>& planned() const { return planned_; }
  const std::vector<double>& speed() const { return speed_; }  ///< of `planned`, degrees/s or mm/s
  bool converged() const { return converged_; }
  const std::string& fault() const {
    return fault_;
  }  ///< of the newest invalid message, or why the session was lost
  const std::optional<RapidData>& rapid_data() const { return rapid_data_; }  ///< the newest
  std::uint64_t applied() const { return applied_; }
  std::uint64_t old() const { return old_; }
  std::uint64_t limited() const { return limited_; }  ///< cycles in which MaxSpeedDeviation has acted
  std::uint32_t seqno() const { return seqno_; }      ///< of the next message

 private:
  bool take(const Sensor& sensor);
  std::vector<double> wanted_speed(double dt_s);
  std::vector<double> speed_to(const Pose& X, double dt_s);

  const ControllerOptions options_;
  const std::size_t count_;
  const PoseKinematics kinematics_;
  Session session_ = Session::off;
  std::vector<double> planned_, speed_, filtered_, start_, reference_, speed_reference_;
  Pose planned_pose_, reference_pose_;
  Twist pose_speed_;  ///< m/s, rad/s
  std::optional<Path> path_;
  double along_m_ = 0.0;
  Vec3 correction_m_ = Vec3::Zero(), wanted_correction_m_ = Vec3::Zero();
  bool has_reference_ = false, converged_ = false;
  double silent_s_ = 0.0, running_s_ = 0.0, within_s_ = 0.0;
  bool heard_ = false;
  std::uint32_t seqno_ = 0;
  std::optional<std::uint32_t> last_seqno_;
  int rising_old_ = 0;
  std::uint32_t last_old_ = 0;
  std::uint64_t applied_ = 0, old_ = 0, limited_ = 0;
  std::string fault_;
  std::optional<RapidData> rapid_data_;
};

/// A pose of EGM, in the robot's base frame.
Pose pose_of(const EgmPose& pose);
EgmPose egm_pose_of(const Pose& X);

}  // namespace takt::gateway::egm
