// Messages as JSON by the names of a description, and whether a message fits its description.
#include "client_lib/recording/message_json.h"

#include <gtest/gtest.h>

#include <vector>

#include "client_lib/recording/mcap_writer.h"
#include "client_lib/recording/sample.h"
#include "client_lib/recording/signal_table.h"
#include "client_lib/recording/signals.h"
#include "idl/common/cdr.h"
#include "takt_msgs.h"
#include "tests/support/temporary_directory.h"

namespace takt::test {
namespace {

using nlohmann::json;
using recording::message_json;

/// Two components, a robot of two joints, a gripper and a device of two signals.
takt_msgs::msg::CellDescription small_cell() {
  takt_msgs::msg::CellDescription cell;
  cell.components.resize(2);
  cell.components[0].name = "P";
  cell.components[1].name = "Jaw";
  auto& robot = cell.robots.emplace_back();
  robot.name = "R";
  robot.joints.resize(2);
  robot.joints[0].name = "pan";
  robot.joints[1].name = "lift";
  cell.grippers.emplace_back().name = "G";
  auto& device = cell.devices.emplace_back();
  device.name = "Oven";
  device.signals = {{"temperature", "degC", false, 0.0, 0.0}, {"door", "", true, 0.0, 1.0}};
  return cell;
}

takt_msgs::msg::CellState state_of_small_cell() {
  takt_msgs::msg::CellState state;
  state.time = 1.5;
  state.state_hash = 0xabc;
  state.components.resize(2);
  state.components[0].position = {1.0, 2.0, 3.0};
  state.components[0].state = PartState::grasped;
  state.components[0].partner = 1;
  state.robots.push_back({{0.5, -0.5}, {1.0, 2.0}, {3.0, 4.0}, {}});
  state.grippers.resize(1);
  state.grippers[0].part = 0;
  state.devices.push_back({{20.0, 1.0}});
  state.applied.push_back({"R", 7, {2, 5}});
  return state;
}

TEST(MessageJson, ListsAndIndicesAreCalledByTheNamesOfTheDescription) {
  const json state = message_json(state_of_small_cell(), named_lists(small_cell()));
  EXPECT_EQ(state["time"], 1.5);
  EXPECT_EQ(state["state_hash"], "0x0000000000000abc");
  EXPECT_EQ(state["components"]["P"]["position"], json::parse(R"({"x": 1.0, "y": 2.0, "z": 3.0})"));
  EXPECT_EQ(state["components"]["P"]["state"], "grasped");
  EXPECT_EQ(state["components"]["P"]["partner"], "Jaw");
  EXPECT_TRUE(state["components"]["Jaw"]["partner"].is_null());
  EXPECT_EQ(state["robots"]["R"]["position"], json::parse(R"({"pan": 0.5, "lift": -0.5})"));
  EXPECT_EQ(state["robots"]["R"]["motor_power"], json::object());
  EXPECT_EQ(state["grippers"]["G"]["part"], "P");
  EXPECT_EQ(state["devices"]["Oven"]["signals"], json::parse(R"({"temperature": 20.0, "door": 1.0})"));
  EXPECT_EQ(state["applied"]["R"], json::parse(R"({"count": 7, "newest_stamp": {"sec": 2, "nanosec": 5}})"));
}

TEST(MessageJson, ListsWithAKeyAndOtherListsNeedNoDescription) {
  takt_msgs::msg::Power power;
  power.consumers.resize(1);
  power.consumers[0].name = "R";
  power.consumers[0].mechanical_power = {1.0, 2.0};
  const json document = message_json(power, {});
  EXPECT_EQ(document["consumers"]["R"]["mechanical_power"], json::parse("[1.0, 2.0]"));
  EXPECT_FALSE(document["consumers"]["R"].contains("name"));
  takt_msgs::msg::Contacts contacts;
  contacts.contacts.resize(1);
  contacts.contacts[0].target = 1;
  EXPECT_EQ(message_json(contacts, named_lists(small_cell()))["contacts"][0]["target"], "Jaw");
  const json cell = message_json(small_cell(), {});
  EXPECT_EQ(
      cell["devices"]["Oven"]["signals"]["door"],
      json::parse(
          R"({"unit": "", "commanded": true, "lower": 0.0, "upper": 1.0, "type": "real", "wire": ""})"));
}

std::string sample_of(const auto& message) {
  std::string bytes;
  EXPECT_TRUE(cdr::write(message, bytes));
  return bytes;
}

TEST(MessageJson, SamplesOfARecordingHaveTheNamesOfItsDescription) {
  const std::string type = "takt_msgs/msg/CellState", sample = sample_of(state_of_small_cell());
  recording::JsonSamples samples(recording::known_types());
  const recording::Json alone = samples.read(type, sample);
  EXPECT_EQ(alone["state_hash"], "0x0000000000000abc");
  EXPECT_EQ(alone["components"][0]["state"], "grasped");
  EXPECT_EQ(alone["components"][0]["partner"], 1) << "without a description there are no names";
  EXPECT_EQ(samples.read("takt_msgs/msg/CellDescription", sample_of(small_cell()))["cell"], "");
  EXPECT_EQ(json(samples.read(type, sample)), message_json(state_of_small_cell(), named_lists(small_cell())));
  // A state of another cell is not cut to the size of this one.
  takt_msgs::msg::CellState larger = state_of_small_cell();
  larger.components.emplace_back();
  EXPECT_EQ(samples.read(type, sample_of(larger))["components"].size(), 3U);
}

TEST(MessageJson, ADescriptionNamesTheSamplesThatWereRecordedAheadOfIt) {
  const TemporaryDirectory directory;
  const auto file = directory / "r.mcap";
  {
    const auto& types = recording::known_types();
    recording::McapWriter writer(file, "a test");
    const auto states = writer.add_channel("/cell/state", types, "takt_msgs/msg/CellState", {});
    const auto descriptions =
        writer.add_channel("/cell/description", types, "takt_msgs/msg/CellDescription", {});
    writer.write(states, 1, 1, sample_of(state_of_small_cell()));
    writer.write(descriptions, 2, 2, sample_of(small_cell()));
    writer.write(states, 3, 3, sample_of(state_of_small_cell()));
  }
  recording::McapReader reader(file);
  const auto components = small_cell().components;
  EXPECT_EQ(recording::signal_names(reader, {"state.components.*.position.x"}),
            (std::vector<std::string>{"state.components." + components[0].name + ".position.x",
                                      "state.components." + components[1].name + ".position.x"}));
  int described = 0;
  recording::with_first_description(reader, [&](const recording::McapMessage& message) {
    ++described;
    EXPECT_EQ(message.log_time_ns, 2U);
  });
  EXPECT_EQ(described, 1);
}

TEST(MessageJson, SamplesOfOtherTypesAreAsTheyAre) {
  recording::MessageTypes types;
  types.add_ros2msg("takt_msgs/msg/CellState", "uint64 state_hash\n");  // of another version
  recording::JsonSamples samples(types);
  EXPECT_EQ(samples.read("takt_msgs/msg/CellState", std::string("\0\1\0\0\7\0\0\0\0\0\0\0", 12)).dump(),
            R"({"state_hash":7})");
}

TEST(MessageJson, TheWayToALeafIsTheNameOfItsSignal) {
  std::vector<std::string> found;
  recording::for_each_leaf(
      json::parse(R"({"a": {"x": 1, "y": null}, "b": [true, "t"]})"),
      [&](const std::string& name, const json& value) { found.push_back(name + "=" + value.dump()); });
  EXPECT_EQ(found, (std::vector<std::string>{"a.x=1", "a.y=null", "b.0=true", "b.1=\"t\""}));
}

TEST(MessageFits, AMessageOfTheDescriptionFits) {
  const Named cell = named_lists(small_cell());
  EXPECT_TRUE(fits(state_of_small_cell(), cell, cell));
  takt_msgs::msg::CellState state = state_of_small_cell();
  state.robots[0].motor_power = {1.0, 2.0};
  EXPECT_TRUE(fits(state, cell, cell));
}

TEST(MessageFits, OtherCountsAndIndicesDoNotFit) {
  const Named cell = named_lists(small_cell());
  const auto expect_refused = [&](const char* what, auto change) {
    takt_msgs::msg::CellState state = state_of_small_cell();
    change(state);
    EXPECT_FALSE(fits(state, cell, cell)) << what;
  };
  expect_refused("component missing", [](takt_msgs::msg::CellState& s) { s.components.pop_back(); });
  expect_refused("robot too many", [](takt_msgs::msg::CellState& s) { s.robots.push_back(s.robots[0]); });
  expect_refused("joint missing", [](takt_msgs::msg::CellState& s) { s.robots[0].position.pop_back(); });
  expect_refused("no velocity", [](takt_msgs::msg::CellState& s) { s.robots[0].velocity.clear(); });
  expect_refused("one power of two", [](takt_msgs::msg::CellState& s) { s.robots[0].motor_power = {1.0}; });
  expect_refused("signal too many",
                 [](takt_msgs::msg::CellState& s) { s.devices[0].signals.push_back(0.0); });
  expect_refused("partner beyond the list",
                 [](takt_msgs::msg::CellState& s) { s.components[0].partner = 2; });
  expect_refused("partner below -1", [](takt_msgs::msg::CellState& s) { s.components[0].partner = -2; });
  expect_refused("part beyond the list", [](takt_msgs::msg::CellState& s) { s.grippers[0].part = 2; });
  takt_msgs::msg::Contacts contacts;
  contacts.contacts.resize(1);
  EXPECT_TRUE(fits(contacts, cell, cell));
  contacts.contacts[0].base = -1;  // of a contact both are there
  EXPECT_FALSE(fits(contacts, cell, cell));
}

TEST(SignalTable, TheFirstInstantGivesTheColumns) {
  recording::SignalTable table;
  nlohmann::json instant = {{"time", 0.1}, {"a", {{"x", 1.0 / 3.0}, {"held", true}}}, {"b", nullptr}};
  EXPECT_EQ(table.lines(instant), "time,a.held,a.x,b\n0.1,1,0.3333333333333333,\n");
  instant = {{"time", 0.2}, {"b", "Table"}, {"c", 4}};
  EXPECT_EQ(table.lines(instant), "0.2,,,Table\n");
}

}  // namespace
}  // namespace takt::test
