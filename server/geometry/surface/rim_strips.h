#pragma once
// Strips of contact elements along the rims of flat faces. An element acts at its centroid: without them a face carries a moment
// only up to the centroids of its outermost elements, and an edge is felt when it is already deep.
#include <vector>

#include "server/geometry/surface/contact_surface_data.h"
#include "server/geometry/surface/element_corners.h"

namespace takt {

/// Width of a strip over the element edge.
inline constexpr double kRimShare = 0.125;

/// Whether the face beyond this edge turns away by more than 20 degrees.
bool turns_away(const ContactSurface::Data& data, const ContactFace& face, std::size_t edge);

/// The edges of a face with strips: those where the next face turns away, and where this face is at least half an element edge
/// wide. None with an element edge of 0.
class RimStrips {
 public:
  RimStrips(const ContactSurface::Data& data, std::size_t face, double edge_m);
  /// Divides a piece of the face along the strips' inner lines; appends the parts, or nothing if no line crosses it.
  void divide(const TriangleCorners& piece, std::vector<std::vector<Vec3>>& parts) const;

 private:
  struct Line {
    Vec3 inward;
    double shift_m;  ///< inward . x + shift_m is the distance from the strip's inner line, positive beyond it
  };
  std::vector<Line> lines_;
  double width_m_;
};

/// Mean area of the elements of a surface, as if no rim had a strip.
double mean_element_area_m2(const ContactSurface& surface);

/// Area and centroid of a convex polygon in a plane.
double area_and_centroid(const std::vector<Vec3>& polygon, Vec3& centroid);

}  // namespace takt
