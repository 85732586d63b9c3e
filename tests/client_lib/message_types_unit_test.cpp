// Message types as data, and the fields of samples read with them.
#include <gtest/gtest.h>

#include "client_lib/recording/message_types.h"
#include "client_lib/recording/sample.h"
#include "takt_msgs.h"
#include "tests/support/cdr_bytes.h"

namespace {

using takt::recording::Json;
using takt::recording::known_types;
using takt::recording::MessageTypes;
using takt::recording::RecordingError;
using takt::recording::SignalNames;
using takt::recording::to_json;
using takt::test::CdrWriter;

TEST(MessageTypes, FieldTablesBecomeTheTextRos2Uses) {
  MessageTypes types;
  types.add(takt::message_info<takt_msgs::msg::ControlRequest>());
  const std::string line = std::string(80, '=') + "\n";
  EXPECT_EQ(types.ros2msg("takt_msgs/msg/ControlRequest"),
            "string<=128 client_id\nuint64 sequence_number\nstring<=64 request\n"
            "takt_msgs/Argument[<=64] arguments\n" +
                line + "MSG: takt_msgs/Argument\nstring<=64 name\ntakt_msgs/Value value\n" + line +
                "MSG: takt_msgs/Value\nuint8 kind\nbool flag\nint64 integer\nfloat64 number\nstring text\n"
                "float64[] numbers\nstring[] texts\n");
  // And back.
  MessageTypes again;
  again.add_ros2msg("takt_msgs/msg/ControlRequest",
                    "# a comment\nint8 CONSTANT=3\n" + types.ros2msg("takt_msgs/msg/ControlRequest"));
  EXPECT_EQ(again.ros2msg("takt_msgs/msg/ControlRequest"), types.ros2msg("takt_msgs/msg/ControlRequest"));
}

TEST(MessageTypes, OfEveryKindBecomeTheTextTheyWereReadFrom) {
  const std::string text =
      "string<=8 name\ngeo/Point[<=5] points\nstring<=4[<=2] tags\nuint64 id\nuint8 kind\nfloat32[3] scale\n"
      "geo/Point transform\n" +
      std::string(80, '=') + "\nMSG: geo/Point\nfloat64 x\nfloat64 y\n";
  MessageTypes types;
  types.add_ros2msg("geo/msg/Path", text);
  EXPECT_EQ(types.ros2msg("geo/msg/Path"), text);
}

TEST(MessageTypes, TypesOfTheCellHaveTheirFields) {
  const auto& state = known_types().at("takt_msgs/msg/CellState");
  EXPECT_EQ(state.fields.at(0).message, "builtin_interfaces/msg/Time");
  EXPECT_EQ(state.fields.at(6).name, "components");
  EXPECT_EQ(state.fields.at(6).count, 4096U);
  EXPECT_NE(known_types().find("std_msgs/msg/String"), nullptr);
  EXPECT_EQ(takt::recording::message_name("std_msgs::msg::dds_::String_"), "std_msgs/msg/String");
  EXPECT_EQ(takt::recording::dds_type_name("std_msgs/msg/String"), "std_msgs::msg::dds_::String_");
}

/// As the packages action_msgs and unique_identifier_msgs of ROS 2 define it.
TEST(MessageTypes, StatesOfGoalsAreKnown) {
  const std::string line = std::string(80, '=') + "\nMSG: ";
  EXPECT_EQ(known_types().ros2msg("action_msgs/msg/GoalStatusArray"),
            "action_msgs/GoalStatus[] status_list\n" + line +
                "action_msgs/GoalStatus\naction_msgs/GoalInfo goal_info\nint8 status\n" + line +
                "action_msgs/GoalInfo\nunique_identifier_msgs/UUID goal_id\nbuiltin_interfaces/Time stamp\n" +
                line + "unique_identifier_msgs/UUID\nuint8[16] uuid\n" + line +
                "builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n");
}

TEST(Samples, SamplesAreReadWithTheAlignmentOfCdr) {
  MessageTypes types;
  types.add_ros2msg("a/msg/T", "uint8 flag\nfloat64 x\nstring s\nint16 n\nint32[] l\n");
  // By hand: head; 1, seven of padding, 1.5; 3, "hi" with its end, one of padding, -2, two of padding, 2, 7,
  // -7.
  const std::string sample{
      "\x00\x01\x00\x00"
      "\x01\x00\x00\x00\x00\x00\x00\x00"
      "\x00\x00\x00\x00\x00\x00\xf8\x3f"
      "\x03\x00\x00\x00hi\x00\x00\xfe\xff\x00\x00"
      "\x02\x00\x00\x00\x07\x00\x00\x00\xf9\xff\xff\xff",
      4 + 8 + 8 + 12 + 12};
  const Json json = to_json(types, "a/msg/T", sample);
  EXPECT_EQ(json.dump(), R"({"flag":1,"x":1.5,"s":"hi","n":-2,"l":[7,-7]})");
  CdrWriter out;
  out.put(std::uint8_t{1});
  out.put(1.5);
  out.put("hi");
  out.put(std::int16_t{-2});
  out.sequence(std::vector<std::int32_t>{7, -7});
  EXPECT_EQ(out.bytes(), sample);
  for (std::size_t length = 0; length < sample.size(); ++length)
    EXPECT_THROW(to_json(types, "a/msg/T", sample.substr(0, length)), RecordingError) << length;
}

TEST(Signals, SignalsHaveTheNamesOfTheDescription) {
  SignalNames names;
  names.describe(Json::parse(R"({"components": [{"name": "P"}, {"name": "Table1"}],
    "robots": [{"name": "Robot1", "joints": [{"name": "pan"}, {"name": "lift"}]}],
    "devices": [{"name": "Oven", "signals": [{"name": "door"}]}]})"));
  std::vector<std::string> found;
  const auto note = [&](const std::string& name, double value) {
    found.push_back(name + "=" + std::to_string(static_cast<int>(value)));
  };
  names.visit(Json::parse(R"({"components": [{"x": 1}, {"x": 2}], "robots": [{"position": [3, 4]}]})"), note);
  names.visit(Json::parse(R"({"contacts": [{"base": 0, "target": 1, "area": 5}]})"), note);
  names.visit(Json::parse(R"({"devices": [{"signals": [8]}]})"), note);
  names.visit(Json::parse(R"({"name": ["pan", "lift"], "effort": [6, 7]})"), note);
  EXPECT_EQ(found,
            (std::vector<std::string>{
                "components.P.x=1", "components.Table1.x=2", "robots.Robot1.position.pan=3",
                "robots.Robot1.position.lift=4", "contacts.P-Table1.base=0", "contacts.P-Table1.target=1",
                "contacts.P-Table1.area=5", "devices.Oven.signals.door=8", "effort.pan=6", "effort.lift=7"}));
}

}  // namespace
