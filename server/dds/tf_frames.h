#pragma once
// Frames of the cell (simulation/cell_frames.h) as messages of tf2.
#include <vector>

#include "ros2_msgs.h"
#include "server/simulation/model/cell_frames.h"

namespace takt {

tf2_msgs::msg::TFMessage to_message(const std::vector<CellFrame>& frames, double time_s);

/// The frames that move, in one message that is filled again and again.
class MovingFramesMessage {
 public:
  explicit MovingFramesMessage(const CellDescription& cell);
  /// Does not allocate.
  tf2_msgs::msg::TFMessage& fill(const Snapshot& snapshot);

 private:
  MovingFrames frames_;
  tf2_msgs::msg::TFMessage message_;
};

}  // namespace takt
