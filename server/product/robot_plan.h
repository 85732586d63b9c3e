#pragma once
// How a robot with a parallel gripper takes a product apart and puts it together again.
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "server/product/disassembly.h"

namespace takt::product {

/// A parallel gripper that suits the parts of a product. Its tool centre point is between the tips of its fingers;
/// z points out of the tool, the jaws move along y.
struct GripperSize {
  double finger_width_m = 0.0;      ///< along x
  double finger_thickness_m = 0.0;  ///< along y
  double finger_length_m = 0.0;     ///< along z, from the body on
  double largest_width_m = 0.0;     ///< between the open jaws
  double opening_m = 0.0;           ///< free way of each finger beside the part
  double force_N = 0.0;             ///< largest; carries each load by friction
  std::vector<double> cups_m;       ///< diameters of suction cups on arms beside the fingers: two at most
  double cup_pressure_Pa = 0.0;     ///< difference to the surroundings
};
/// The lip of a cup in the frame of the gripper; its z axis points to the part. The arm is as long as the fingers and the
/// body, so that they stay above the product when the cup points down. The arms of two cups point away from each other.
Pose cup_mount(const GripperSize& gripper, std::size_t cup);
/// Up to this distance from the part the lip of a cup seals: its lip is soft.
double cup_reach_m(double cup_m);

/// One removal by the robot. Poses are those of the tool centre point in the world, in the order of the motion.
struct RobotMove {
  std::size_t held = 0;            ///< instance between the jaws
  std::vector<std::size_t> parts;  ///< instances that leave, `held` among them
  std::string name;                ///< of the step in the program
  std::optional<std::size_t> cup;  ///< the one that holds it in place of the jaws
  double width_m = 0.0;            ///< of the part where the jaws hold it
  Pose above, start, near, grasp;  ///< over the product, before the part, close to it, at it
  Pose free;                       ///< straight out of the parts that it touches
  Pose out;                        ///< straight on, out of the product
  std::optional<Pose> aside;       ///< then away from below it
  Pose lift;                       ///< then up
  Pose over, put;                  ///< above the place on the tray, on it
};

struct RobotPlan {
  GripperSize gripper;
  double size_m = 0.0;  ///< of the product, along the diagonal of its box
  std::vector<RobotMove> moves;
  Vec3 tray_lower = Vec3::Zero(), tray_upper = Vec3::Zero();  ///< opposite corners of the tray
  /// Instances in the order in which each is alone if the robot does its moves; those that stay are last. For the hierarchy:
  /// at level 1 a part takes along those of smaller numbers that it touches.
  std::vector<std::size_t> order;
  std::vector<TriangleMesh>
      tray_posts;                 ///< on it: under the held parts of groups that stand on others of them
  std::optional<double> cycle_s;  ///< of the program in a run; without one it is estimated
  Pose home;                      ///< of the tool centre point
  std::vector<std::string>
      notes;  ///< removals that the robot does not make, with the reason: one sentence each
};

/// Follows the order of disassembly. Fingers hold a part on opposite faces within the stroke; gripper and support are free
/// of each other and of all other parts on the way to it and out of the product. A part without such faces is held by one of
/// up to two suction cups, whose sizes serve as many of these parts as possible: the area of a cup carries three times the
/// weight. A part that finds neither stays, and the others leave where it neither is in their way nor falls.
/// A part is put down with the side up at which it is gripped. Of parts that leave together each hangs at the held one by
/// contacts with parts that leave later, and the held one stands on the tray or on posts: else they stay. `refused` parts stay, each for its reason (one phrase).
RobotPlan plan_robot(const Product& product, const Disassembly& plan,
                     const std::map<std::size_t, std::string>& refused = {});

/// The program in Lua: all moves, then all of them backwards.
std::string robot_program(const Product& product, const RobotPlan& plan);

/// A gantry of three slides and three turning joints, in the frame of the world, with room for all moves.
std::string robot_description(const RobotPlan& plan);
/// Its joints when the tool is at home.
std::vector<double> home_joints(const RobotPlan& plan);
/// Simulated time that the program has, rounded up to seconds (s).
double program_duration_s(const RobotPlan& plan);

}  // namespace takt::product
