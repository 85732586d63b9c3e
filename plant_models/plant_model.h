#pragma once
// The interface by which every plant model (Part, robot, gripper, later drives, furnaces, presses) joins the
// one system of differential equations x' = f(t, x, wrenches).
//
// A model owns a segment of the state vector, writes the motion of the bodies it moves, and turns the
// wrenches on them into derivatives. All three functions are pure: a solver may call them as often, and at
// whatever times within the step, as it likes. Discrete state (set-points, jaw targets) changes only between
// accepted steps.
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

/// Motion of one robot.
struct ArmMotion {
  JointArray q{}, qd{};
  bool complete = false;  ///< all that follows has been written, and belongs to q and qd
  ArmPoses poses;
  Pose X_WF;   ///< flange in the world
  Twist V_WF;  ///< of the flange origin
};

/// Heat of one body. Its own model writes the temperature and sets the rest back; what exchanges heat with it
/// comes later in the order of models and adds to the flow.
struct BodyHeat {
  double temperature_K = 0.0;  ///< 0: this body has no temperature
  double flow_W = 0.0;         ///< into the body
  bool enclosed = false;       ///< by something (a furnace), away from the surroundings
};

/// Motion of everything in the cell at one time.
struct CellMotion {
  std::vector<BodyMotion> bodies;  ///< by component id
  std::vector<ArmMotion> arms;     ///< by robot index
  std::vector<BodyHeat> heat;      ///< by component id
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

  // Discrete modes (true friction, end stops): functions whose sign change ends the present mode, and the
  // switch itself, which a solver calls only at accepted points. A model without modes keeps the defaults.

  virtual int indicator_count() const { return 0; }
  /// Positive while the present modes hold.
  virtual void indicators(double t, const double* x, const CellMotion& motion,
                          std::span<const Wrench> wrenches, double* g) const {
    static_cast<void>(t), static_cast<void>(x), static_cast<void>(motion), static_cast<void>(wrenches),
        static_cast<void>(g);
  }
  /// Discrete: brings the modes in line with (t, x); may set states that a mode fixes (a stuck speed to
  /// zero). True if anything changed; then a multi-step solver restarts.
  virtual bool switch_modes(double t, double* x, const CellMotion& motion, std::span<const Wrench> wrenches) {
    static_cast<void>(t), static_cast<void>(x), static_cast<void>(motion), static_cast<void>(wrenches);
    return false;
  }
  /// The next time after t at which the right-hand side has a corner known beforehand (a reference motion
  /// that starts to brake), or infinity: multi-step solvers restart there.
  virtual double next_time_event(double t) const {
    static_cast<void>(t);
    return std::numeric_limits<double>::infinity();
  }

  /// Discrete, before every step at time t, once commands have been applied: decisions that follow from where
  /// things are (who is in the furnace). May set states. True if anything changed that the right-hand side
  /// depends on; then a multi-step solver restarts. Asked of models besides robots, grippers and Parts.
  virtual bool decide(double t, double* x, const CellMotion& motion) {
    static_cast<void>(t), static_cast<void>(x), static_cast<void>(motion);
    return false;
  }
  /// Back to the discrete state that the model was made with.
  virtual void reset() {}

  // Stiffness inside the model, for linearly implicit solvers: an approximation of d xdot / d x of the
  // model's own segment. What is left out is treated explicitly. No entries: the whole model is.

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

  /// The model reduced to its velocities, for linear systems that couple models; the model outlives it. None:
  /// the model is coupled with no other, and its own entries (jacobian_pattern) are all.
  virtual std::unique_ptr<VelocityForm> make_velocity_form() const { return nullptr; }

  /// Typical sizes of the states, > 0: solvers with error control allow a state x of scale s an error of
  /// tolerance * (|x| + s) per step, and finite differences are taken over a fraction of it.
  virtual void state_scales(double* scales) const {
    for (int i = 0; i < state_count(); ++i) scales[i] = 1.0;
  }

  /// What the model keeps besides its segment of the state vector and influences its motion: discrete state
  /// (plant_models/state_bytes.h). load() throws StateError for what save() cannot have written.
  virtual void save(StateWriter& out) const { static_cast<void>(out); }
  virtual void load(StateReader& in) { static_cast<void>(in); }
};

}  // namespace takt
