#pragma once
// A run of the cell in which a robot takes a product apart: whether its program ends, with all parts in their places.
#include <cstddef>
#include <map>
#include <optional>
#include <string>

#include "server/product/cell_writer.h"

namespace takt {

struct RobotTrial {
  std::string fault;                             ///< why the program ended early; empty: it ended by itself
  std::optional<std::size_t> move;               ///< index of the move at which it ended early
  std::string step;                              ///< of that move: its name in the program
  double cycle_s = 0.0;                          ///< of a program that ended by itself
  std::map<std::size_t, std::string> misplaced;  ///< by instance: how it is out of its place at the end
};

/// Loads and runs the robot's scenario of `files`. A cell that does not load is a fault.
RobotTrial try_robot(const product::Product& product, const product::RobotPlan& plan,
                     const product::CellFiles& files);

/// Writes the cell, runs it, and has the support hold the parts that fall in the run (plan.on_pads), until all stay. What
/// does not is in the notes.
product::CellFiles write_standing_cell(product::CellWriter& writer, const product::Product& product,
                                       product::Disassembly& plan, const product::Hierarchy& hierarchy);

/// Plans the robot and writes its cell, runs it, and leaves out the moves that fail there, until the rest of the program ends
/// with all parts in their places. What cannot be brought to that is in the notes of `robot`. Nothing, and no file of
/// the robot, where no move is left.
std::optional<product::CellFiles> write_tried_cell(product::CellWriter& writer,
                                                   const product::Product& product,
                                                   const product::Disassembly& plan,
                                                   product::RobotPlan& robot);

}  // namespace takt
