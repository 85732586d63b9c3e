#pragma once
// Which elements of a cluster may meet which faces of the Target while the two move relative to each other by
// no more than a motion bound: what the evaluations between two walks through the bounding hierarchy need.
//
// With any lists that are valid for a pose an element gets the same depth, to the last bit: depths are always
// taken from the plane of the patch in the frame of the Base, extra candidates are not met, and of several
// hits the nearest counts. This holds for solids that do not overlap themselves.
#include <cstdint>
#include <span>
#include <vector>

#include "server/geometry/contact_surface_data.h"

namespace takt {

class ContactCandidates {
 public:
  /// Elements that can only meet the inside of one patch, far from rims: the depth is that of its plane.
  struct PlaneGroup {
    std::int32_t plane = -1;  ///< place in `patches`
    std::size_t begin = 0, end = 0;
  };
  /// Faces of one patch that an element may meet.
  struct FaceGroup {
    std::int32_t plane = -1;
    std::size_t begin = 0, end = 0;  ///< in `faces`
  };
  /// An element that needs a look at single faces.
  struct Ray {
    std::int32_t slot = -1;
    std::size_t group_begin = 0, group_end = 0;
    std::size_t rim_begin = 0, rim_end = 0;
    /// Its line crosses the surface near its beginning once, inside or not: where it is within one face,
    /// there is no other to look at.
    bool single = false;
  };

  /// What making lists needs for a time. One serves the lists of all clusters.
  class Work;

  /// Valid for this pose? False before the first rebuild().
  bool cover(const Pose& X_TB) const { return valid_ && moved_m(X_TB) <= bound_m_; }
  /// What no point of the lines has moved beyond since the lists were made; not a number for such a pose.
  double moved_m(const Pose& X_TB) const;
  double bound_m() const { return bound_m_; }
  /// `above`: patches; what is above all their planes is outside of the Target (FreeRegion), and so are
  /// elements that are above all of them by more than they may move. Empty: none known.
  void rebuild(const ContactSurface::Data& base, const ContactSurface::Data& target,
               const ContactCluster& cluster, const Pose& X_TB, double bound_m,
               std::span<const std::int32_t> above, Work& work);
  void forget() { valid_ = false; }
  std::size_t slot_count() const { return element.size(); }

  std::vector<std::int32_t> element;  ///< per slot, ascending
  std::vector<std::int32_t> patches;  ///< that occur
  std::vector<PlaneGroup> plane_groups;
  std::vector<std::int32_t> plane_slot;  ///< per element of the groups, and its data:
  std::vector<double> px, py, pz, nx, ny, nz, line_m;
  std::vector<Ray> rays;  ///< ascending slots
  std::vector<FaceGroup> face_groups;
  std::vector<std::int32_t> faces;
  std::vector<std::int32_t> rims;

 private:
  /// Bounds the turn of the Base between rebuilds, so that a line that leaves through a patch keeps doing so.
  static constexpr double kLargestTurn = 0.05;  // rad, roughly: bound over radius
  static constexpr std::int32_t kNothing = -1, kSeveral = -2;
  /// Penetration line at the pose of the lists, axes of T.
  struct Line {
    Vec3 p, d;
    double length_m, fade_m;
  };
  struct Build;

  void finish(const ContactSurface::Data& base, Work& work);
  void add_element(const Build& build, std::int32_t index);
  std::int32_t start_patch(const Build& build, const Line& line, bool& steep) const;
  bool simple(const Build& build, const Line& line, std::int32_t patch) const;
  bool local(const Build& build, const Line& line) const;
  void gather(const Build& build, const Line& line, double length_m) const;
  std::int32_t first_patch(const Build& build, const Line& line, bool& outside) const;
  void add_ray(const Build& build, const Line& line, std::int32_t index, double length_m, bool single);
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
  struct Near {
    std::int32_t face, patch;
  };
  struct Simple {
    std::int32_t plane, slot;
  };
  std::vector<Near> near_;
  std::vector<Simple> simple_;
  std::vector<std::int32_t> local_;  ///< per patch of the Target its place in `patches`, or -1
};

}  // namespace takt
