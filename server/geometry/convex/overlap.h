#pragma once
// Overlap of convex shapes by Minkowski Portal Refinement (thesis 2.1.1, 4.2): one query without memory of
// earlier ones. Only this file's source uses libccd.
#include "server/geometry/convex/convex_shape.h"

namespace takt {

/// True if the two shapes, each at its pose, come closer than `margin` (m, >= 0): one of them is grown by a
/// ball of that radius, so the answer does not depend on the choice of axes. Touching counts; the verdict is
/// exact up to 1e-8 of the sum of the shapes' radii. Throws as check_query (libccd answers "no contact" for a
/// NaN). The caller checks first that the bounding boxes overlap.
/// Bounded time: the number of iterations is limited, and a search that hits the limit counts as touching.
/// Does not allocate. Shapes must come from ConvexShape::from_points.
bool convex_overlap(const ConvexShape& a, const Pose& X_WA, const ConvexShape& b, const Pose& X_WB,
                    double margin);

}  // namespace takt
