#pragma once
// Parts whose initial pose in a scenario penetrates other Parts or Grounds.
#include <vector>

#include "server/geometry/mesh/triangle_mesh.h"
#include "server/scenario/scenario.h"
#include "server/simulation/model/cell_model.h"

namespace takt {

/// Deeper than the contact margin and this share of the thinner body's thickness no fit is: a press fit has a
/// thousandth or two of its diameter.
inline constexpr double kLargestFit = 0.01;

/// Fills cell.start_overlaps, with a note for each. The test uses the meshes (by component) at their initial
/// poses and skips pairs that a thread joins or that `world.allow_overlap` names.
void find_start_overlaps(const Scenario& scenario, const std::vector<TriangleMesh>& meshes, CellModel& cell);

}  // namespace takt
