#pragma once
// Parts that a scenario puts inside of other Parts or of Grounds.
#include <vector>

#include "server/geometry/mesh/triangle_mesh.h"
#include "server/scenario/scenario.h"
#include "server/simulation/model/cell_model.h"

namespace takt {

/// Deeper than the contact margin and this share of the thinner body's thickness no fit is: a press fit has a
/// thousandth or two of its diameter.
inline constexpr double kLargestFit = 0.01;

/// Fills cell.start_overlaps, and notes each. Judged are the meshes (by component), at the poses of the
/// start. Left out are pairs that a thread joins or that `world.allow_overlap` names.
void find_start_overlaps(const Scenario& scenario, const std::vector<TriangleMesh>& meshes, CellModel& cell);

}  // namespace takt
