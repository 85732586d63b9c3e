#pragma once
// The shapes that a robot's URDF has for pictures: the <visual> of each link, in the colours of their materials.
#include <cstddef>
#include <vector>

#include "client_lib/render/scene.h"
#include "idl/common/ros_packages.h"
#include "server/scenario/scenario.h"
#include "server/simulation/model/cell_description.h"

namespace takt {

class RobotShapes {
 public:
  /// Reads the files of the robots. A link without a readable <visual> has the shapes of its <collision>; a robot without
  /// either has none. Links that a gripper is made of (ScenarioFingers) are left out: its components are drawn.
  RobotShapes(const Scenario& scenario, const CellDescription& cell, const PackageFolders& packages);

  /// Adds the robot at joint positions `q` (joint_count() values). False: it has no shapes.
  bool add_to(render::Scene& scene, std::size_t robot, const double* q, const Pose& X_WR) const;

 private:
  struct Piece {
    int joint;          ///< index of the joint that carries it; -1: the base
    render::Mesh mesh;  ///< its frame is that of the joint, or the base
  };
  struct Robot {
    const RobotDescription* description;
    std::vector<Piece> pieces;
  };
  std::vector<Robot> robots_;
};

}  // namespace takt
