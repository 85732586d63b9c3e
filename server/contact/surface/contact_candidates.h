#pragma once
// Candidate lists: the elements of a cluster that may be inside the Target, and the faces that may be closest
// to them, for all relative motions within a bound. They replace the walk through the bounding hierarchy
// between two rebuilds.
//
// All lists that are valid for a pose give an element the same depth, to the last bit: superfluous faces are
// further away than the closest one, and of equally close faces the lowest number counts.
#include <cstdint>
#include <span>
#include <vector>

#include "server/geometry/surface/contact_surface_data.h"

namespace takt {

class ContactCandidates {
 public:
  /// Elements whose closest point on the Target can only be inside of one patch: the depth is that below its
  /// plane.
  struct PlaneGroup {
    std::int32_t plane = -1;  ///< place in `patches`
    std::size_t begin = 0, end = 0;
  };
  /// A face that may be closest to an element.
  struct Near {
    std::int32_t face = -1, plane = -1;
    double at_least_m = 0.0;  ///< lower bound of its distance at the rebuild, less rounding
  };
  /// An element that must be tested against single faces.
  struct Single {
    std::int32_t slot = -1;
    std::size_t begin = 0, end = 0;  ///< in `near`, ascending distances
  };

  /// Work space for rebuilds. One serves the lists of all clusters.
  class Work;

  /// Whether the lists are valid for this pose. False without a rebuild().
  bool cover(const Pose& X_TB) const { return valid_ && moved_m(X_TB) <= bound_m_; }
  /// Upper bound of the motion of all centroids since the rebuild (m); NaN for a pose that is not finite.
  double moved_m(const Pose& X_TB) const;
  double bound_m() const { return bound_m_; }
  /// `above`: patches; the region above all their planes is outside of the Target (SeparatingPlanes), and so
  /// are elements that are above all of them by more than their possible motion. Empty: unknown.
  void rebuild(const ContactSurface::Data& base, const ContactSurface::Data& target,
               const ContactCluster& cluster, const Pose& X_TB, double bound_m,
               std::span<const std::int32_t> above, Work& work);
  void forget() { valid_ = false; }
  std::size_t slot_count() const { return element.size(); }

  std::vector<std::int32_t> element;  ///< per slot, ascending
  std::vector<std::int32_t> patches;  ///< that occur
  std::vector<PlaneGroup> plane_groups;
  std::vector<std::int32_t> plane_slot;  ///< per element of the groups, and its centroid:
  std::vector<double> px, py, pz;
  std::vector<Single> singles;  ///< ascending slots
  std::vector<Near> near;

 private:
  struct Build;

  void finish(const ContactSurface::Data& base, Work& work);
  void add_element(Build& build, std::int32_t index);
  std::int32_t local_patch(const Build& build, std::int32_t patch);

  bool valid_ = false;
  double bound_m_ = 0.0;
  double reach_m_ = 0.0;  ///< radius about the centre within which points move by no more than the bound
  Vec3 center_B_ = Vec3::Zero(), center_T_ = Vec3::Zero();
  Pose X_TB_;
};

class ContactCandidates::Work {
 private:
  friend class ContactCandidates;
  struct Found {
    double distance_m;
    std::int32_t face;
  };
  struct Simple {
    std::int32_t plane, slot;
  };
  std::vector<Found> found_;
  std::vector<Simple> simple_;
  std::vector<std::int32_t> local_;  ///< per patch of the Target its place in `patches`, or -1
};

}  // namespace takt
