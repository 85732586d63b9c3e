#pragma once
// Forces of contact elements and their derivatives: (2.17) to (2.21) and the stick law over rows of numbers,
// several elements at a time. Everything in the axes of the Base, moments about its origin.
//
// Results do not depend on the processor: every variant does the same operations in the same order, and sums
// run in four lanes that are joined in a fixed order.
#include <cstddef>
#include <cstdint>
#include <vector>

#include "plant_models/spatial.h"
#include "server/contact/pair_linearisation.h"
#include "server/contact/surface/contact_law.h"

namespace takt {

/// Depth of p below the plane `normal` . x = `offset`; negative above. Shared by the loops over many elements
/// and by single elements, so that both give the same bits.
inline double plane_depth(double normal_x, double normal_y, double normal_z, double offset, double px,
                          double py, double pz) {
  return offset - (normal_x * px + normal_y * py + normal_z * pz);
}

/// Rows of numbers of the elements in contact.
class ElementRows {
 public:
  enum Row : std::size_t {
    kPx,
    kPy,
    kPz,  ///< centroid
    kNx,
    kNy,
    kNz,  ///< into the Target: gradient of the penetration with the centroid
    kArea,
    kDepth,  ///< penetration
    kAx,
    kAy,
    kAz,        ///< stick: where the element is with its spring relaxed, in the frame of the anchors
    kTied,      ///< stick: 1 with a spring; 0: none yet, friction is regularised
    kForce,     ///< result: normal force
    kPressure,  ///< result: normal force per area
    kKn,
    kCn,  ///< results with a Jacobian: factors of normal displacement and velocity
    kRows
  };
  /// Room for `count` elements, padded to whole groups. Old contents are lost where that changes losses().
  void resize(std::size_t count);
  std::size_t count() const { return count_; }
  std::size_t padded() const { return padded_; }
  std::size_t losses() const { return losses_; }
  double* operator[](Row row) { return data_.data() + row * stride_; }
  const double* operator[](Row row) const { return data_.data() + row * stride_; }

 private:
  std::vector<double> data_;
  std::size_t count_ = 0, padded_ = 0, stride_ = 0, losses_ = 0;
};

enum class ElementDetail : std::uint8_t { forces, secant, tangent };

struct ElementTotals {
  Vec3 f_B = Vec3::Zero(), t_B = Vec3::Zero();  ///< on the Base, about its origin
  double elements = 0.0, area_m2 = 0.0, normal_force_N = 0.0, friction_force_N = 0.0;
  double largest_pressure_Pa = 0.0, largest_penetration_m = 0.0;
  /// Of all elements inside, including those whose tension (2.20) cuts off.
  double elastic_energy_J = 0.0;
  Vec3 weighted_p_B = Vec3::Zero();  ///< sum of normal force times position
};

/// `V_B`: velocity of the Base relative to the Target at the origin of B, axes of B. `surface_B`: velocity of the material of the
/// Target's surface relative to the Target, likewise, or nullptr if it rests; it acts on friction alone. `X_BA`: frame of the
/// anchors, for the stick law.
ElementTotals element_forces(const ContactLaw& law, const Twist& V_B, ElementRows& rows, const Pose& X_BA,
                             const Twist* surface_B);

/// The same with their derivatives. `K`, `D` at the point of the Target that coincides with the origin of B, axes of B. `detail`:
/// secant or tangent.
ElementTotals element_forces(const ContactLaw& law, const Twist& V_B, ElementDetail detail, ElementRows& rows,
                             const Pose& X_BA, const Twist* surface_B, Mat6& K, Mat6& D);

/// The normal forces of element_forces() alone.
void element_normal_forces(const ContactLaw& law, const Twist& V_B, ElementRows& rows);

/// After either: anchors of springs that pull by more than friction allows follow to where they pull by that. `X_TA`: frame of
/// the anchors, or nullptr if that is T.
void slip_anchors(const ContactLaw& law, const Pose& X_TB, ElementRows& rows, const Pose* X_TA = nullptr);

/// depth[k] = plane_depth of element k.
void plane_depths(const Vec3& normal, double offset, std::size_t count, const double* px, const double* py,
                  const double* pz, double* depth);

}  // namespace takt
