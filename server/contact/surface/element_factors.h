#pragma once
// Derivatives of the forces of contact elements, a block of elements at a time: element_forces() fills a block, add_to_jacobian()
// adds it to its sums. A block stays in the processor's nearest cache.
#include <cstddef>

#include "server/contact/surface/contact_elements.h"
#include "server/contact/surface/simd4.h"

namespace takt {

/// Of up to kElements elements, besides their rows kKn and kCn.
class ElementFactors {
 public:
  static constexpr std::size_t kElements = 64;
  enum Row : std::size_t {
    kKt,
    kCt,  ///< factors of tangential displacement and velocity
    // For the tangent: along the direction t, and the change of friction with the normal force.
    kKtt,
    kCtt,
    kTx,
    kTy,
    kTz,
    kFx,
    kFy,
    kFz,
    // The whole force on the element.
    kSx,
    kSy,
    kSz,
    kRows
  };
  double* operator[](Row row) { return data_[row]; }
  const double* operator[](Row row) const { return data_[row]; }

 private:
  alignas(32) double data_[kRows][kElements];
};

/// Sum of c (1, p, p p^T), for isotropic stiffness at p.
struct PointSums {
  simd4::V4 c{}, x{}, y{}, z{}, xx{}, yy{}, zz{}, xy{}, xz{}, yz{};
};

/// Upper triangles of two symmetric matrices.
struct SymmetricSums {
  simd4::V4 k[21]{}, d[21]{};
};

/// Sums over the elements, of which K and D consist.
struct JacobianSums {
  SymmetricSums normal, along;
  PointSums k_point, d_point;
  // For the tangent: outer products of different directions, the elements' forces, and p f^T.
  simd4::V4 k[36]{}, d[36]{}, forces[3]{}, turned[9]{};
};

/// Adds the elements of the rows from `begin` to `end`, of which `factors` are; both are whole groups of four.
void add_to_jacobian(const ContactLaw& law, const Twist& V_B, ElementDetail detail, const ElementRows& rows,
                     const ElementFactors& factors, std::size_t begin, std::size_t end, JacobianSums& sums);
/// `K`, `D` of the sums, as of element_forces.
void finish_jacobian(const ContactLaw& law, ElementDetail detail, const JacobianSums& sums, Mat6& K, Mat6& D);

}  // namespace takt
