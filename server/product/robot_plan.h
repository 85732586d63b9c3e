#pragma once
// How a robot with a parallel gripper takes a product apart and puts it together again.
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
};

/// One removal by the robot. Poses are those of the tool centre point in the world, in the order of the motion.
struct RobotMove {
  std::size_t held = 0;            ///< instance between the jaws
  std::vector<std::size_t> parts;  ///< instances that leave, `held` among them
  std::string name;                ///< of the step in the program
  double width_m = 0.0;            ///< of the part where the jaws hold it
  Pose above, start, grasp;        ///< over the product, before the part, at the part
  Pose out, lift;                  ///< straight out of the product, then up
  Pose over, put;                  ///< above the place on the tray, on it
};

struct RobotPlan {
  GripperSize gripper;
  std::vector<RobotMove> moves;
  Vec3 tray_lower = Vec3::Zero(), tray_upper = Vec3::Zero();  ///< opposite corners of the tray
  Pose home;                                                  ///< of the tool centre point
  std::vector<std::string> notes;  ///< steps without a way or a grasp, one sentence each
};

/// Follows the order of disassembly up to the first step that the robot cannot make. A grasp lies on opposite faces of
/// the part within the stroke; fingers and body of the gripper are free of all other parts on the way to it and out of
/// the product. A part is put down with the side up at which it is gripped.
RobotPlan plan_robot(const Product& product, const Disassembly& plan);

/// The program in Lua: all moves, then all of them backwards.
std::string robot_program(const Product& product, const RobotPlan& plan);

/// A gantry of three slides and three turning joints, in the frame of the world, with room for all moves.
std::string robot_description(const RobotPlan& plan);
/// Its joints when the tool is at home.
std::vector<double> home_joints(const RobotPlan& plan);
/// Simulated time of the program, rounded up to seconds (s).
double program_duration_s(const RobotPlan& plan);

}  // namespace takt::product
