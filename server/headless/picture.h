#pragma once
// A picture of the cell at one instant, drawn from the simulation's own description and snapshot.
#include <optional>
#include <string>

#include "server/headless/robot_shapes.h"
#include "server/simulation/model/cell_description.h"
#include "server/simulation/model/snapshot.h"

namespace takt {

/// View points of pictures, and their centre, in the world (m).
struct PictureView {
  Vec3 eye_W, target_W;
};

/// Writes a PNG; a robot without shapes is drawn as an arm of tubes. Without a view the whole cell is in it. Throws std::runtime_error when it cannot be written.
void write_picture(const CellDescription& cell, const RobotShapes& robots, const Snapshot& snapshot,
                   const std::string& png_file, const std::optional<PictureView>& view = {});

/// The bytes of such a file, of the whole cell.
std::string picture_bytes(const CellDescription& cell, const RobotShapes& robots, const Snapshot& snapshot);

}  // namespace takt
