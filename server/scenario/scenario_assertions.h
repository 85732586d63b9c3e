#pragma once
// Assertions of a scenario about a run: the run itself checks them, each with a verdict (takt-run: exit code,
// --junit).
#include <array>
#include <limits>
#include <string>

#include "plant_models/spatial.h"

namespace takt {

struct ScenarioAssertion {
  enum class Kind {
    contact_force,  ///< largest normal force between two components (surface contact, level of detail 3)
    pose,           ///< a Part is within a tolerance of a pose at a time
    held_by,        ///< a Part is held by this component at a time
    energy,         ///< energy drawn by a robot or device up to a time
    signal,         ///< a signal of a device at a time
    /// Smallest reserve of a gripper's force over the force that friction needs (levels of detail 1 and 2).
    grip_margin,
    no_collision,  ///< collision checking has found no overlap
  } kind = Kind::no_collision;
  std::string name;                 ///< unique in the scenario
  std::string place;                ///< file, line, column and key, for error texts
  double time_s = -1.0;             ///< negative: at the end
  std::array<std::string, 2> pair;  ///< contact_force: name patterns, `*` for any characters
  std::string subject;              ///< Part, robot, gripper or device
  std::string signal;               ///< of a device
  std::string holder;               ///< held_by; empty: without holder
  Pose X_WB;                        ///< pose
  double tolerance_m = 0.0, tolerance_rad = std::numeric_limits<double>::infinity();
  /// Of the force (N), energy (J), signal or margin.
  double lower = -std::numeric_limits<double>::infinity(), upper = std::numeric_limits<double>::infinity();
};

class Fields;
struct Scenario;
/// Parts, robots, grippers, Grounds and devices of the scenario must have been read.
void describe_assertions(Fields& f, Scenario& scenario);

}  // namespace takt
