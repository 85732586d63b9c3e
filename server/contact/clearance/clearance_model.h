#pragma once
// What a cell checks for collisions of robot programs, and what such a check has to say. Nothing here ever
// acts on the simulation: these are the report pairs (thesis 3.2.2, Fig. 3.4), extended from grippers to the
// links of robots, and to Parts with Parts and Grounds, which are judged by their meshes.
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "plant_models/spatial.h"
#include "server/geometry/convex/rounded_shape.h"
#include "server/geometry/mesh/solid_overlap.h"
#include "takt_enumerations.h"

namespace takt {

/// A link of a robot, or a component.
struct CheckedBody {
  std::string name;  ///< of a link: robot/link; of a component: its own
  int robot = -1;    ///< index of the robot that it is part of or mounted on; -1: a Part or a Ground
  int joint = -1;  ///< of a link: the joint that moves it, index into the arm's; -1: it stands with the base
  int component = -1;  ///< of a component: its id
  bool moves = true;   ///< false: Grounds, and links that stand with the base
  bool is_part = false;
  std::vector<RoundedShape> shapes;  ///< in the component's frame, the joint's frame J, or the base R
  std::shared_ptr<const SolidProbe> solid{};  ///< of Parts and Grounds
};

struct CheckedPair {
  int a = -1, b = -1;    ///< indices into ClearanceModel::bodies, a < b
  double limit_m = 0.0;  ///< closer than this is told; 0: only overlapping
  /// A Part with a Part or a Ground: where convex shapes overlap, the meshes decide how deep. Not looked at
  /// while one holds the other by a substitute force, or one and the same component holds both.
  bool by_solids = false;
  double touching_m = 1e-5;             ///< overlaps less deep than this are touching
  double touching_by_contact_m = 1e-5;  ///< by_solids: the same, while surface contact acts between the two
};

struct ClearanceModel {
  bool enabled = false;
  double hysteresis_m = 0.001;  ///< a pair is clear again this far beyond its limit
  std::vector<CheckedBody> bodies;
  std::vector<CheckedPair> pairs;
};

struct CollisionEvent {
  using Kind = CollisionEventKind;
  Kind kind{};
  double time_s = 0.0;
  std::uint64_t step = 0;
  int a = -1, b = -1;       ///< indices into ClearanceModel::bodies and CellDescription::checked_bodies
  double limit_m = 0.0;     ///< of the pair
  double distance_m = 0.0;  ///< now; negative: minus the depth. Restored: the least since the pair came close
  double duration_s = 0.0;  ///< restored: since the pair came close; else 0
  Vec3 p_W = Vec3::Zero();  ///< halfway between the nearest points of the two, at `distance_m`
};

}  // namespace takt
