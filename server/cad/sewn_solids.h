#pragma once
// Solids out of surfaces that nearly meet: exporters write the faces of a solid one by one, or leave gaps between them.
#include <TopoDS_Shape.hxx>
#include <vector>

namespace takt::cad {

struct SewnSolids {
  std::vector<TopoDS_Shape> solids;
  double largest_gap_mm = 0.0;  ///< between edges that became one
  int left = 0;                 ///< surfaces that bound no solid
};

/// Widest gap that is sewn (mm).
inline constexpr double kWidestGap_mm = 0.1;

/// Sews shells and faces over gaps, the narrowest first. Edges that become one keep their places, so that the gap stays
/// within the solid's tolerance.
SewnSolids sew(const std::vector<TopoDS_Shape>& surfaces);

}  // namespace takt::cad
