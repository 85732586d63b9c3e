#pragma once
// Elements of the Base in contact with the distance field of the Target.
//
// u(x) is the depth of a centroid x in the Target by its field, with the gradient g, and P the pressure of the law, W its
// energy per area. An element has the energy A W(u(x)) and the force -A P(u) g, which is minus its gradient with the pose. Where
// g is shorter than 1, at edges that the field rounds, that is the force of an area A |g|.
//
// Pressure fields (Elandt, Drumwright, Sherman, Ruina: A pressure field model for fast, robust approximation of net contact
// force and moment between nominally rigid objects, IROS 2019; thesis 2.2.4, 6.2) of both sides are balanced along the
// line from x against g: it leaves the Target at the distance u. Where the layer of the Base is pressed in by s, that of
// the Target is by u - s. Both have the same pressure if they share u as their compliances, and that is P(u) of a law with both
// layers in series. So the law alone says which layers yield. The pressure acts on this line wherever they meet.
#include <cstdint>
#include <vector>

#include "server/contact/surface/contact_elements.h"
#include "server/geometry/surface/contact_surface_data.h"
#include "server/geometry/surface/distance_field.h"

namespace takt {

class FieldElements {
 public:
  FieldElements(const ContactSurface::Data& base, const DistanceField& target)
      : base_(base), target_(target) {}

  /// Finds the elements at a pose.
  void find(const Pose& X_TB);
  /// Fills the rows with them, and `elements` with their numbers, ascending.
  void fill(ElementRows& rows, std::vector<std::int32_t>& elements) const;
  /// Of all elements found.
  double elastic_energy_J(const ContactLaw& law) const;
  /// After element_forces with this detail: what the field adds to the stiffness, at the origin of B, axes of B. The tangent is
  /// the derivative; the secant has the part that never drives.
  void add_stiffness(ElementDetail detail, const ContactLaw& law, const Twist& V_B, const ElementRows& rows,
                     Mat6& K) const;
  /// Depth of the deepest element, its point and the direction inwards (T axes); 0 without elements.
  double deepest_m(Vec3& x_T, Vec3& inward_T) const;

 private:
  struct Hit {
    std::int32_t element;
    double depth_m, size;  ///< u, |g|
    Vec3 inward_B;         ///< g / |g|
  };
  void visit(std::size_t cluster);
  void add(std::size_t element);

  const ContactSurface::Data& base_;
  const DistanceField& target_;
  Pose X_TB_;
  std::vector<Hit> hits_;
};

}  // namespace takt
