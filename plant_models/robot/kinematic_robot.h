#pragma once
// A robot at LoD 1: joints follow their set-points exactly, whatever hangs on the flange.
//
// Set-points arrive once per command period. Between them the joints move on a cubic (Hermite) from the
// present position and velocity to the set-point's, reached one period after the command took effect: the
// twist is the derivative of the pose, nothing jumps, and the delay is one period. When no further command
// comes, the velocity fades to zero within one more period. A set-point that would need more than a joint's
// rated velocity takes as long as that velocity allows.
//
// Beside the motion it keeps the torques that were sent as feed-forward for drives that follow it (LoD 2 and
// 3); they do not move it.
//
// Instead of set-points a robot may follow a motion known beforehand (set_trajectory), until the first
// set-point comes.
#include <cstdint>

#include "plant_models/plant_model.h"
#include "plant_models/robot/trajectory.h"

namespace takt {

struct KinematicRobotParameters {
  int robot = -1;  ///< index into CellMotion::arms
  ArmModel arm;
  Pose X_WR;  ///< base in the world
  JointArray q_initial{};
};

class KinematicRobot final : public PlantModel {
 public:
  explicit KinematicRobot(const KinematicRobotParameters& parameters);
  void write_motion(double t, const double* x, CellMotion& motion) const override;

  /// Discrete: call only between accepted steps. `velocity` may be null: then it follows from successive
  /// set-points.
  void set_point(double t, double period_s, const double* position, const double* velocity);
  /// Discrete: torques at the joints (N m or N) from here on, constant until they are set again. Null: zero.
  void set_feed_forward(const double* torques);
  const JointArray& feed_forward() const { return feed_forward_; }
  void reset() override;
  /// Discrete: the motion goes on from here, smoothly to where it was going (a trajectory: straight to its
  /// end). For a robot that was moved by its drives and is kinematic from now on.
  void continue_from(double t, const double* q, const double* qd);

  /// Discrete: follow these knots (times ascending; moving joints must stop at the last one), now and after
  /// every reset, until a set-point comes. Empty: none. Throws std::invalid_argument.
  void set_trajectory(std::vector<TrajectoryKnot> knots);
  /// The next corner of the trajectory. Set-points are no time events.
  double next_time_event(double t) const override;
  /// Set-points, interpolation and feed-forward. A trajectory is part of the model; whether it is followed is
  /// saved.
  void save(StateWriter& out) const override;
  void load(StateReader& in) override;

  void joint_state(double t, double* q, double* qd) const;
  /// Second derivative of the positions; at a corner of the trajectory that of the piece to come, where a
  /// set-point is reached that of the piece before.
  void joint_acceleration(double t, double* qdd) const;
  /// Changes when the motion may have changed: two equal values with the robot at rest mean the same pose.
  std::uint64_t revision() const { return revision_; }
  /// True when the joints do not move any more at or after t.
  bool at_rest(double t) const { return t >= rest_time_; }
  const KinematicRobotParameters& parameters() const { return parameters_; }

 private:
  struct Segment {
    double t0 = 0.0, duration = 1.0;  ///< s
    JointArray q0{}, v0{}, q1{}, v1{};
  };
  KinematicRobotParameters parameters_;
  Segment segment_;
  std::vector<TrajectoryKnot> trajectory_;
  bool on_trajectory_ = false;
  JointArray previous_set_point_{};
  JointArray feed_forward_{};
  double previous_set_point_time_ = -1.0;
  bool has_previous_ = false;
  double rest_time_ = 0.0;
  std::uint64_t revision_ = 0;
};

}  // namespace takt
