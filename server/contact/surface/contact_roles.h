#pragma once
// Which side of a pair carries the contact elements.
#include "server/geometry/surface/contact_surface.h"
#include "server/geometry/surface/rim_strips.h"

namespace takt {

/// True if `first` should be the Base. The component with the smaller box is the Base: all of its surface may
/// be in contact, and its elements resolve its own edges. Exception: if its elements are coarser than the
/// shape of the other component, and the other's are finer, the other is the Base, because its protrusions
/// would pass between coarse elements. The meshing of plane faces has no effect. Ties of boxes: the finer
/// mesh; ties of meshes: the lower id. The order of the arguments matters only through the ids.
inline bool first_is_base(const ContactSurface& first, int first_id, const ContactSurface& second,
                          int second_id) {
  const auto volume = [](const ContactSurface& s) {
    const Aabb& box = s.bounds_B();
    return (box.upper - box.lower).prod();
  };
  // The square of an element's edge, up to a factor common to both sides.
  const double first_area = mean_element_area_m2(first), second_area = mean_element_area_m2(second);
  const auto too_coarse = [](double area, const ContactSurface& other, double other_area) {
    return area > 4.0 * other.patch_area_m2() && area > 4.0 * other_area;
  };
  if (too_coarse(first_area, second, second_area)) return false;
  if (too_coarse(second_area, first, first_area)) return true;
  const double first_volume = volume(first), second_volume = volume(second);
  if (first_volume != second_volume) return first_volume < second_volume;
  if (first_area != second_area) return first_area < second_area;
  return first_id < second_id;
}

}  // namespace takt
