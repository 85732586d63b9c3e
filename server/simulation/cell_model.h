#pragma once
// Everything about a loaded cell that is constant while it runs. Many simulations may share one model.
#include <string>
#include <vector>

#include "plant_models/gripper/parallel_gripper.h"
#include "plant_models/mechanics/rigid_body.h"
#include "plant_models/robot/kinematic_robot.h"
#include "server/components/pair_generation.h"
#include "server/contact/component_interaction.h"
#include "server/simulation/cell_description.h"

namespace takt {

/// When a closed gripper holds a Part at LoD 1.
enum class GraspRule : std::uint8_t {
  on_command,  ///< from the close command on, every Part in the space between the jaws (thesis 5.2.2)
  on_contact,  ///< from the moment both jaws touch the Part
};

struct GripperModel {
  ParallelGripperParameters parameters;
  GraspRule rule = GraspRule::on_command;
  double max_force_N = 0.0;
  // Extent of the grip faces in the jaw frames: the grasp volume lies between them.
  double face_x_lower_m = 0.0, face_x_upper_m = 0.0, face_z_lower_m = 0.0, face_z_upper_m = 0.0;
};

struct GroundModel {
  int component = -1;
  Pose X_WB;
};

struct CellModel {
  CellDescription description;
  double step_s = 0.001;
  std::string solver = "rk2";
  std::vector<Component> components;
  std::vector<ComponentPair> pairs;
  InteractionParameters interaction;
  std::vector<RigidBodyParameters> parts;  ///< by Part, in order of component id
  std::vector<GroundModel> grounds;
  std::vector<KinematicRobotParameters> robots;
  std::vector<GripperModel> grippers;
};

}  // namespace takt
