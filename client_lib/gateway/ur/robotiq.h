#pragma once
// The server of Robotiq's URCap (port 63352 of the controller), for 2F grippers: variables of the gripper as text. Lines end with \n.
//
//   SET POS 255 SPE 255 FOR 0 GTO 1    -> ack (without an end of line)
//   GET POS                            -> POS 255\n ; a name that it does not know: ?\n
//
// POS 0 is the largest width, 255 closed; FOR 0 to 255 is a twelfth to all of the gripper's force. ACT and GTO move the gripper
// only together; SPE, ATR and ADR have no effect. The gripper is activated, as the URCap leaves it. Pure: no sockets, no clock.
// Source: Robotiq 2F-85 & 2F-140 for UR, instruction manual, sections 4.4 to 4.6 (registers).
#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace takt::ur {

/// What the gripper measures.
struct MeasuredGripper {
  double width_m = 0.0, most_width_m = 0.0, most_force_N = 0.0;
  bool moves = false, holds = false;
};

class RobotiqGripper {
 public:
  struct Command {
    double width_m = 0.0, force_N = 0.0;
  };
  struct Answer {
    std::string bytes;
    std::optional<Command> command{};  ///< for the gripper
  };
  /// Of a line without its end. `time_s` grows.
  Answer answer(std::string_view line, const MeasuredGripper& gripper, double time_s);

 private:
  Answer set(std::string_view pairs, const MeasuredGripper& gripper, double time_s);
  int value_of(std::string_view name, const MeasuredGripper& gripper, double time_s) const;
  int object(const MeasuredGripper& gripper, double time_s) const;

  std::map<std::string, int, std::less<>> set_{{"ACT", 1}, {"GTO", 1}, {"ATR", 0}, {"ADR", 0}, {"ARD", 0},
                                               {"FOR", 0}, {"SPE", 0}, {"POS", 0}, {"SID", 9}};
  std::optional<int> requested_;  ///< position of the newest command
  double commanded_s_ = 0.0;
};

}  // namespace takt::ur
