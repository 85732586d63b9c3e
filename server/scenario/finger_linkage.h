#pragma once
// Two fingers that one joint of a URDF moves apart over joints that mimic it, as the four-bar linkages of many grippers
// do: each finger keeps its direction, and both travel in opposite directions.
#include <array>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "server/scenario/urdf_robot.h"

namespace takt {

/// H is the frame of the hand, the link that carries both fingers.
struct FingerLinkage {
  std::size_t hand = 0;
  std::size_t drive = 0;               ///< joint that all joints of both fingers follow
  std::array<std::size_t, 2> joint{};  ///< the last one of each finger: left, right
  Vec3 y_H = Vec3::UnitY();            ///< in which the left finger travels away from the right one
  double q_open = 0.0, q_closed = 0.0,
         q_middle = 0.0;                 ///< of the drive; half way of the travel in the middle
  double opens_m = 0.0, closes_m = 0.0;  ///< change of the distance, from the middle to both ends
  double largest_lever_m = 0.0;          ///< largest change of the distance by the drive (m/rad, or m/m)
  /// By how far both fingers travel along the hand, from the middle to both ends.
  double rises_open_m = 0.0, rises_closed_m = 0.0;
};

/// The fingers of the links that `flange` carries. `fingers`: the last joints of left and right finger; empty: the two
/// last joints whose links move without turning. `centre_of`: the middle of a finger's shapes in its link; by it the
/// left side is known. Throws UrdfError that says what the joints below the flange do where they are no such fingers.
FingerLinkage find_finger_linkage(const UrdfRobot& robot, std::size_t flange,
                                  const std::vector<std::string>& fingers,
                                  const std::function<Vec3(std::size_t link)>& centre_of);

/// Pose of `link` in `hand`, which carries it, where the drive is at q. Joints of other drives stand at the position
/// nearest to 0 within their limits. Throws UrdfError for joints that mimic each other in a loop.
Pose linkage_pose(const UrdfRobot& robot, std::size_t hand, std::size_t link, std::size_t drive, double q);

}  // namespace takt
