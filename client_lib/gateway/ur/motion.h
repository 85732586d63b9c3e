#pragma once
// The motion of a robot under its controller: what URScript's servoj, speedj, speedl, movej, movel, movec, splines and
// stopj do, cycle by cycle. Pure: no clock, no transport.
//
// Joint positions are those of the protocol. The motion is that of the controller's target; the robot of the cell follows
// it one command period later. A path is a function of its own time, which passes with the speed scaling.
#include <optional>
#include <string>
#include <variant>

#include "client_lib/gateway/ur/path.h"
#include "client_lib/gateway/ur/ramp_profile.h"

namespace takt::ur {

/// A spline of one segment: cubic or quintic (coefficients in ascending order).
struct Spline {
  std::array<Vector6, 6> coefficients{};
  double duration_s = 0.0;
  bool last = false;  ///< of its trajectory: it ends at rest
};

class Motion {
 public:
  /// `arm`: six revolute joints, outlives this. `cycle_s` of the controller.
  Motion(const ArmModel& arm, double cycle_s);

  /// At rest at `q`; everything else is forgotten.
  void reset(const Vector6& q);
  /// At rest at `q`, under the same control; a path ends. For a target that something else has moved.
  void relocate(const Vector6& q);
  /// Moves as the robot does, which something else commands; stop() then brakes.
  void follow(const Vector6& q, const Vector6& qd);
  void set_tool(const Pose& X_FT) { X_FT_ = X_FT; }
  const Pose& tool() const { return X_FT_; }

  const Vector6& position() const { return q_; }
  const Vector6& velocity() const { return qd_; }
  const Vector6& acceleration() const { return qdd_; }
  /// TCP in the robot's base.
  Pose tool_pose(const Vector6& q) const;
  /// Twist of the TCP at joint speeds, in the axes of the robot's base: linear, angular.
  Vector6 tool_speed(const Vector6& q, const Vector6& qd) const;
  /// Joint positions near `near` that put the TCP there; nothing where there are none.
  std::optional<Vector6> inverse_kinematics(const Pose& X_RT, const Vector6& near) const;
  bool within_limits(const Vector6& q) const;

  bool at_rest() const;
  /// A path is being followed.
  bool follows() const { return !std::holds_alternative<std::monostate>(path_); }
  /// Seconds of the present spline, as external control programs write them to a register; 0 without one.
  double spline_time_s() const;

  /// Decelerates all joints together and stays. rad/s^2.
  void stop(double deceleration = 4.0);
  /// servoj: a set-point for the next cycle. A cycle without one continues at the present speed.
  void servo(const Vector6& q);
  /// The same with the lag of a lookahead time, as servoj of URScript; to be called each cycle.
  void servo_with_lag(const Vector6& q, double lookahead_s);
  /// Enters servo control: the set-point is the present position.
  void begin_servo();
  /// The last set-point of servo control.
  const Vector6& servo_set_point() const { return servo_q_; }
  /// Of speedj and speedl in external control programs, rad/s^2.
  static constexpr double kSpeedAcceleration = 40.0;
  /// speedj, rad/s and rad/s^2; speedl, twist of the TCP in the base's axes, in m/s^2 if an acceleration is given.
  void speed(const Vector6& qd, double acceleration = kSpeedAcceleration);
  void tool_speed_command(const Vector6& twist, std::optional<double> acceleration = std::nullopt);
  /// The speed of speedj or speedl is reached.
  bool has_speed() const { return has_speed_; }
  /// Begins at the present position, from rest. False where its end is out of reach, or the three points of an arc are on one
  /// line.
  bool begin(const Move& move);
  /// Straight in joint space.
  void move_joints(const Vector6& to, const MoveOptions& options);
  /// Straight line of the TCP with a turn about one axis. False where its end is out of reach.
  bool move_line(const Pose& X_RT, const MoveOptions& options);
  /// Arc through `via` to the end; the orientation turns from start to end. False where an end is out of reach or the
  /// three points are on one line.
  bool move_arc(const Pose& X_RT_via, const Pose& X_RT, const MoveOptions& options);
  void run_spline(const Spline& spline);

  enum class BlendOutcome : std::uint8_t {
    blended,
    overlapping,  ///< the radius meets another point, or its radius
    impossible,   ///< too late, out of reach, or the joints cannot
  };
  /// The present move has a blend radius, and has not been asked for its successor.
  bool takes_successor() const;
  /// The successor of the present move. Where the outcome is not `blended`, the present move ends at rest.
  BlendOutcome blend_into(const Move& next);
  /// Where the present move ends; without one, the present position.
  const Vector6& end() const;
  /// Moves so far; that after a blend counts from where the blend begins.
  std::uint64_t moves() const { return moves_; }

  /// One cycle. False where the path has no solution there (out of reach, singular): the robot stops.
  bool advance(double speed_scaling);

 private:
  struct Run {
    MovePath path;
    std::variant<MotionProfile, RampProfile> profile;
    double t = 0.0;             ///< of the profile; below 0: in the blend that leads to it
    std::optional<Blend> in{};  ///< from the move before
    std::optional<Blend> out{};
    bool has_asked = false;  ///< for its successor
    double duration_s() const;
    MotionProfile::Sample at_time() const;
    /// Where the path is followed exactly; s.
    double first_s() const { return in ? in->part_after : 0.0; }
  };
  struct SplineRun {
    Spline spline;
    double traveled_s = 0.0, factor = 1.0, slowing_s = 0.0;
    bool slowing = false;
  };
  enum class Mode : std::uint8_t { stop, servo, speed, tool_speed, path };

  /// To the position `q` within this cycle.
  void go_to(const Vector6& q, const Vector6* qd = nullptr);
  /// Of speedl: the twist of this cycle, on its way to the commanded one.
  Vector6 next_twist();
  void ramp_to(const Vector6& qd, double acceleration);
  bool advance_path(double speed_scaling);
  bool advance_run(Run& run, double speed_scaling);
  bool lead(Run& run, Blend& blend);
  bool advance_spline(SplineRun& run, double speed_scaling);

  const ArmModel& arm_;
  const double cycle_s_;
  Pose X_FT_;
  Vector6 q_{}, qd_{}, qdd_{};
  Mode mode_ = Mode::stop;
  double deceleration_ = 4.0;
  Vector6 servo_q_{}, commanded_speed_{}, ramped_twist_{};
  double speed_acceleration_ = kSpeedAcceleration;
  std::optional<double> tool_acceleration_;  ///< m/s^2: the twist is ramped, before the joints are
  bool has_speed_ = false;
  bool servo_fresh_ = false, servo_begun_ = false;
  std::variant<std::monostate, Run, SplineRun> path_;
  std::uint64_t moves_ = 0;
};

}  // namespace takt::ur
