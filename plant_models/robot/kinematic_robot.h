#pragma once
// A robot at LoD 1: joints follow their set-points exactly, for any load.
//
// Set-points arrive once per command period. Between them the joints move on a cubic (Hermite) from the
// present position and velocity to the set-point's, reached one period after the command took effect: the
// position and velocity to the set-point's, reached one period after the command took effect: the twist is
// the derivative of the pose, the motion is continuous, and the delay is one period. Without a further
// command, the velocity fades to zero within one more period. A set-point that would need more than a joint's
// rated velocity takes as long as that velocity allows.
//
// It also stores the feed-forward torques of the set-points, for drives that follow it (LoD 2 and 3); they
// have no effect on its motion. In torque mode these drives have no position control: their torque is the
// feed-forward, and the reference follows them, until the next set-point.
//
// Instead of set-points a robot may follow a predefined motion (set_trajectory), until the first set-point.
#include <cstdint>

#include "plant_models/plant_model.h"
#include "plant_models/robot/trajectory.h"

namespace takt {

struct KinematicRobotParameters {
  int robot = -1;  ///< index into CellMotion::arms
  ArmModel arm;
  Pose X_WR;  ///< base in the world, at the start
  JointArray q_initial{};
  /// The Ground that the base stands on and moves with, or -1: the world; and its place there.
  int mount = -1;
  Pose X_MR{};
};

class KinematicRobot final : public PlantModel {
 public:
  explicit KinematicRobot(const KinematicRobotParameters& parameters);
  void write_motion(double t, const double* x, CellMotion& motion) const override;

  /// Discrete: call only between accepted steps. With a null `velocity` it follows from successive
  /// set-points. Ends torque mode, also as continue_from() does.
  void set_point(double t, double period_s, const double* position, const double* velocity);
  /// Discrete: sets the torques at the joints (N m or N), constant until the next call. Null: zero.
  void set_feed_forward(const double* torques);
  const JointArray& feed_forward() const { return feed_forward_; }
  /// Discrete: torque mode begins, or goes on. The reference is where the joints of the drives are, and moves
  /// on with their velocities for `period_s`.
  void follow(double t, double period_s, const double* q, const double* qd);
  bool torque_mode() const { return torque_mode_; }
  void reset() override;
  /// Discrete: continues the motion from this state, smoothly to its present target (a trajectory: straight
  /// to its end). For a robot that changes from dynamic to kinematic.
  void continue_from(double t, const double* q, const double* qd);

  /// Discrete: the robot follows these knots (times ascending; moving joints must stop at the last one) until
  /// the next set-point, and again after every reset. Empty: without trajectory. Throws
  /// std::invalid_argument.
  void set_trajectory(std::vector<TrajectoryKnot> knots);
  /// The next corner of the trajectory. Set-points are no time events.
  double next_time_event(double t) const override;
  /// Saves set-points, interpolation and feed-forward. A trajectory is part of the model; only its activity
  /// is saved.
  void save(StateWriter& out) const override;
  void load(StateReader& in) override;

  void joint_state(double t, double* q, double* qd) const;
  /// Second derivative of the positions; at a corner of the trajectory that of the next piece, at a reached
  /// set-point that of the last piece.
  void joint_acceleration(double t, double* qdd) const;
  /// Changes with every possible change of the motion: two equal values with the robot at rest mean the same
  /// pose.
  std::uint64_t revision() const { return revision_; }
  /// True if the joints are at rest at t and later.
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
  bool torque_mode_ = false;
  JointArray previous_set_point_{};
  JointArray feed_forward_{};
  double previous_set_point_time_ = -1.0;
  bool has_previous_ = false;
  double rest_time_ = 0.0;
  std::uint64_t revision_ = 0;
};

}  // namespace takt
