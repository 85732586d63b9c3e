#pragma once
// The elements of the Base that are or come into contact during a straight motion relative to the Target, each
// with the strip of the Target's faces along its path (FaceStrip). Near the motion, depths and normals follow
// from the planes of the strips, without a search: "lagged geometry" (Masterjohn, Guoy, Shepherd, Castro:
// Velocity level approximation of pressure field contact patches, IEEE RA-L 2022) that the motion is known to.
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/contact/surface/contact_elements.h"
#include "server/contact/surface/face_strips.h"

namespace takt {

/// A straight motion of the Base relative to the Target, from X_TB on: velocities of the box's centre and of
/// turning, axes of the Target.
struct HeldMotion {
  Pose X_TB;
  Vec3 v_T = Vec3::Zero(), w_T = Vec3::Zero();
  double horizon_s = 0.0;  ///< its length in time
  double margin_m = 0.0;   ///< how far points of the Base may be beside it

  /// Upper bound of the distance of any point of the Base at another pose from its path (m), and when it is
  /// closest to it (s). `radius_m`: of the sphere about `center_B` around the Base.
  double beside_m(const Pose& X_TB_now, const Vec3& center_B, double radius_m, double& at_s) const;
};

class HeldPatch {
 public:
  void clear();
  void add(std::int32_t element, const FaceStrip& strip);
  std::size_t size() const { return elements_.size(); }
  std::span<const std::int32_t> elements() const { return elements_; }  ///< in the order of add()
  /// Normals (into the Target, axes of the Base) and depths (0: outside) at this pose; the rows have the
  /// elements of the patch, with their centroids.
  void fill(const Pose& X_TB, const Pose& X_BT, ElementRows& rows) const;

 private:
  enum Row : std::size_t { kX, kY, kZ, kOffset, kSide, kRows };  ///< of one plane
  static constexpr std::size_t kBlock = 32;
  std::vector<std::int32_t> elements_;
  std::array<std::array<std::vector<double>, kRows>, FaceStrip::kPlanes> planes_;
  std::vector<std::uint8_t> counts_;  ///< of each block of elements: the most planes that one of them has
};

}  // namespace takt
