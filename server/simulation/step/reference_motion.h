#pragma once
// The reference motion of one robot: the one owner of its set-points. It takes commands, follows trajectories,
// watches over streams of set-points that fall silent, and brakes where that is what the robot does then. Whatever
// the reason of the motion, it ends in set-points of the kinematic robot, which interpolates between them.
//
// A trajectory is a function of time; in every step its position and velocity at the end of the step become
// the robot's set-point, reached exactly then. So a path of cubic pieces is reproduced as it is, and where
// velocities jump (linear pieces) they change within one step. The torques of its points, interpolated for
// the end of the step, are the feed-forward during it. Feed-forward ends with what brought it: braking, a
// missed deadline and a trajectory without torques set it to zero. What is done depends on simulated time and
// on commands alone.
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
  static constexpr std::size_t kMaxNotices = 4;

  /// All outlive it. Notices of each step are appended to `notices`.
  ReferenceMotion(const CellDescription& cell, std::size_t robot, KinematicRobot& kinematics,
                  std::vector<MotionNotice>& notices);
  void reset();

  /// Between two steps, at time t (s): takes effect in the step from t on. The numbers of the command are finite.
  void apply(const JointCommand& command, double t, std::uint64_t step);
  /// The same; a trajectory that cannot be followed is refused in a notice.
  void apply(const TrajectoryCommand& command, double t, std::uint64_t step);
  /// Before the step from t on: the set-point for its end. `watch`: deadlines count.
  void advance(double t, std::uint64_t step, bool watch);

  /// When the trajectory that the robot follows, or is about to, ends (s); negative: none.
  double trajectory_end_s() const;

  /// load() throws StateError.
  void save(StateWriter& out) const;
  void load(StateReader& in);

 private:
  struct Following {
    std::shared_ptr<const JointPath> path;  ///< null: none
    double start_s = 0.0;                   ///< of the path's time
    JointPathPoint begin{};                 ///< where the robot was when it took over; time since start_s
    std::size_t next = 0;                   ///< first point after the present
  };
  struct State {
    Following now, later;
    // Of the stream of set-points.
    bool streams = false;
    double newest_s = 0.0, period_s = 0.0;
    // Braking.
    bool brakes = false;
    double brake_begin_s = 0.0, brake_duration_s = 0.0;
    JointArray q{}, v{};  ///< at its beginning
  };

  bool take_over(Following& following, double t, std::uint64_t step);
  void drop(double t, std::uint64_t step);
  void move_along(double t, std::uint64_t step);
  /// A stream that is late, at a robot that brakes at its deadline: on at the same velocity. False where it
  /// must brake now to stay within its limits.
  bool goes_on(double t);
  void brake_from(double t);
  void continue_braking(double t);
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
