#pragma once
// Penetrations of the Base's elements at one pose, from the candidate lists: the distance of each centroid
// inside the Target from the closest point of the Target's surface.
#include <cstdint>
#include <span>
#include <vector>

#include "server/contact/surface/contact_candidates.h"

namespace takt {

class ContactDepths {
 public:
  struct Plane {
    Vec3 normal_B;
    double offset_m;
  };
  /// An element whose closest point is on an edge or a vertex: its depth is that of a cylinder or a sphere.
  struct Bend {
    Vec3 normal_B;  ///< from the element to the closest point
    Vec3 edge_B;    ///< direction of the edge; zero for a vertex
  };

  /// Call after every rebuild of the lists.
  void prepare(const ContactCandidates& lists);
  /// `X_BT`: pose of the Target in the Base, the inverse of X_TB. `travelled_m`: grows from call to call by no less
  /// than any point of the Base moves.
  void find(const ContactSurface::Data& base, const ContactSurface::Data& target,
            const ContactCandidates& lists, const Pose& X_TB, const Pose& X_BT, double travelled_m);

  /// Without hits: the motion (m) below which there can be no hit; 0: unknown.
  double quiet_m() const { return hit_count_ > 0 ? 0.0 : quiet_m_; }

  /// Slots of the lists, ascending, that are inside the Target.
  std::span<const std::int32_t> hits() const { return {hits_.data(), hit_count_}; }
  // Of a slot that is hit:
  double depth_m(std::size_t slot) const { return depth_[slot]; }
  /// Outward normal of the Target at the closest point.
  const Vec3& normal_B(std::size_t slot) const {
    return bend_[slot] >= 0 ? bends_[static_cast<std::size_t>(bend_[slot])].normal_B
                            : planes_[static_cast<std::size_t>(plane_[slot])].normal_B;
  }
  /// Null where the closest point is inside a patch.
  const Bend* bend(std::size_t slot) const {
    return bend_[slot] < 0 ? nullptr : &bends_[static_cast<std::size_t>(bend_[slot])];
  }

 private:
  /// The patch that has the closest point of an element that is listed with faces of several patches.
  struct Stay {
    double until_m = -1.0;  ///< travelled length up to which it has it, and not on its border
    std::int32_t plane = -1;
    /// Calls between attempts to bound the length, until the next one, and that the last length has served.
    std::uint16_t wait = 0, left = 0, served = 0;
  };

  void find_single(const ContactSurface::Data& base, const ContactSurface::Data& target,
                   const ContactCandidates& lists, std::size_t number, const Pose& X_TB, const Pose& X_BT,
                   double moved_m, double travelled_m);
  void put_below(std::size_t slot, std::int32_t plane, const Vec3& p);

  std::vector<Plane> planes_;
  std::vector<Stay> stays_;          ///< of the singles
  std::vector<double> group_depth_;  ///< of the plane groups' elements
  // Per slot; zero depth: not hit.
  std::vector<double> depth_;
  std::vector<std::int32_t> plane_, bend_;
  std::vector<Bend> bends_;
  std::vector<std::int32_t> hits_;
  std::size_t hit_count_ = 0;
  double quiet_m_ = 0.0;
};

}  // namespace takt
