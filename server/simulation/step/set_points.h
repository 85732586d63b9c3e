#pragma once
// Between commands and the robots' reference motion: follows trajectories, watches over streams of set-points
// that fall silent, and brakes where that is what a robot does then.
//
// A trajectory is a function of time; in every step its position and velocity at the end of the step become
// the robot's set-point, reached exactly then. So a path of cubic pieces is reproduced as it is, and where
// velocities jump (linear pieces) they change within one step. The torques of its points, interpolated for
// the end of the step, are the feed-forward during it. Feed-forward ends with what brought it: braking, a
// missed deadline and a trajectory without torques set it to zero. What is done depends on simulated time and
// on commands alone.
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "plant_models/robot/kinematic_robot.h"
#include "server/simulation/model/command.h"
#include "server/simulation/model/snapshot.h"

namespace takt {

struct CellDescription;
class StateReader;
class StateWriter;

class SetPoints {
 public:
  /// The description outlives it.
  explicit SetPoints(const CellDescription& cell);
  void reset();

  /// A set-point with this period was applied.
  void commanded(std::size_t robot, double t, std::uint64_t step, double period_s);
  /// Takes the trajectory over, or says why not in a notice.
  void follow(const TrajectoryCommand& command, double t, std::uint64_t step, KinematicRobot& robot);
  /// Before the step from t on: set-points for its end. `watch`: deadlines count.
  void feed(double t, std::uint64_t step, bool watch, std::span<KinematicRobot> robots);

  /// When the trajectory that a robot follows, or is about to, ends; negative: none.
  double trajectory_end_s(std::size_t robot) const;

  /// What there was to tell in the most recent step.
  std::span<const MotionNotice> notices() const { return notices_; }
  void begin_step() { notices_.clear(); }

  /// Notices are not among it. load() throws StateError.
  void save(StateWriter& out) const;
  void load(StateReader& in);

 private:
  struct Following {
    std::shared_ptr<const JointPath> path;  ///< null: none
    double start_s = 0.0;                   ///< of the path's time
    JointPathPoint begin{};                 ///< where the robot was when it took over; time since start_s
    std::size_t next = 0;                   ///< first point after the present
  };
  struct Robot {
    Following now, later;
    // Of the stream of set-points.
    bool streams = false;
    double newest_s = 0.0, period_s = 0.0;
    // Braking.
    bool brakes = false;
    double brake_begin_s = 0.0, brake_duration_s = 0.0;
    JointArray q{}, v{};  ///< at its beginning
  };

  bool take_over(std::size_t robot, Following& following, double t, std::uint64_t step,
                 const KinematicRobot& reference);
  void drop(std::size_t robot, double t, std::uint64_t step);
  void move_along(std::size_t robot, double t, std::uint64_t step, KinematicRobot& reference);
  /// A stream that is late, at a robot that brakes at its deadline: on at the same velocity. False where it
  /// must brake now to stay within its limits.
  bool goes_on(std::size_t robot, double t, KinematicRobot& reference) const;
  void brake_from(std::size_t robot, double t, KinematicRobot& reference);
  void move_on(std::size_t robot, double t, KinematicRobot& reference);
  /// Shortest by the accelerations, longest by the room to the position limits.
  double braking_time(std::size_t robot, const JointArray& v) const;
  double room_time(std::size_t robot, const JointArray& q, const JointArray& v) const;
  void note(MotionNotice notice, double t, std::uint64_t step, std::size_t robot);

  const CellDescription& cell_;
  std::vector<Robot> robots_;
  std::vector<MotionNotice> notices_;
};

}  // namespace takt
