#pragma once
// The elements of the Base that are or come into contact during a motion relative to the Target, each with the
// strip of the Target's faces along its path (FaceStrip). Near the motion, depths and normals follow from the
// planes of the strips, without a search: "lagged geometry" (Masterjohn, Guoy, Shepherd, Castro: Velocity level
// approximation of pressure field contact patches, IEEE RA-L 2022) that the motion is known to.
//
// The motion is divided into pieces of about a face of the Target. Each piece has its own elements and planes: an
// evaluation visits few.
#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "server/contact/surface/contact_elements.h"
#include "server/contact/surface/face_strips.h"

namespace takt {

/// A motion of the Base relative to the Target with constant velocities, from X_TB on: of the box's centre and of
/// turning, axes of the Target.
struct HeldMotion {
  static constexpr std::size_t kPieces = 12;
  Pose X_TB;
  Vec3 v_T = Vec3::Zero(), w_T = Vec3::Zero();
  double horizon_s = 0.0;  ///< its length in time
  double margin_m = 0.0;   ///< how far points of the Base may be beside it
  std::size_t pieces = 1;  ///< of equal length, at most kPieces
  double piece_s = 0.0;    ///< of each
  /// Of the pieces after these none is needed from the first one on that goes into the Target.
  std::size_t least_pieces = 1;

  /// After the time t. `center_B`: the box's centre.
  Pose pose(double t, const Vec3& center_B) const;
  /// Upper bound of the distance of any point of the Base at another pose from its path (m), and when it is
  /// closest to it (s). `radius_m`: of the sphere about `center_B` around the Base.
  double beside_m(const Pose& X_TB_now, const Vec3& center_B, double radius_m, double& at_s) const;
  std::size_t piece(double at_s) const {
    return std::min(pieces - 1, static_cast<std::size_t>(at_s / piece_s));
  }
};

class HeldPatch {
 public:
  static constexpr std::size_t kPieces = HeldMotion::kPieces;
  void clear();
  /// In the order of the elements. `p_B`, `area_m2`: centroid and area.
  void add(std::size_t piece, std::int32_t element, const Vec3& p_B, double area_m2, const FaceStrip& strip);
  /// Fills the rows with the elements that may be in contact at a pose near this piece: centroids, areas, normals
  /// (into the Target, axes of the Base) and depths (0: outside); and `elements` with their numbers, in the order
  /// of add().
  void fill(std::size_t piece, const Pose& X_TB, const Pose& X_BT, ElementRows& rows,
            std::vector<std::int32_t>& elements) const;

  /// No element gets deeper on a piece of the motion, or beside it within the margin.
  double deepest_m(std::size_t piece) const { return pieces_[piece].deepest_m; }

  static constexpr std::size_t kLanes = 4;
  using Lanes = std::array<double, kLanes>;
  /// Elements that are computed together.
  struct Pack {
    Lanes x{}, y{}, z{}, area_m2{};
    std::array<std::int32_t, kLanes> element{};
    std::uint32_t first = 0, planes = 0;  ///< its planes in the list of the piece
    std::uint32_t stride = 1;  ///< 2: each of them is followed by that beside it (FaceStrip::beside)
  };
  /// Of each element of a pack one plane of its strip. Side 0: the element has no further plane.
  struct Plane {
    Lanes x{}, y{}, z{}, offset_m{}, side{};
  };

 private:
  static void add_beside(Pack& pack, std::vector<Plane>& planes);

  struct Piece {
    std::size_t size = 0;
    double deepest_m = 0.0;
    std::vector<Pack> packs;
    std::vector<Plane> planes;
  };
  std::array<Piece, kPieces> pieces_;
};

}  // namespace takt
