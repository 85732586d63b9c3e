#pragma once
// Which side of a pair carries the contact elements.
#include "server/geometry/contact_surface.h"

namespace takt {

/// True if `first` should be the Base. The one with the smaller box carries the elements: all of its surface
/// may be in contact, and its elements resolve its own edges. Unless it is meshed so coarsely that the mean
/// edge of its elements is more than twice the other's. With equal boxes the finer one; with equal meshes the
/// lower id. Depends on the order of the arguments only through the ids.
inline bool first_is_base(const ContactSurface& first, int first_id, const ContactSurface& second,
                          int second_id) {
  const auto volume = [](const ContactSurface& s) {
    const Aabb& box = s.bounds_B();
    return (box.upper - box.lower).prod();
  };
  // Mean area of an element: the square of its edge, but for a factor that both sides share.
  const auto element_area = [](const ContactSurface& s) {
    return s.area_m2() / static_cast<double>(s.element_count());
  };
  const double first_area = element_area(first), second_area = element_area(second);
  if (first_area > 4.0 * second_area) return false;
  if (second_area > 4.0 * first_area) return true;
  const double first_volume = volume(first), second_volume = volume(second);
  if (first_volume != second_volume) return first_volume < second_volume;
  if (first_area != second_area) return first_area < second_area;
  return first_id < second_id;
}

}  // namespace takt
