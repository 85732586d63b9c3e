#pragma once
// The substitute force (SFA, thesis 3.4.1): a spring and damper that holds a Part (Base) at the pose relative
// to its partner (Target) at which the connection closed. capture_offset() stores that pose once; the wrench
// follows from it.
//
// Differences from the printed formulas, each covered by a test:
// - (3.1) to (3.6) take both forces at the frame origins and the relative velocity of the origins: then
//   moments do not balance and a common rotation is damped. Here both forces act at one point, the Base's
//   centre of mass; the damper uses the velocity of the Target-fixed point at that place; the Target gains
//   the moment -r x f.
// - (3.8) needs T_Offset transposed, else the torque is not zero at closing; the third entry of (3.10) has
//   the wrong sign. Here the relative rotation is a vector in world axes, which avoids both.
// - The reference point is the Base's centre of mass, not its frame origin, so that translation and rotation
//   decouple and critical damping is exact for both.
// - Weight feed-forward (not in the thesis): the wrench carries the Base's weight, the spring only the rest.
//   A handover then neither sags by m g / k nor jumps in force.
#include "plant_models/mechanics/multibody_tree.h"
#include "plant_models/plant_model.h"
#include "server/components/component.h"
#include "server/contact/pair_linearisation.h"

namespace takt {

/// A Base that is turned in its connection during a step, about an axis through its centre of mass.
struct ConnectionTurn {
  Vec3 axis_B = Vec3::UnitZ();
  double angle_rad = 0.0, travel_m = 0.0;  ///< about and along the axis, of the whole step
  double step_s = 1.0;
  double torque_N_m = 0.0;  ///< about the axis, on the Target; the opposite on the driver
  int driver = -1;          ///< component id, or -1: no motion
};

/// A closed connection of a Part: its holder and the offset. Captured between steps, constant during a step.
struct Connection {
  int partner = -1;                    ///< component id of the Target, or -1: free
  Vec3 p_TBcm_T = Vec3::Zero();        ///< centre of mass of the Base in the Target's frame (3.2)
  Mat3 R_TB = Mat3::Identity();        ///< orientation of the Base in the Target's frame (3.7)
  SubstituteParameters gains;          ///< constants in force for this connection
  double softening = 1.0;              ///< ratio of these to the Base's own; below 1 on a free Target
  Vec3 feed_forward_W = Vec3::Zero();  ///< constant force on the Base (N): minus its weight, or zero
  ConnectionTurn turn;                 ///< of the present step
  /// Velocity at which the held pose slides over the Target (or its moving surface) from a time on, which is the begin of
  /// the present step. Zero, and not evaluated, unless `slides`.
  Vec3 slide_W = Vec3::Zero();
  double slide_from_s = 0.0;
  bool slides = false;
};

/// Captures the offsets of a connection at closing.
void capture_offset(const BodyMotion& base, const BodyMotion& target, Connection& connection);

/// Advances the offset by `turn`, which also sets the prescribed angular velocity of the Base.
void turn_offset(const ConnectionTurn& turn, Connection& connection);

/// All Bases of one free Target (a Part without support, or the inertia of a compliant Gripper), and the
/// factor by which their connections must be softened.
///
/// The Target swings under all its connections at once. With M_T its inertia and K_T the sum of their
/// stiffness acting on the Target (both 6 x 6, about its centre of mass), no mode of the system is faster
/// than max(k/m) + max eig(M_T^-1 K_T); scaled by the ratio of the first term to this sum, no mode is faster
/// than the fastest Base alone. The same holds for the damping. Otherwise a light Target, or one with many
/// Bases, would raise the frequency past the solver's limit. The thesis has no such case: its assemblies are
/// held.
///
/// In a free cluster with arbitrary connections (SFA and extended SFA), each Part counts all its connections,
/// as Target and as Base. A pair's energy k |u_a - u_b|^2 is at most 2 k (|u_a|^2 + |u_b|^2), so half the
/// ratio is enough for each end, and a connection takes the smaller factor of its two ends.
class FreeTargetLoad {
 public:
  explicit FreeTargetLoad(const Component& target)
      : own_(&target), inertia_{target.mass_kg, target.p_BBcm, target.I_BBcm_B} {}
  explicit FreeTargetLoad(const BodyInertia& target) : inertia_(target) {}
  /// `connection` must hold the offset of the Base in the Target. Uses the Base's own constants.
  void add(const Component& base, const Connection& connection);
  /// A connection of which the Part itself is the Base. Only where the Target is a Part.
  void add_own();
  /// Factor for the constants of every connection added, in (0, 1).
  double scale() const;
  /// The same if the other ends of the connections move as well; 1 without connections.
  double shared_scale() const;

 private:
  using Mat6 = Eigen::Matrix<double, 6, 6>;
  void note_rates(const Component& base);
  Mat6 inertia() const;

  const Component* own_ = nullptr;                ///< the Target, where it is a Part
  BodyInertia inertia_;                           ///< of the Target
  Mat6 K_T_ = Mat6::Zero(), D_T_ = Mat6::Zero();  ///< axes of the Target
  double stiffest_ = 0.0, most_damped_ = 0.0;     ///< of a Base alone: k/m (1/s^2), d/m (1/s)
};

/// Constants times a factor.
SubstituteParameters scaled(const SubstituteParameters& gains, double factor);

/// Wrench on the Base about its centre of mass, world frame: (3.5) and (3.12) with the corrections above. `target`: the motion of
/// what carries the Base (CellMotion::carrier). `time_s`: of the motion, for a connection that slides.
Wrench substitute_wrench(const Connection& connection, const BodyMotion& base, const BodyMotion& target,
                         double time_s = 0.0);

/// How that changes with the motion, at small angles between the Base and where it should be: about the
/// Base's centre of mass. Constant but for the axes of the rotational part.
PairLinearisation substitute_linearisation(int base_id, const Connection& connection, const BodyMotion& base);

/// The balanced reaction: wrench on the Target about its reference point p_WBcm.
inline Wrench reaction_on_target(const Wrench& on_base, const BodyMotion& base, const BodyMotion& target) {
  return {-on_base.f, -on_base.t - (base.p_WBcm - target.p_WBcm).cross(on_base.f)};
}

}  // namespace takt
