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
#include "takt_topics.h"

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
  /// The description of a message, with the names of its elements.
  explicit CellInfo(takt_msgs::msg::CellDescription description)
      : CellDescription(std::move(description)), lists(named_lists<CellDescription>(*this)) {}

  int find_component(std::string_view name) const;  ///< index by name, or -1
  int find_robot(std::string_view name) const;      ///< index by name, or -1
  int find_gripper(std::string_view name) const;    ///< index by name, or -1
  int find_device(std::string_view name) const;     ///< index by name, or -1
  /// Name of a component; empty for an invalid index.
  std::string component_name(int index) const;

  Named lists;                      ///< names of all described elements
  std::uint64_t sample_number = 0;  ///< counts descriptions received
};

/// A message of a topic, as a client hands it out.
template <Message Type>
struct Sample : Type {
  std::shared_ptr<const CellInfo> cell{};  ///< the description this sample belongs to
  /// Counts samples of the topic received; the server repeats an instant while it stands still.
  std::uint64_t sample_number = 0;
};

/// One instant of the cell. The functions that take a name throw ClientError (not_found) with the names there are.
struct State : Sample<takt_msgs::msg::CellState> {
  const ComponentState& component(std::string_view name) const;  ///< pose, motion and holder of a component
  const RobotState& robot(std::string_view name) const;          ///< joints of a robot
  const GripperState& gripper(std::string_view name) const;      ///< jaws of a gripper
  const DeviceState& device(std::string_view name) const;        ///< signals of a device, in their order
  /// Signals of a device by name.
  std::map<std::string, double> signals(std::string_view device) const;
  /// Name of the component that holds `name`; empty for a free component.
  std::string partner_of(std::string_view name) const;
  /// Name of the Part that both jaws of the gripper `name` touch and hold (of several the first), or "".
  std::string part_present(std::string_view name) const;
};

/// Something that happened in the cell; docs/events.md lists the codes.
struct Event : Sample<takt_msgs::msg::Event> {
  std::uint64_t missed_before = 0;  ///< events lost directly before this one
};

using Status = Sample<takt_msgs::msg::Status>;
using Power = Sample<takt_msgs::msg::Power>;
using Contacts = Sample<takt_msgs::msg::Contacts>;

/// The sample of a message: Sample, or what adds to it.
template <Message Type>
struct SampleClass {
  using type = Sample<Type>;
};
template <>
struct SampleClass<takt_msgs::msg::CellDescription> {
  using type = CellInfo;
};
template <>
struct SampleClass<takt_msgs::msg::CellState> {
  using type = State;
};
template <>
struct SampleClass<takt_msgs::msg::Event> {
  using type = Event;
};
template <Message Type>
using SampleOf = typename SampleClass<Type>::type;

}  // namespace takt
