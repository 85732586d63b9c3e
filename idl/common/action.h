#pragma once
// Actions of ROS 2 as data: each @action of idl/*.idl becomes a struct of takt::actions (takt_actions.h) with the
// messages of its services and topics, and this row.
#include <string>
#include <string_view>

namespace takt {

struct ActionInfo {
  std::string_view id;       ///< "follow_joint_trajectory"
  std::string_view pattern;  ///< "{cell}/{robot}/follow_joint_trajectory"

  /// ROS 2 name without the leading slash; `element`: the robot or gripper.
  std::string name(std::string_view cell, std::string_view element = {}) const {
    std::string text;
    for (std::size_t at = 0; at < pattern.size();) {
      const std::size_t open = pattern.find('{', at);
      text += pattern.substr(at, open - at);
      if (open == std::string_view::npos) break;
      at = pattern.find('}', open) + 1;
      text += pattern.substr(open, at - open) == "{cell}" ? cell : element;
    }
    return text;
  }
};

}  // namespace takt
