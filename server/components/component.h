#pragma once
// The component database: every Part, Gripper and Ground of a cell (thesis 3.2.1), constant after loading.
// Names are looked up only during loading; afterwards a component's id is its index.
#include <string>
#include <vector>

#include "server/geometry/convex/convex_parts.h"
#include "takt_enumerations.h"

namespace takt {

/// Constants of the spring-damper that holds a Part to its partner (thesis 3.4.1, 5.1.1). Rotation uses
/// matrices in the Part's axes: scaled with the inertia they give every axis the same pole.
struct SubstituteParameters {
  double k_tr_N_per_m = 0.0;
  double d_tr_N_s_per_m = 0.0;
  Mat3 K_rot_B = Mat3::Zero();  ///< N m/rad
  Mat3 D_rot_B = Mat3::Zero();  ///< N m s/rad
};

/// Role of a component of type Gripper.
enum class GripperRole : std::uint8_t { none, palm, left_jaw, right_jaw };

struct Component {
  std::string name;
  ComponentType type = ComponentType::part;
  int hierarchy = 0;  ///< Parts only; higher is further down the assembly (thesis 3.4.2)
  /// Decomposition for the collision check, in B; empty for the palm of a gripper.
  ConvexParts convex;
  BodyBox box;  ///< bounds of all convex shapes

  // Parts only.
  double mass_kg = 0.0;
  Vec3 p_BBcm = Vec3::Zero();
  Mat3 I_BBcm_B = Mat3::Zero();
  SubstituteParameters substitute;

  // Grippers only.
  int gripper = -1;  ///< index into CellModel::grippers
  GripperRole role = GripperRole::none;
};

/// Spring constant from the static position error that the weight may cause, thesis (5.6) to (5.8): k = m g /
/// error.
double translational_stiffness(double mass_kg, double gravity_m_per_s2, double allowed_error_m);
/// Damping constant from the damping ratio (Lehr), thesis (5.9), (5.10), (A.12): d = 2 D sqrt(m k).
double translational_damping(double mass_kg, double stiffness_N_per_m, double damping_ratio);

/// All four constants for a Part. The rotational ones, which the thesis leaves to the user, use the
/// translational poles: K = I k/m and D = I d/m.
SubstituteParameters substitute_parameters(double mass_kg, const Mat3& I_BBcm_B, double gravity_m_per_s2,
                                           double allowed_error_m, double damping_ratio);

}  // namespace takt
