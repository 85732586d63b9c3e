#pragma once
// Closed meshes around the filled cells of a bent grid: solids with pockets, slots, bores and windows whose
// faces are as fine as the grid is there.
//
// The grid has lines 0..n in each of three directions; a function gives the position of each grid point
// (Cartesian, or radius, angle, height), so that chamfers are shifted grid lines. Directions must be
// right-handed: x, y, z or radius, angle, z. Cells that touch only along an edge would make a mesh that is
// not closed; the caller must not fill such cells.
#include <functional>
#include <vector>

#include "config/meshes/generator/solid.h"

namespace takt::meshes {

struct CellGrid {
  int ni = 0, nj = 0, nk = 0;  ///< cells
  bool closed_j = false;       ///< line nj is line 0 (angles)
  bool axis_i = false;         ///< line 0 of i is an axis: one point for all j
};

using FilledCell = std::function<bool(int i, int j, int k)>;
using CellPoint = std::function<Vec3(int i, int j, int k)>;

Solid make_cell_solid(const std::string& name, const CellGrid& grid, const FilledCell& filled,
                      const CellPoint& point);

/// Grid lines: from one value to the next in this number of equal steps.
struct LineSteps {
  double to = 0.0;
  int steps = 1;
};
std::vector<double> grid_lines(double from, const std::vector<LineSteps>& steps);

/// Index of the line at this value. Throws std::logic_error if no line has it.
int line_at(const std::vector<double>& lines, double value);

}  // namespace takt::meshes
