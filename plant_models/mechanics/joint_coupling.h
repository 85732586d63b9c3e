#pragma once
// Joints of a tree that follow others by a gear, belt or linkage of constant ratio, as the fingers of a
// gripper do ("mimic" in URDF): q = G y + g with independent coordinates y. Without play and friction the
// coupling does no work, so the equations of motion in y are exact: (G^T M G) ydd = G^T (tau - bias).
#include <vector>

#include "plant_models/mechanics/multibody_tree.h"

namespace takt {

/// q[joint] = multiplier q[source] + offset. A source may follow another joint itself.
struct MimicJoint {
  int joint = -1;
  int source = -1;
  double multiplier = 1.0;
  double offset = 0.0;  ///< rad or m
};

class JointCoupling {
 public:
  /// Throws std::invalid_argument with the joint's number (from 1): no such joint, a joint that follows two
  /// others or, directly or indirectly, itself, values that are not finite, a joint that does not move its
  /// source's coordinate (multiplier 0 is allowed: the joint stands still).
  JointCoupling(int joint_count, const std::vector<MimicJoint>& mimics);

  int joint_count() const { return joint_count_; }
  int independent_count() const { return static_cast<int>(independent_.size()); }
  /// Joint of the tree that coordinate k is the position of.
  int independent_joint(int k) const { return independent_[static_cast<size_t>(k)]; }

  void positions(const double* y, double* q) const;     ///< q = G y + g
  void rates(const double* yd, double* qd) const;       ///< qd = G yd, and so for accelerations
  void forces(const double* tau, double* tau_y) const;  ///< tau_y = G^T tau

  /// Forces in the independent coordinates that cause ydd, after tree.update().
  void inverse_dynamics(const MultibodyTree& tree, const double* ydd, double* tau_y,
                        MultibodyTree::Workspace& w) const;
  /// Accelerations caused by the forces tau_y in the independent coordinates, after tree.update(). `locked`
  /// and `tau_lock` as in MultibodyTree::forward_dynamics(), by coordinate. Leaves the workspace as
  /// tree.inverse_dynamics() does, so that reactions can be computed.
  void forward_dynamics(const MultibodyTree& tree, const double* tau_y, const MultibodyTree::Mask& locked,
                        double* ydd, double* tau_lock, MultibodyTree::Workspace& w) const;

 private:
  struct Row {  ///< one non-zero entry of G per joint
    int coordinate = 0;
    double multiplier = 1.0, offset = 0.0;
  };
  int joint_count_;
  std::array<Row, kMaxJoints> rows_;
  std::vector<int> independent_;
};

}  // namespace takt
