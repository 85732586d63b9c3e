#pragma once
// Contact elements that do not depend on the triangulation: one for each cell of a regular grid over each flat
// region of the surface.
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/geometry/surface/contact_surface_data.h"
#include "server/geometry/surface/element_corners.h"

namespace takt {

/// Elements longer than this many widths are slender (slenderness()).
inline constexpr double kSlender = 10.0;
/// Share of a region's area, and of the surface, in slender elements that resampling must do away with, for
/// ContactResampling::automatic.
inline constexpr double kSlenderShare = 0.25, kLeastGain = 0.1;

/// Ratio of the radii of inertia of a triangle: 1 for an equilateral one, 1.7 for half a square, and about length
/// over width of a needle.
double slenderness(const TriangleCorners& corners);

struct SurfaceSample {
  Vec3 point = Vec3::Zero();  ///< centre of the area, on the surface
  double area_m2 = 0.0;
  double slenderness = 1.0;
  std::uint32_t face = 0;  ///< has the point
  /// Convex hull of the element: the element itself, except at rims that curve inwards.
  std::vector<Vec3> outline;
  bool is_strip = false;  ///< split off from its cell along a rim
};

/// Connected faces in one plane, up to the rounding of single precision, in which mesh files state positions.
struct FlatRegion {
  std::vector<std::int32_t> faces;
  Vec3 normal = Vec3::Zero();  ///< of the sum of the faces' area vectors, which only their rim decides
  Vec3 point = Vec3::Zero();   ///< of the plane
};

struct FlatRegions {
  std::vector<FlatRegion> regions;
  std::vector<std::int32_t> of_face;
  double flatness_m =
      0.0;  ///< largest distance of a vertex from the plane of its region, and of a rim from a line
};

FlatRegions find_flat_regions(const ContactSurface::Data& data);

/// Whether cells have strips along the straight runs of sharp rims that are at least a cell long (rim_strips.h).
enum class Rims : std::uint8_t { plain, strips };

/// Elements of one region: cells of at most `spacing_m` in both directions, along the longest straight run of the
/// region's rim and across it. Together they have the area and the first moment of the area of the region, but for
/// rounding. Same surface, same bits.
std::vector<SurfaceSample> sample_region(const ContactSurface::Data& data, const FlatRegions& regions,
                                         std::size_t region, double spacing_m, Rims rims);

}  // namespace takt
