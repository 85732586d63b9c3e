#pragma once
// Vectors of OpenCASCADE as those of takt, in the same unit.
#include <gp_XYZ.hxx>

#include "server/geometry/mesh/triangle_mesh.h"

namespace takt::cad {

inline Vec3 vector(const gp_XYZ& v) {
  return {v.X(), v.Y(), v.Z()};
}

}  // namespace takt::cad
