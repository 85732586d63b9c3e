#pragma once
// Which elements of the Base may meet which faces of the Target while the two move relative to each other by
// no more than a motion bound: what the evaluations between two walks through the bounding hierarchies need.
//
// With any lists that are valid for a pose an element gets the same depth, to the last bit: depths are always
// taken from the plane of the patch in the frame of the Base, extra candidates are not met, and of several
// hits the nearest counts. This holds for solids that do not overlap themselves.
#include <cstdint>
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
  };

  /// Valid for this pose? False before the first rebuild().
  bool cover(const Pose& X_TB) const;
  void rebuild(const ContactSurface::Data& base, const ContactSurface::Data& target, const Pose& X_TB,
               double bound_m);
  void forget() { valid_ = begun_ = false; }
  /// Room for lists as long as the other's ever were: of two that take turns neither grows alone.
  void make_room_as(const ContactCandidates& other);

  // The same in pieces, so that no single evaluation has to wait for all of it.
  void begin(const ContactSurface::Data& base, const ContactSurface::Data& target, const Pose& X_TB,
             double bound_m);
  /// Goes on until at least this share of the work is done; with 1 the lists are complete. Same surfaces as
  /// for begin().
  void advance(const ContactSurface::Data& base, const ContactSurface::Data& target, double share);
  bool begun() const { return begun_; }  ///< and not complete
  bool complete() const { return valid_; }
  /// Share of the bound that the motion from the pose of the lists to this one takes: above 1 not covered.
  double used(const Pose& X_TB) const;
  const Pose& X_TB() const { return X_TB_; }  ///< pose of the lists

  std::size_t slot_count() const { return element.size(); }
  double bound_m() const { return bound_m_; }
  /// The largest bound that lists for this Base can have.
  static double largest_bound_m(const ContactSurface::Data& base) { return kLargestTurn * base.radius_m; }

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
  struct Near {
    std::int32_t face, patch;
  };
  struct Simple {
    std::int32_t plane, slot;
  };
  /// Penetration line at the pose of the lists, axes of T.
  struct Line {
    Vec3 p, d;
    double length_m, fade_m;
  };
  struct Build;

  void finish(const ContactSurface::Data& base);
  void add_element(const Build& build, std::int32_t index);
  std::int32_t start_patch(const Build& build, const Line& line, bool& steep) const;
  bool simple(const Build& build, const Line& line, std::int32_t patch) const;
  bool local(const Build& build, const Line& line) const;
  void gather(const Build& build, const Line& line, double length_m);
  std::int32_t first_patch(const Build& build, const Line& line, bool& outside) const;
  void add_ray(const Build& build, const Line& line, std::int32_t index, double length_m);
  std::int32_t local_patch(std::int32_t patch);

  bool valid_ = false, begun_ = false;
  double bound_m_ = 0.0;
  double reach_m_ = 0.0;  ///< radius about the centre within which points move by no more than the bound
  Vec3 center_B_ = Vec3::Zero(), center_T_ = Vec3::Zero();
  Pose X_TB_;
  std::size_t next_ = 0;  ///< of `maybe_`, while the lists are made
  // Only to save allocations between rebuilds.
  std::vector<std::int32_t> maybe_;
  std::vector<Near> near_;
  std::vector<Simple> simple_;
  std::vector<std::int32_t> local_;  ///< per patch of the Target its place in `patches`, or -1
};

}  // namespace takt
