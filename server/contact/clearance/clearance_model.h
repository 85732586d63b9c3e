#pragma once
// The pairs that a cell checks for collisions of robot programs, and the events of the check. The checks have
// no effect on the simulation: these are the report pairs (thesis 3.2.2, Fig. 3.4), extended from grippers to
// the links of robots, and to Parts with Parts and Grounds, for which the meshes decide.
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
  std::string name;    ///< of a link: robot/link; of a component: its name
  int robot = -1;      ///< robot that contains or carries it; -1: a Part or a Ground
  int joint = -1;      ///< of a link: the joint that moves it, index into the arm's; -1: fixed to the base
  int component = -1;  ///< of a component: its id
  bool moves = true;   ///< false: Grounds, and links fixed to the base
  bool is_part = false;
  std::vector<RoundedShape> shapes;  ///< in the component's frame, the joint's frame J, or the base R
  std::shared_ptr<const SolidProbe> solid{};  ///< of Parts and Grounds
};

struct CheckedPair {
  int a = -1, b = -1;    ///< indices into ClearanceModel::bodies, a < b
  double limit_m = 0.0;  ///< smaller distances are reported; 0: only overlaps
  /// A Part with a Part or a Ground: if convex shapes overlap, the meshes decide the depth. Skipped while one
  /// holds the other by a substitute force, or the same component holds both.
  bool by_solids = false;
  double touching_m = 1e-5;             ///< overlaps less deep than this count as touching
  double touching_by_contact_m = 1e-5;  ///< by_solids: the same, while surface contact acts between the two
};

struct ClearanceModel {
  bool enabled = false;
  double hysteresis_m = 0.001;  ///< distance beyond the limit at which a pair is clear again
  std::vector<CheckedBody> bodies;
  std::vector<CheckedPair> pairs;
};

struct CollisionEvent {
  using Kind = CollisionEventKind;
  Kind kind{};
  double time_s = 0.0;
  std::uint64_t step = 0;
  int a = -1, b = -1;    ///< indices into ClearanceModel::bodies and CellDescription::checked_bodies
  double limit_m = 0.0;  ///< of the pair
  /// At the event; negative: minus the depth. Restored: the smallest since the pair came close.
  double distance_m = 0.0;
  double duration_s = 0.0;  ///< restored: since the pair came close; else 0
  Vec3 p_W = Vec3::Zero();  ///< halfway between the nearest points of the two, at `distance_m`
};

}  // namespace takt
