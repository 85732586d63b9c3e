#pragma once
// A cell as a client sees it: the messages of idl/takt_msgs.idl with functions that find elements by name. The IDL says
// unit, frame and meaning of every field. Units are SI; W is the world frame, z up; B is the frame of a component.
// Components, robots, grippers and devices have the same order, and so the same index, in the description and in every
// state. A client drops messages that contradict their description.
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "idl/common/named_lists.h"
#include "takt_msgs.h"

namespace takt {

using takt_msgs::msg::AppliedCommand;
using takt_msgs::msg::ComponentState;
using takt_msgs::msg::Contact;
using takt_msgs::msg::DeviceState;
using takt_msgs::msg::GripperState;
using takt_msgs::msg::PowerConsumer;
using takt_msgs::msg::ProcessStatus;
using takt_msgs::msg::RobotState;

/// The description, constant until the server loads another scenario.
struct CellInfo : takt_msgs::msg::CellDescription {
  CellInfo() = default;
  explicit CellInfo(takt_msgs::msg::CellDescription description)
      : CellDescription(std::move(description)), lists(named_lists<CellDescription>(*this)) {}

  /// Index by name, or -1.
  int find_component(std::string_view name) const;
  int find_robot(std::string_view name) const;
  int find_gripper(std::string_view name) const;
  int find_device(std::string_view name) const;
  /// Name of a component; empty for an invalid index.
  std::string component_name(int index) const;

  Named lists;  ///< names of all described elements
};

/// One instant of the cell. The functions that take a name throw ClientError (not_found) with the names there are.
struct State : takt_msgs::msg::CellState {
  std::shared_ptr<const CellInfo> cell;  ///< the description this state belongs to
  std::uint64_t sample_number =
      0;  ///< counts samples received; the server repeats an instant while it stands still

  const ComponentState& component(std::string_view name) const;
  const RobotState& robot(std::string_view name) const;
  const GripperState& gripper(std::string_view name) const;
  const DeviceState& device(std::string_view name) const;
  /// Signals of a device by name.
  std::map<std::string, double> signals(std::string_view device) const;
  /// Name of the component that holds `name`; empty for a free component.
  std::string partner_of(std::string_view name) const;
  /// Name of the Part that both jaws of the gripper `name` touch and hold (of several the first), or "".
  std::string part_present(std::string_view name) const;
};

struct Event : takt_msgs::msg::Event {
  std::uint64_t missed_before = 0;  ///< events lost directly before this one
};

struct Power : takt_msgs::msg::Power {
  std::uint64_t sample_number = 0;  ///< counts samples received
};

struct Contacts : takt_msgs::msg::Contacts {
  std::shared_ptr<const CellInfo> cell;
  std::uint64_t sample_number = 0;  ///< counts samples received
};

struct Status : takt_msgs::msg::Status {
  std::uint64_t sample_number = 0;  ///< counts samples received
};

}  // namespace takt
