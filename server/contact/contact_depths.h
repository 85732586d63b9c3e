#pragma once
// Penetrations of the Base's elements at one pose, from the candidate lists.
#include <cstdint>
#include <span>
#include <vector>

#include "server/contact/contact_candidates.h"

namespace takt {

class ContactDepths {
 public:
  struct Plane {
    Vec3 normal_B;
    double offset_m;
  };

  /// New lists came.
  void prepare(const ContactSurface::Data& base, const ContactCandidates& lists);
  /// `X_BT`: pose of the Target in the Base, the inverse of X_TB.
  void find(const ContactSurface::Data& base, const ContactSurface::Data& target,
            const ContactCandidates& lists, const Pose& X_TB, const Pose& X_BT);

  /// Where nothing was hit: how far everything may move until something may be; 0 if that is not known.
  double quiet_m(const ContactCandidates& lists) const;

  /// Slots of the lists, ascending, whose line begins in the Target and leaves it again within its length.
  std::span<const std::int32_t> hits() const { return {hits_.data(), hit_count_}; }
  // Of a slot that is hit:
  double depth_m(std::size_t slot) const { return depth_[slot]; }
  double area_m2(std::size_t slot) const { return area_[slot]; }  ///< of the element times rim_weight
  bool fades(std::size_t slot) const { return fades_[slot] != 0; }
  /// Where it fades: gradient of the logarithm of the weight with the point met, axes of T (1/m).
  const Vec3& fade_T(std::size_t slot) const { return fade_T_[slot]; }
  const Plane& plane(std::size_t slot) const { return planes_[static_cast<std::size_t>(plane_[slot])]; }

 private:
  /// A face that one of the lines was found to cross well inside of, and where.
  struct Known {
    std::int32_t face = -1, plane = -1;
    double at_m = 0.0;
  };
  bool follow_known(const ContactSurface::Data& base, const ContactSurface::Data& target,
                    const ContactCandidates& lists, const ContactCandidates::Ray& ray, const Pose& X_TB);
  void learn(const ContactSurface::Data& base, const ContactSurface::Data& target,
             const ContactCandidates& lists, const ContactCandidates::Ray& ray, const Pose& X_TB);
  void take(const ContactSurface::Data& base, const ContactSurface::Data& target,
            const ContactCandidates& lists, const ContactCandidates::Ray& ray, double depth_m,
            std::int32_t plane, std::int32_t region, const Vec3& met_T);
  void follow(const ContactSurface::Data& base, const ContactSurface::Data& target,
              const ContactCandidates& lists, const ContactCandidates::Ray& ray, const Pose& X_TB);

  std::vector<Plane> planes_;
  std::vector<double> group_depth_;  ///< of the plane groups' elements
  // Per slot; zero depth: not hit.
  std::vector<double> depth_, area_;
  std::vector<std::uint8_t> fades_;
  std::vector<std::int32_t> plane_;
  std::vector<Vec3> fade_T_;
  std::vector<Known> known_;
  std::vector<std::int32_t> hits_;
  std::size_t hit_count_ = 0;
};

/// Weight of an element's area at s = distance of the point met from the nearest sharp convex edge of the
/// Target, over half the element's size. Zero at the edge, so that nothing jumps where elements slide over
/// it; its mean up to s = 1 is 1, so that the area in contact is kept on average.
constexpr double rim_weight(double s) {
  return s < 1.0 ? s * (4.0 - 3.0 * s) : 1.0;
}

}  // namespace takt
