#include "server/runtime/requests/control.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "idl/common/text.h"

namespace takt {
namespace {

class ControlTest : public testing::Test {
 protected:
  ControlTest() {
    cell_.robots.resize(1);
    cell_.robots[0].name = "Robot1";
    cell_.components.resize(2);
    cell_.components[0].name = "P";
    cell_.components[1].name = "Table";
    cell_.processes = {{"assembly", 1, {0}, {}}, {"packing", 2, {}, {}}};
    cell_.grippers.resize(1);
    cell_.grippers[0].name = "Gripper1";
  }
  template <typename Action>
  Action action(const std::string& name, TextArguments arguments) {
    auto parsed = parse({7, name, std::move(arguments)}, cell_);
    if (const auto* reply = std::get_if<ControlReply>(&parsed)) {
      ADD_FAILURE() << reply->message;
      return {};
    }
    return std::get<Action>(std::get<ControlAction>(parsed));
  }
  ControlReply refusal(const std::string& name, TextArguments arguments) {
    auto parsed = parse({7, name, std::move(arguments)}, cell_);
    if (std::holds_alternative<ControlAction>(parsed)) {
      ADD_FAILURE() << name << " was accepted";
      return {};
    }
    EXPECT_EQ(std::get<ControlReply>(parsed).id, 7U);
    return std::get<ControlReply>(parsed);
  }
  void expect_failure(const std::string& name, TextArguments arguments, const std::string& words) {
    const ControlReply reply = refusal(name, std::move(arguments));
    EXPECT_EQ(reply.result, ControlResult::failed);
    EXPECT_NE(reply.message.find(words), std::string::npos) << reply.message;
  }
  CellDescription cell_;
};

TEST_F(ControlTest, RequestsAreRead) {
  EXPECT_EQ(action<SetState>("set_state", {{"state", "1"}}).state, SimulationState::playing);
  EXPECT_EQ(action<SetState>("set_state", {{"state", "paused"}}).state, SimulationState::paused);
  EXPECT_EQ(action<Step>("step", {{"steps", "12"}}).steps, 12U);
  EXPECT_EQ(action<Step>("step", {}).steps, 1U);
  const auto pace = action<SetPace>("set_pace", {{"pace", "realtime"}, {"factor", "2.5"}});
  EXPECT_EQ(pace.pace, Pace::realtime);
  EXPECT_EQ(pace.factor, 2.5);
  const auto controller = action<RegisterController>(
      "register_controller",
      {{"name", "plc"}, {"period_s", "0.008"}, {"timeout_s", "3"}, {"targets", "Gripper1, Robot1"}});
  EXPECT_EQ(controller.period_s, 0.008);
  EXPECT_EQ(controller.timeout_s, 3.0);
  EXPECT_EQ(controller.targets, (std::vector<int>{1, 0}));
  EXPECT_EQ(action<ExplainPart>("explain_part", {{"part", "Table"}}).component, 1);
  const auto all = action<SetLevelOfDetail>("set_level_of_detail", {{"level", "2"}});
  EXPECT_EQ(all.process, -1);
  EXPECT_EQ(all.level, 2);
  EXPECT_EQ(action<SetLevelOfDetail>("set_level_of_detail", {{"level", "3"}}).level, 3);
  EXPECT_EQ(action<SetLevelOfDetail>("set_level_of_detail", {{"level", "1"}, {"process", "all"}}).process,
            -1);
  EXPECT_EQ(action<SetLevelOfDetail>("set_level_of_detail", {{"level", "1"}, {"process", "packing"}}).process,
            1);
  for (const char* scope : {"0", "1", "2", "3", "5", "255"})
    EXPECT_FALSE(action<Reset>("reset", {{"scope", scope}}).spawned_only);
  EXPECT_TRUE(action<Reset>("reset", {{"scope", "4"}}).spawned_only);
}

TEST_F(ControlTest, AnUnknownRequestIsUnsupported) {
  for (const char* name : {"load_scenario", "spawn_entity", ""}) {
    const ControlReply reply = refusal(name, {});
    EXPECT_EQ(reply.result, ControlResult::unsupported);
    EXPECT_NE(reply.message.find("get_state"), std::string::npos) << reply.message;
  }
}

TEST_F(ControlTest, InvalidArgumentsAreNamedWithTheAllowedOnes) {
  expect_failure("get_state", {{"x", "1"}}, "no argument 'x'; it takes none");
  expect_failure("step", {{"step", "1"}}, "no argument 'step'; it takes steps");
  expect_failure("step", {{"steps", "0"}}, "'steps' is '0'; allowed is a whole number from 1");
  expect_failure("step", {{"steps", "1.5"}}, "'1.5'");
  expect_failure("step", {{"steps", "-1"}}, "'-1'");
  expect_failure("step", {{"steps", "1"}, {"steps", "2"}}, "twice");
  expect_failure("set_state", {{"state", "7"}}, "'7'; allowed is 0 (stopped)");
  expect_failure("set_state", {}, "needs the argument 'state'");
  expect_failure("set_pace", {{"pace", "fast"}}, "'fast'; allowed is realtime, free or lockstep");
  for (const char* factor : {"nan", "inf", "0", "-1", "1e9", "x", ""}) {
    expect_failure("set_pace", {{"pace", "realtime"}, {"factor", factor}}, "'factor'");
  }
  expect_failure("reset", {{"scope", "8"}}, "'scope' is '8'");
  expect_failure("register_controller", {{"name", "a"}, {"period_s", "0.008"}, {"targets", "Robot1,Robot9"}},
                 "'Robot9'; allowed is any of Robot1, Gripper1");
  expect_failure("register_controller", {{"name", "a"}, {"period_s", "0.008"}, {"targets", "Robot1,Robot1"}},
                 "twice");
  expect_failure("register_controller", {{"name", "a"}, {"period_s", "0.008"}}, "'targets'");
  expect_failure("register_controller", {{"name", "a"}, {"period_s", "0.0005"}, {"targets", "Robot1"}},
                 "'period_s'");
  expect_failure("register_controller", {{"period_s", "0.008"}, {"targets", "Robot1"}}, "'name'");
}

TEST_F(ControlTest, AnUnknownPartIsNotFound) {
  const ControlReply reply = refusal("explain_part", {{"part", "Q"}});
  EXPECT_EQ(reply.result, ControlResult::not_found);
  EXPECT_EQ(reply.message, "There is no component 'Q' in this cell; it has P, Table.");
  expect_failure("explain_part", {}, "needs the argument 'part'");
  expect_failure("explain_part", {{"name", "P"}}, "no argument 'name'; it takes part");
}

TEST_F(ControlTest, LevelsOfDetailAreChecked) {
  for (const char* level : {"0", "4", "-1", "1.5", "two", ""})
    expect_failure("set_level_of_detail", {{"level", level}}, "'level'");
  expect_failure("set_level_of_detail", {{"process", "assembly"}},
                 "'level' is missing; allowed is a whole number from 1 to 3");
  expect_failure("set_level_of_detail", {{"level", "2"}, {"robot", "Robot1"}},
                 "no argument 'robot'; it takes process, level");
  const ControlReply reply = refusal("set_level_of_detail", {{"level", "2"}, {"process", "welding"}});
  EXPECT_EQ(reply.result, ControlResult::not_found);
  EXPECT_EQ(reply.message, "There is no process 'welding' in this cell; there are: all, assembly, packing.");
  const ControlReply features = features_reply(1);
  EXPECT_NE(std::find(features.values.begin(), features.values.end(),
                      std::pair<std::string, std::string>("levels_of_detail", "1,2,3")),
            features.values.end());
}

TEST_F(ControlTest, ALongListOfNamesIsCut) {
  cell_.components.resize(4096);
  for (auto& component : cell_.components) component.name = std::string(100, 'x');
  const ControlReply reply = refusal("explain_part", {{"part", std::string(5000, 'q')}});
  EXPECT_EQ(reply.result, ControlResult::not_found);
  EXPECT_LT(reply.message.size(), 1024U);
}

TEST(Control, NumbersKeepTheirBits) {
  for (const double value : {0.1, 1.0 / 3.0, 42.0, 1e-300, 123456.789012345}) {
    EXPECT_EQ(std::stod(exact_text(value)), value);
  }
}

}  // namespace
}  // namespace takt
