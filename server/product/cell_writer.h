#pragma once
// A product as a scenario: meshes, convex shapes, a support, and a commented file that loads at once.
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "server/product/disassembly.h"
#include "server/product/product.h"
#include "server/product/robot_plan.h"

namespace takt::product {

/// Advice on the level of detail of one contact, with its reason.
struct LevelAdvice {
  std::size_t contact = 0;  ///< of Product::contacts
  int level = 1;
  std::string reason;
};
/// Level 3 where forces between surfaces decide: interference and transition fits, threads, snaps. Level 1 elsewhere.
std::vector<LevelAdvice> level_advice(const Product& product);

struct CellFiles {
  std::filesystem::path scenario;
  std::filesystem::path robot_scenario;  ///< empty: without a robot
  std::filesystem::path robot_program;   ///< likewise
  std::vector<std::string> notes;        ///< what was assumed or left to the user, one sentence each
};

/// By how far a part may be out of its place at the end.
inline constexpr double kPlaceTolerance_m = 5e-4, kPlaceTolerance_deg = 0.5;

/// Writes NAME.yaml and meshes/ into the directory, which is made. The product stands as its file has it: world z is up.
/// The support is a Ground under the base, with posts where other parts reach further down. With a robot: also
/// NAME_robot.yaml, the same cell with a gantry, its gripper and a tray, in which the robot takes the product apart and
/// puts it together again (NAME_robot.lua). Throws std::runtime_error for files that cannot be written.
CellFiles write_cell(const Product& product, const Disassembly& plan, const Hierarchy& numbers,
                     const std::filesystem::path& directory, const RobotPlan* robot = nullptr);

/// Cells of one product in one directory, again and again: meshes are written and overlaps searched once, at the beginning.
/// Product and numbers must outlive it.
class CellWriter {
 public:
  CellWriter(const Product& product, const Hierarchy& numbers, const std::filesystem::path& directory);
  ~CellWriter();

  /// Adds a sentence to the head and the notes of each cell that is written after this call.
  void add_note(const std::string& note);
  /// NAME.yaml.
  CellFiles write_cell(const Disassembly& plan);
  /// NAME_robot.yaml, NAME_robot.lua and what they name; NAME.yaml stays as it is.
  CellFiles write_robot_cell(const Disassembly& plan, const RobotPlan& robot);
  /// Removes the files that write_robot_cell() writes.
  void remove_robot_cell();

 private:
  class Writer;
  std::unique_ptr<Writer> writer_;
};

}  // namespace takt::product
