#pragma once
// The reference motion of one robot: the only owner of its set-points. It executes commands and trajectories,
// supervises the deadline of set-point streams, and brakes at a missed deadline if the robot is configured
// so. Every motion is given to the kinematic robot as set-points, between which it interpolates.
//
// A trajectory is a function of time; in every step its position and velocity at the end of the step become
// the robot's set-point, reached exactly at that time. So a path of cubic pieces is reproduced exactly, and
// jumps of velocity (linear pieces) are spread over one step. The torques of its points, interpolated for the
// end of the step, are the feed-forward during the step. Feed-forward ends with its source: braking, a missed
// deadline and a trajectory without torques set it to zero.
//
// In torque mode the reference follows the robot, so every other motion begins where the robot is. The robot
// brakes and then holds its position where torques stop coming, or would take a joint out of its limits. The
// result depends on simulated time, on commands, and in torque mode on the robot's own motion.
#include <cstdint>
#include <memory>
#include <vector>

#include "plant_models/robot/kinematic_robot.h"
#include "server/simulation/model/command.h"
#include "server/simulation/model/snapshot.h"

namespace takt {

struct CellDescription;
struct RobotDescription;
class StateReader;
class StateWriter;

class ReferenceMotion {
 public:
  /// Most notices of a robot in one step: one of each kind.
  static constexpr std::size_t kMaxNotices = 6;

  /// All outlive it. Notices of each step are appended to `notices`.
  ReferenceMotion(const CellDescription& cell, std::size_t robot, KinematicRobot& kinematics,
                  std::vector<MotionNotice>& notices);
  void reset();

  /// Between two steps, at time t (s): takes effect in the step from t on. The numbers of the command must be
  /// finite.
  void apply(const JointCommand& command, double t, std::uint64_t step);
  /// The same of a command of torques, for a robot whose measured motion is (q, qd).
  void apply_torques(const JointCommand& command, double t, std::uint64_t step, const double* q,
                     const double* qd);
  /// In torque mode, ahead of the commands of a step: the measured motion.
  void follow(double t, const double* q, const double* qd);
  /// In torque mode, after advance(): the torques during the step are these and those that were commanded.
  void add_torques(const JointArray& weight);
  /// The same; a notice reports the refusal of a trajectory that the robot cannot follow.
  void apply(const TrajectoryCommand& command, double t, std::uint64_t step);
  /// Before the step from t on: sets the set-point for its end. `watch`: deadlines are supervised.
  /// A trajectory advances by the share `override` of the step; set-points and braking are not changed by it.
  void advance(double t, std::uint64_t step, bool watch, double override = 1.0);
  /// Ends all motion: the robot brakes on its path, as at a missed deadline. While it brakes, and at rest, the call has
  /// no effect.
  void stop(double t, std::uint64_t step);

  /// End of the present or next trajectory of the robot (s); negative: without trajectory.
  double trajectory_end_s() const;

  /// load() throws StateError.
  void save(StateWriter& out) const;
  void load(StateReader& in);

 private:
  struct Following {
    std::shared_ptr<const JointPath> path;  ///< nullptr: without trajectory
    double start_s = 0.0;                   ///< of the path's time
    /// The robot's motion at the start of the trajectory; time since start_s.
    JointPathPoint begin{};
    std::size_t next = 0;  ///< first point after the present
  };
  struct State {
    Following now, later;
    // Of the stream of set-points.
    bool streams = false;
    double newest_s = 0.0, period_s = 0.0;
    JointArray torques{};     ///< in torque mode
    bool at_a_limit = false;  ///< torques have ended at a limit, where the robot brakes
    // Braking.
    bool brakes = false;
    double brake_begin_s = 0.0, brake_duration_s = 0.0;
    JointArray q{}, v{};  ///< at its beginning
  };

  void begin_stream(const JointCommand& command, double t, std::uint64_t step);
  bool take_over(Following& following, double t, std::uint64_t step);
  void drop(double t, std::uint64_t step);
  void move_along(double t, std::uint64_t step, double override);
  /// Continues a late stream of a braking robot at the same velocity. False if the robot must brake to stay
  /// within its limits.
  bool goes_on(double t);
  void brake_from(double t);
  void continue_braking(double t);
  /// Notes the joint that torques are about to take out of its limits.
  bool torques_leave_limits(double t, std::uint64_t step);
  /// Shortest by the accelerations, longest by the room to the position limits (s).
  double braking_time(const JointArray& v) const;
  double room_time(const JointArray& q, const JointArray& v) const;
  void note(MotionNotice notice, double t, std::uint64_t step);

  const RobotDescription& description_;
  const double step_s_;
  const std::size_t robot_;
  KinematicRobot& kinematics_;
  std::vector<MotionNotice>& notices_;
  State state_;
};

}  // namespace takt
