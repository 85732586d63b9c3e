#pragma once
// One instant of a cell as messages, as a server publishes them and a recording contains them. Each message
// is made once for a cell, with all constant content, and filled for each instant.
#include <vector>

#include "ros2_msgs.h"
#include "server/simulation/model/cell_description.h"
#include "server/simulation/model/cell_frames.h"
#include "server/simulation/model/pressed_elements.h"
#include "server/simulation/model/snapshot.h"
#include "takt_msgs.h"

namespace takt {

/// A state message with everything that does not change between instants filled in; fill() does the rest and
/// does not allocate.
takt_msgs::msg::CellState make_state_message(const CellDescription& cell);
void fill(takt_msgs::msg::CellState& message, const CellDescription& cell, const Snapshot& snapshot);

sensor_msgs::msg::JointState make_joint_states_message(const RobotDescription& robot);
void fill(sensor_msgs::msg::JointState& message, const Snapshot& snapshot, std::size_t robot);

/// The message has room for every robot and device; fill() lists the robots with dynamics at this instant,
/// then the devices with a meter, and returns whether there is one. It does not allocate after the first
/// call.
takt_msgs::msg::Power make_power_message(const CellDescription& cell);
bool fill(takt_msgs::msg::Power& message, const CellDescription& cell, const Snapshot& snapshot);

/// The message with room for `capacity` contacts; fill() lists those with pressure and returns whether a
/// process is at level of detail 3. It does not allocate.
takt_msgs::msg::Contacts make_contacts_message(const CellDescription& cell, std::size_t room);
bool fill(takt_msgs::msg::Contacts& message, const Snapshot& snapshot);
takt_msgs::msg::Contact to_message(const ContactSample& sample);

/// Allocates if the number of elements exceeds all earlier ones.
void fill(takt_msgs::msg::ContactPressures& message, const CellDescription& cell, const Snapshot& snapshot,
          const std::vector<PressedPair>& pairs);

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
