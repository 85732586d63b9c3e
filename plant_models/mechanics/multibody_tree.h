#pragma once
// Rigid-body dynamics of a tree of links: a robot arm with everything mounted on it. Recursive Newton-Euler,
// composite-rigid-body mass matrix, articulated-body forward dynamics (Featherstone, Rigid Body Dynamics
// Algorithms, 2008, chapters 5 to 7).
//
// Frames: R is the tree's base frame (fixed in the world, or with a prescribed motion: set_base()), L_i the frame
// of link i, which coincides with joint i (URDF convention, as in robot/arm_kinematics.h: X_PJ places the joint in
// its parent link at position zero, `axis` is a unit vector in L_i). Fixed joints are folded into their parent while
// loading, so link i and moving joint i share an index, and a parent's index is lower than its children's.
//
// All quantities of the algorithms have the axes of R and refer to the origin of their own link: the
// recursion needs no rotations, and poses and wrenches have the form that the rest of the cell uses.
//
// No function allocates after construction. A MultibodyTree holds the constants; a Workspace, which belongs
// to one caller, holds all intermediate results.
#include <array>
#include <span>
#include <string>
#include <vector>

#include "plant_models/mechanics/vector3.h"
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

/// Inertia of both bodies together, in the frame of the first; X_AB places the second in it.
BodyInertia combined(const BodyInertia& a, const BodyInertia& b, const Pose& X_AB);

/// Describes the fault of an inertia, with its figures; empty if the equations of motion can be solved with
/// it: finite, mass not negative, tensor symmetric and positive semidefinite; a massless body without
/// inertia.
std::string inertia_problem(const BodyInertia& inertia);
/// Describes an inertia that no body of positive density has: a principal moment larger than the sum of the
/// others. Published models have such tensors for rotation about one axis. Empty for a possible inertia.
std::string inertia_remark(const BodyInertia& inertia);

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

  struct Workspace;  ///< intermediate results of one caller (below)

  /// Throws std::invalid_argument with the joint's name: a parent that follows its child, more than kMax
  /// joints, an axis that is not a unit vector, a negative armature, an inertia that is not physical
  /// (inertia_problem()), a joint that moves no inertia.
  explicit MultibodyTree(TreeModel model);

  const TreeModel& model() const { return model_; }
  int joint_count() const { return model_.joint_count(); }

  /// The base moves: velocity and acceleration of its origin and angular ones, relative to the world, and gravity, all in the
  /// axes of R. Call it ahead of update(); in a fresh workspace the base is fixed. Twists of links are then relative to the
  /// world, too.
  void set_base(const Twist& V_R, const Twist& A_R, const Vec3& gravity_R, Workspace& w) const;
  /// In the axes of R.
  Vec3 gravity(const Workspace& w) const;

  /// Poses X_RL and velocities of all links at (q, qd). Everything below works on this.
  void update(const double* q, const double* qd, Workspace& w) const;

  Pose link_pose(int link, const Workspace& w) const;    ///< X_RL
  Twist link_twist(int link, const Workspace& w) const;  ///< of the origin of L, axes of R
  /// Acceleration of the origin of L and angular acceleration, axes of R, after inverse_dynamics() or
  /// forward_dynamics(); without gravity (it is zero for a link at rest).
  Twist link_acceleration(int link, const Workspace& w) const;

  /// Wrench on link `link` about the origin of L, axes of R; adds up until clear_wrenches(). It is zero in a
  /// fresh workspace.
  void clear_wrenches(Workspace& w) const;
  void add_wrench(int link, const Wrench& F_Lo_R, Workspace& w) const;

  /// Joint forces that cause qdd (recursive Newton-Euler), gravity, applied wrenches and armature included.
  void inverse_dynamics(const double* qdd, double* tau, Workspace& w) const;

  /// Accelerations caused by joint forces (articulated-body algorithm). A locked joint does not follow its
  /// force: it moves with the acceleration that qdd[i] holds on entry (zero: it keeps its velocity), and
  /// `tau_lock[i]` is the necessary force in addition to tau[i]. For other joints `tau_lock[i]` is zero and
  /// qdd[i] is an output.
  void forward_dynamics(const double* tau, const Mask& locked, double* qdd, double* tau_lock,
                        Workspace& w) const;

  /// Joint-space mass matrix with armature (composite rigid bodies).
  void mass_matrix(MassMatrix& M, Workspace& w) const;

  /// Wrench of the tree on its foundation about the origin of R, axes of R, after inverse_dynamics() or
  /// forward_dynamics(). The base link itself is not part of the tree.
  Wrench base_reaction(const Workspace& w) const;
  /// Force and torque the parent side exerts on link i through joint i (drive included), about the origin of
  /// L_i, axes of R, after inverse_dynamics() or forward_dynamics().
  Wrench joint_wrench(int link, const Workspace& w) const;

  double kinetic_energy(const Workspace& w) const;    ///< J, armature included
  double potential_energy(const Workspace& w) const;  ///< J, zero at the origin of R

 private:
  /// A link as the algorithms use it, in a frame A of its own: origin of L, z along the joint's axis, so that
  /// a revolute joint turns about z.
  struct Link {
    mechanics::M3 R_PA;  ///< at position zero; P is the frame A of the parent
    mechanics::V3 p_PA;
    mechanics::V3 moment_A;   ///< mass times centre of mass
    mechanics::S3 inertia_A;  ///< about the origin
    double mass = 0.0;
    double armature = 0.0;
    int parent = -1;
    bool revolute = true;
    Mat3 R_AL;
  };

  const mechanics::V3& minus_gravity(const Workspace& w) const;

  TreeModel model_;
  std::vector<Link> links_;
  mechanics::V3 minus_gravity_;
};

struct MultibodyTree::Workspace {
  struct LinkState {
    // From update(). Velocity-dependent accelerations are those of a link without acceleration of parent and
    // joint.
    mechanics::M3 R;         ///< axes A of the link in R
    mechanics::V3 p;         ///< origin, from the origin of R
    mechanics::V3 r;         ///< origin, from the origin of the parent
    mechanics::V3 w, v;      ///< angular velocity, velocity of the origin
    mechanics::V3 c_w, c_v;  ///< velocity-dependent accelerations
    mechanics::V3 moment;    ///< mass times centre of mass, from the origin

    mechanics::V3 ext_t, ext_f;  ///< applied wrench

    mechanics::V3 a_w, a_v;  ///< accelerations; gravity counts as an acceleration of the base
    mechanics::V3 t, f;      ///< wrench through the joint; after a forward pass for d_w = d_v = 0

    // Forward pass: the joint's wrench is [t; f] + [J H; H^T M] [d_w; d_v], where d is the link's additional
    // acceleration by joint forces, relative to its acceleration without joint acceleration.
    mechanics::S3 J, M;
    mechanics::M3 H;
    mechanics::V3 U_t, U_f;  ///< joint wrench per joint acceleration
    double inverse_D = 0.0;  ///< of the joint force per joint acceleration
    double u = 0.0;          ///< joint force that is left for accelerating
    mechanics::V3 d_w, d_v;
  };
  struct Base {
    bool moves = false;
    mechanics::V3 w, v, a_w, a_v;  ///< as of links; gravity not included
    mechanics::V3 minus_gravity;
  };
  Base base;
  std::array<LinkState, kMax> links;
  std::array<double, kMax> qd{};
  bool forward = false;  ///< the last pass was forward_dynamics()
};

inline const mechanics::V3& MultibodyTree::minus_gravity(const Workspace& w) const {
  return w.base.moves ? w.base.minus_gravity : minus_gravity_;
}

}  // namespace takt
