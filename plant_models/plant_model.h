#pragma once
// The interface by which every plant model (Part, robot, gripper, later drives, furnaces, presses) joins the
// one system of differential equations x' = f(t, x, wrenches).
//
// A model owns a segment of the state vector, writes the motion of the bodies it moves, and turns the
// wrenches on them into derivatives. All three functions are pure: a solver may call them as often, and at
// whatever times within the step, as it likes. Discrete state (set-points, jaw targets) changes only between
// accepted steps.
#include <span>
#include <vector>

#include "plant_models/robot/arm_kinematics.h"
#include "plant_models/spatial.h"

namespace takt {

/// Motion of one body B (a component), world frame W.
struct BodyMotion {
  Pose X_WB;
  Twist V_WB;                  ///< of the origin of B
  Vec3 p_WBcm = Vec3::Zero();  ///< centre of mass; wrenches on the body are taken about this point
};

/// Motion of one robot.
struct ArmMotion {
  JointArray q{}, qd{};
  bool complete = false;  ///< all that follows has been written, and belongs to q and qd
  ArmPoses poses;
  Pose X_WF;   ///< flange in the world
  Twist V_WF;  ///< of the flange origin
};

/// Motion of everything in the cell at one time.
struct CellMotion {
  std::vector<BodyMotion> bodies;  ///< by component id
  std::vector<ArmMotion> arms;     ///< by robot index
};

class PlantModel {
 public:
  virtual ~PlantModel() = default;
  virtual int state_count() const { return 0; }
  virtual void initial_state(double* x) const { static_cast<void>(x); }
  /// The one component this model moves, where its motion follows from the model's states alone; else -1.
  /// With equal states such a body stands still, and without states always.
  virtual int body() const { return -1; }

  /// Writes the motion of the bodies and arms this model moves. Models are called in the order robots,
  /// grippers, Parts, so a gripper finds its robot's flange already written.
  virtual void write_motion(double t, const double* x, CellMotion& motion) const = 0;

  /// Writes state_count() derivatives. `wrenches[c]` acts on body c at its centre of mass, in the world
  /// frame, gravity not included.
  virtual void derivatives(double t, const double* x, const CellMotion& motion,
                           std::span<const Wrench> wrenches, double* xdot) const {
    static_cast<void>(t), static_cast<void>(x), static_cast<void>(motion), static_cast<void>(wrenches),
        static_cast<void>(xdot);
  }
};

}  // namespace takt
