#pragma once
// The interface by which every plant model (Part, robot, gripper, device) joins the one system of
// differential equations x' = f(t, x, wrenches).
//
// A model owns a segment of the state vector, writes the motion of the bodies it moves, and computes
// derivatives from the wrenches on them. All three functions are pure: a solver may call them any number of
// times, at any times within the step. Discrete state (set-points, jaw targets) changes only between accepted
// steps.
#include <limits>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "plant_models/robot/arm_kinematics.h"
#include "plant_models/spatial.h"
#include "plant_models/velocity_form.h"

namespace takt {

class StateReader;
class StateWriter;

/// Motion of one body B (a component), world frame W.
struct BodyMotion {
  Pose X_WB;
  Twist V_WB;                  ///< of the origin of B
  Vec3 p_WBcm = Vec3::Zero();  ///< centre of mass; wrenches on the body are taken about this point
};

/// Motion of the base R of a robot.
struct BaseMotion {
  Pose X_WR;
  Twist V_WR;  ///< of the origin of R
  Twist A_WR;  ///< acceleration of that origin and angular acceleration, in W
  bool operator==(const BaseMotion& other) const = default;
};

/// Motion of one robot.
struct ArmMotion {
  JointArray q{}, qd{};
  /// Torque of a device on each joint, in the sense of q (N m or N). A device writes it, one for each joint.
  JointArray applied{};
  BaseMotion base;
  bool complete = false;  ///< all that follows has been written, and belongs to q, qd and the base
  ArmPoses poses;
  Pose X_WF;   ///< flange in the world
  Twist V_WF;  ///< of the flange origin
};

/// Heat of one body. Its own model writes the temperature and clears the other members; models that exchange
/// heat with it follow in the order of models and add to the flow.
struct BodyHeat {
  double temperature_K = 0.0;  ///< 0: this body has no temperature
  double flow_W = 0.0;         ///< into the body
  bool enclosed = false;       ///< by another component (a furnace), away from the surroundings
};

/// A Ground whose surface moves (a belt): S is a frame fixed in the material of the surface, and coincides with the Ground's
/// frame T at the start.
struct SurfaceMotion {
  bool exists = false;  ///< else the surface is that of the body
  Pose X_TS;
  Twist V_TS_T;       ///< of the material relative to the Ground, at the origin of T, axes of T
  BodyMotion in_W{};  ///< of S; its reference point p_WBcm is that of the Ground
};

/// Motion of everything in the cell at one time.
struct CellMotion {
  std::vector<BodyMotion> bodies;         ///< by component id
  std::vector<ArmMotion> arms;            ///< by robot index
  std::vector<BodyHeat> heat;             ///< by component id
  std::vector<SurfaceMotion> surfaces{};  ///< by component id; empty in a cell without moving surfaces
  /// Of the origins of Grounds, and angular, in W, by component id; empty in a cell without robots on Grounds.
  std::vector<Twist> accelerations{};
  double time_s = 0.0;

  bool has_surface(int component) const {
    return !surfaces.empty() && surfaces[static_cast<std::size_t>(component)].exists;
  }
  /// The motion of what carries a Part that lies on this component: of the material of a moving surface, else of the body.
  const BodyMotion& carrier(int component) const {
    const auto c = static_cast<std::size_t>(component);
    return has_surface(component) ? surfaces[c].in_W : bodies[c];
  }
  /// The motion of a base at X_MR in the Ground M.
  BaseMotion base_on(int ground, const Pose& X_MR) const {
    const auto g = static_cast<std::size_t>(ground);
    const BodyMotion& M = bodies[g];
    const Twist& A = accelerations[g];
    BaseMotion base{M.X_WB * X_MR, {}, {}};
    const Vec3 r = base.X_WR.p - M.X_WB.p;
    base.V_WR = {M.V_WB.at(r), M.V_WB.w};
    base.A_WR = {A.at(r) + M.V_WB.w.cross(M.V_WB.w.cross(r)), A.w};
    return base;
  }
};

class PlantModel {
 public:
  virtual ~PlantModel() = default;
  virtual int state_count() const { return 0; }
  virtual void initial_state(double* x) const { static_cast<void>(x); }
  /// The one component that this model moves, if its motion follows from the model's states alone; else -1.
  /// Such a body is at rest while its states are constant, and always if it has no states.
  virtual int body() const { return -1; }

