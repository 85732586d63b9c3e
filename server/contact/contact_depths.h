#pragma once
// Penetrations of the Base's elements at one pose, from the candidate lists.
#include <cstdint>
#include <vector>

#include "server/contact/contact_candidates.h"

namespace takt {

class ContactDepths {
 public:
  /// An element whose line begins in the Target and leaves it again within its length.
  struct Hit {
    std::int32_t element;
    std::int32_t plane;  ///< place in the planes below
    double depth_m;
    double weight;  ///< of the element's area, see rim_weight
    Vec3 fade_T;    ///< gradient of the logarithm of the weight with the point met, axes of T (1/m)
  };
  struct Plane {
    Vec3 normal_B;
    double offset_m;
  };

  /// New lists came.
  void prepare(const ContactCandidates& lists);
  /// Hits, ascending by element. `X_BT`: pose of the Target in the Base, the inverse of X_TB.
  void find(const ContactSurface::Data& base, const ContactSurface::Data& target,
            const ContactCandidates& lists, const Pose& X_TB, const Pose& X_BT);

  const std::vector<Hit>& hits() const { return hits_; }
  const Plane& plane(std::int32_t place) const { return planes_[static_cast<std::size_t>(place)]; }

 private:
  struct Slot {
    double depth_m = 0.0, weight = 1.0;
    std::int32_t plane = -1;
    Vec3 fade_T = Vec3::Zero();
  };
  void follow(const ContactSurface::Data& base, const ContactSurface::Data& target,
              const ContactCandidates& lists, const ContactCandidates::Ray& ray, const Pose& X_TB);

  std::vector<Plane> planes_;
  std::vector<double> plane_depth_;  ///< of the plane groups' elements
  std::vector<Slot> slots_;
  std::vector<Hit> hits_;
};

/// Weight of an element's area at s = distance of the point met from the nearest sharp convex edge of the
/// Target, over half the element's size. Zero at the edge, so that nothing jumps where elements slide over
/// it; its mean up to s = 1 is 1, so that the area in contact is kept on average.
constexpr double rim_weight(double s) {
  return s < 1.0 ? s * (4.0 - 3.0 * s) : 1.0;
}

}  // namespace takt
