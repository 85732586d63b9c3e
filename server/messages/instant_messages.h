#pragma once
// One instant of a cell as messages, as a server publishes them and a recording contains them.
#include <cstddef>
#include <tuple>
#include <vector>

#include "ros2_msgs.h"
#include "server/simulation/model/cell_description.h"
#include "server/simulation/model/cell_frames.h"
#include "server/simulation/model/pressed_elements.h"
#include "server/simulation/model/snapshot.h"
#include "takt_msgs.h"
#include "takt_topics.h"

namespace takt {

/// A state with as many elements as the cell has, and what does not change.
takt_msgs::msg::CellState make_state_message(const CellDescription& cell);

// Of the messages of an instant: fill() does not allocate from the second time on.

void fill(takt_msgs::msg::CellState& message, const CellDescription& cell, const Snapshot& snapshot);
// Its parts: time, step and hash; one component; all others.
void fill_instant(takt_msgs::msg::CellState& message, const Snapshot& snapshot);
void fill(takt_msgs::msg::ComponentState& message, const ComponentSample& sample);
void fill_machines(takt_msgs::msg::CellState& message, const CellDescription& cell, const Snapshot& snapshot);
/// The robots that have dynamics at this instant, then the devices with a meter.
void fill(takt_msgs::msg::Power& message, const CellDescription& cell, const Snapshot& snapshot);
void fill(takt_msgs::msg::Contacts& message, const CellDescription& cell, const Snapshot& snapshot);

bool has_content(const takt_msgs::msg::CellState& message, const CellDescription& cell,
                 const Snapshot& snapshot);
bool has_content(const takt_msgs::msg::Power& message, const CellDescription& cell, const Snapshot& snapshot);
/// A process is at level of detail 3.
bool has_content(const takt_msgs::msg::Contacts& message, const CellDescription& cell,
                 const Snapshot& snapshot);

/// The messages of an instant, in the order in which they are sent. They are made once for a cell, with everything that
/// does not change, and filled for each instant.
class InstantMessages {
 public:
  /// `contact_capacity`: contacts that are listed without an allocation. The cell outlives this.
  explicit InstantMessages(const CellDescription& cell, std::size_t contact_capacity = 0);

  void fill(const Snapshot& snapshot);
  /// Fills those of the messages that are `sent` and for which `wanted(place)` is true, and hands each to
  /// `use(place, message)`. All others keep what they have.
  template <typename Wanted, typename Use>
  void fill_some(const Snapshot& snapshot, const Wanted& wanted, const Use& use) {
    std::size_t place = 0;
    const auto visit = [&](auto& one) {
      one.sent = one.sent || has_content(one.message, cell_, snapshot);
      if (one.sent && wanted(place)) {
        takt::fill(one.message, cell_, snapshot);
        use(place, one.message);
      }
      ++place;
    };
    std::apply([&](auto&... one) { (visit(one), ...); }, all_);
  }
  /// `use(topic, message, sent)` of each. Not `sent`: the message has not had any content in this cell so far.
  template <typename Use>
  void for_each(const Use& use) {
    std::apply([&](auto&... one) { (use(one.topic, one.message, one.sent), ...); }, all_);
  }
  const takt_msgs::msg::CellState& state() const { return std::get<0>(all_).message; }

 private:
  template <typename Type>
  struct One {
    const Topic<Type>& topic;
    Type message{};
    bool sent = false;
  };

  const CellDescription& cell_;
  std::tuple<One<takt_msgs::msg::CellState>, One<takt_msgs::msg::Power>, One<takt_msgs::msg::Contacts>> all_;
};

sensor_msgs::msg::JointState make_joint_states_message(const RobotDescription& robot);
/// Whether the device has a topic wrench.
bool has_wrench(const DeviceDescription& device);
/// The first six signals of a device that has one.
void fill(geometry_msgs::msg::WrenchStamped& message, const CellDescription& cell, const Snapshot& snapshot,
          std::size_t device);
void fill(sensor_msgs::msg::JointState& message, const Snapshot& snapshot, std::size_t robot);

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