  /// Writes the motion of the bodies and arms that this model moves. Models are called in the order robots,
  /// grippers, Parts, so the motion of the robot's flange is available to its gripper.
  virtual void write_motion(double t, const double* x, CellMotion& motion) const = 0;

  /// Writes state_count() derivatives. `wrenches[c]` acts on body c at its centre of mass, in the world
  /// frame, gravity not included.
  virtual void derivatives(double t, const double* x, const CellMotion& motion,
                           std::span<const Wrench> wrenches, double* xdot) const {
    static_cast<void>(t), static_cast<void>(x), static_cast<void>(motion), static_cast<void>(wrenches),
        static_cast<void>(xdot);
  }

  // Discrete modes (true friction, end stops): functions whose sign change ends the present mode, and the
  // switch itself, which a solver calls only at accepted points. A model without modes keeps the defaults.

  virtual int indicator_count() const { return 0; }
  /// Positive as long as the present modes are valid.
  virtual void indicators(double t, const double* x, const CellMotion& motion,
                          std::span<const Wrench> wrenches, double* g) const {
    static_cast<void>(t), static_cast<void>(x), static_cast<void>(motion), static_cast<void>(wrenches),
        static_cast<void>(g);
  }
  /// Discrete: sets the modes according to (t, x); may set states that a mode fixes (a stuck speed to zero).
  /// True after any change; a multi-step solver then restarts.
  virtual bool switch_modes(double t, double* x, const CellMotion& motion, std::span<const Wrench> wrenches) {
    static_cast<void>(t), static_cast<void>(x), static_cast<void>(motion), static_cast<void>(wrenches);
    return false;
  }
  /// The next time after t at which the right-hand side has a known corner (a reference motion that starts to
  /// brake), or infinity: multi-step solvers restart there.
  virtual double next_time_event(double t) const {
    static_cast<void>(t);
    return std::numeric_limits<double>::infinity();
  }

  /// Discrete, at the start of every step at time t, after the commands: decisions that follow from positions
  /// (a Part in the furnace). May set states. True if the right-hand side changed; a multi-step solver then
  /// restarts. Called for models other than robots, grippers and Parts.
  virtual bool decide(double t, double* x, const CellMotion& motion) {
    static_cast<void>(t), static_cast<void>(x), static_cast<void>(motion);
    return false;
  }
  /// Restores the initial discrete state.
  virtual void reset() {}

  // Stiffness inside the model, for linearly implicit solvers: an approximation of d xdot / d x of the
  // model's own segment. Missing entries are treated explicitly; without entries the whole model is.

  /// Places of the entries, constant while the cell is loaded; (row, column) within the segment.
  virtual void jacobian_pattern(std::vector<std::pair<int, int>>& entries) const {
    static_cast<void>(entries);
  }
  /// Values in the order of the pattern.
  virtual void jacobian(double t, const double* x, const CellMotion& motion, double* values) const {
    static_cast<void>(t), static_cast<void>(x), static_cast<void>(motion), static_cast<void>(values);
  }
  /// Adds to `rate`, of state_count() values, an approximation of the partial derivative of xdot by t at
  /// equal states: how moving references enter stiff equations. Without it a linearly implicit step of length
  /// h follows a moving reference with a lag of up to its speed times h.
  virtual void time_derivative(double t, const double* x, const CellMotion& motion, double* rate) const {
    static_cast<void>(t), static_cast<void>(x), static_cast<void>(motion), static_cast<void>(rate);
  }

  /// The model reduced to its velocities, for linear systems that couple models; the model must outlive it.
  /// nullptr: the model is not coupled with others, and its own entries (jacobian_pattern) are complete.
  virtual std::unique_ptr<VelocityForm> make_velocity_form() const { return nullptr; }

  /// Typical sizes of the states, > 0: solvers with error control allow a state x of scale s an error of
  /// tolerance * (|x| + s) per step, and finite differences are taken over a fraction of it.
  virtual void state_scales(double* scales) const {
    for (int i = 0; i < state_count(); ++i) scales[i] = 1.0;
  }
  /// How many of the first states are allowed tolerance * s alone: poses and twists, whose numbers depend on the place and
  /// the motion of the frame.
  virtual int absolute_states() const { return 0; }

  /// Saves discrete state (plant_models/state_bytes.h): all that influences the model's motion besides its
  /// segment of the state vector. load() throws StateError for invalid bytes.
  virtual void save(StateWriter& out) const { static_cast<void>(out); }
  virtual void load(StateReader& in) { static_cast<void>(in); }
};

}  // namespace takt
