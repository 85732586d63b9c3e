#pragma once
// Rigid-body dynamics of a tree of links: a robot arm with whatever is mounted on it. Recursive Newton-Euler,
// composite-rigid-body mass matrix, articulated-body forward dynamics (Featherstone, Rigid Body Dynamics
// Algorithms, 2008, chapters 5 to 7).
//
// Frames: R is the tree's base frame (fixed in the world), L_i the frame of link i, which coincides with
// joint i (URDF convention, as in robot/arm_kinematics.h: X_PJ places the joint in its parent link at
// position zero, `axis` is a unit vector in L_i). Fixed joints are folded into their parent while loading, so
// link i and moving joint i share an index, and a parent's index is lower than its children's.
//
// Nothing here allocates once the tree exists. A MultibodyTree holds the constants; a Workspace, which
// belongs to one caller, all intermediate results.
#include <array>
#include <span>
#include <string>
#include <vector>

#include "plant_models/robot/arm_kinematics.h"
#include "plant_models/spatial.h"

namespace takt {

/// Mass, centre of mass in the frame of the body (m), inertia about the centre of mass in axes parallel to
/// the frame (kg m^2).
struct BodyInertia {
  double mass_kg = 0.0;
  Vec3 p_BBcm_B = Vec3::Zero();
  Mat3 I_BBcm_B = Mat3::Zero();
};

/// Both bodies as one, in the frame of the first; X_AB places the second in it.
BodyInertia combined(const BodyInertia& a, const BodyInertia& b, const Pose& X_AB);

struct TreeJoint {
  JointModel joint;       ///< name, type, X_PJ, axis, limits
  int parent = -1;        ///< index of the parent link, -1: the base
  BodyInertia inertia;    ///< of link i with all that is rigidly fixed to it, in L_i
  double armature = 0.0;  ///< inertia of the joint's own drive, reflected to the joint (kg m^2 or kg)
};

struct TreeModel {
  std::vector<TreeJoint> joints;  ///< at most kMaxJoints
  Vec3 gravity_R{0.0, 0.0, -9.80665};
  int joint_count() const { return static_cast<int>(joints.size()); }
};

class MultibodyTree {
 public:
  static constexpr int kMax = kMaxJoints;
  using MassMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMax, kMax>;
  using Mask = std::array<bool, kMax>;

  struct Workspace;  ///< intermediate results of one caller (defined below the algorithms' needs)

  /// Throws std::invalid_argument naming the joint: a parent not before its child, more than kMax joints, a
  /// mass or inertia that is not physical (mass < 0, not finite, inertia not positive semidefinite or beyond
  /// the triangle inequality), a leaf that could move without any inertia.
  explicit MultibodyTree(TreeModel model);

  const TreeModel& model() const { return model_; }
  int joint_count() const { return model_.joint_count(); }

  /// Poses X_RL and velocities of all links at (q, qd). Everything below works on this.
  void update(const double* q, const double* qd, Workspace& w) const;

  const Pose& link_pose(int link, const Workspace& w) const;  ///< X_RL
  Twist link_twist(int link, const Workspace& w) const;       ///< of the origin of L, axes of R

  /// Wrench on link `link` about the origin of L, axes of R; adds up until clear_wrenches().
  void clear_wrenches(Workspace& w) const;
  void add_wrench(int link, const Wrench& F_Lo_R, Workspace& w) const;

  /// Joint forces that cause qdd (recursive Newton-Euler), gravity, applied wrenches and armature included.
  void inverse_dynamics(const double* qdd, double* tau, Workspace& w) const;

  /// Accelerations caused by joint forces (articulated-body algorithm). A locked joint is held at its present
  /// velocity (qdd = 0) and `tau_lock[i]` is the force its brake supplies on top of tau[i]; it is zero for
  /// joints that are not locked.
  void forward_dynamics(const double* tau, const Mask& locked, double* qdd, double* tau_lock,
                        Workspace& w) const;

  /// Joint-space mass matrix with armature (composite rigid bodies).
  void mass_matrix(MassMatrix& M, Workspace& w) const;

  /// Wrench of the tree on its foundation about the origin of R, axes of R, after inverse_dynamics() or
  /// forward_dynamics().
  Wrench base_reaction(const Workspace& w) const;
  /// Force and torque the parent side exerts on link i through joint i, about the origin of L_i, axes of R,
  /// after inverse_dynamics() or forward_dynamics().
  Wrench joint_wrench(int link, const Workspace& w) const;

  double kinetic_energy(const Workspace& w) const;    ///< J, armature included
  double potential_energy(const Workspace& w) const;  ///< J, zero at the origin of R

 private:
  TreeModel model_;
};

}  // namespace takt
