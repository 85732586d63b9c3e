#pragma once
// A run of the cell in which a robot takes a product apart: whether its program ends, with all parts in their places.
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "server/product/cell_writer.h"

namespace takt {

struct RobotTrial {
  std::string fault;                   ///< why the program ended early; empty: it ended by itself
  std::optional<std::size_t> move;     ///< index of the move at which it ended early
  std::vector<std::size_t> misplaced;  ///< instances that are not in their places at the end
};

/// Loads and runs the robot's scenario of `files`. A cell that does not load is a fault.
RobotTrial try_robot(const product::Product& product, const product::RobotPlan& plan,
                     const product::CellFiles& files);

/// Writes the cell (write_cell), runs it, and has the support hold the parts that fall in the run (plan.on_pads), until all
/// stay. What does not is in the notes.
product::CellFiles write_standing_cell(const product::Product& product, product::Disassembly& plan,
                                       const product::Hierarchy& hierarchy, const std::string& directory);

/// Plans the robot and writes the cell (write_cell), runs it, and leaves out the moves that fail there, until the rest of
/// the program ends with all parts in their places. What cannot be brought to that is in the notes of `robot`.
product::CellFiles write_tried_cell(const product::Product& product, const product::Disassembly& plan,
                                    const product::Hierarchy& hierarchy, const std::string& directory,
                                    product::RobotPlan& robot);

}  // namespace takt
