#include "server/runtime/requests/control.h"

#include <gtest/gtest.h>

#include "tests/support/text_requests.h"

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
  template <Request Type>
  Type action(const std::string& name, const test::TextArguments& arguments) {
    auto parsed = parse(test::text_request(7, name, arguments), &cell_);
    if (const auto* refused = std::get_if<Refusal>(&parsed)) {
      ADD_FAILURE() << refused->message;
      return {};
    }
    return std::get<Type>(std::get<requests::Any>(parsed));
  }
  Refusal refusal(const std::string& name, const test::TextArguments& arguments) {
    auto parsed = parse(test::text_request(7, name, arguments), &cell_);
    if (std::holds_alternative<requests::Any>(parsed)) {
      ADD_FAILURE() << name << " was accepted";
      return {};
    }
    return std::get<Refusal>(parsed);
  }
  void expect_failure(const std::string& name, const test::TextArguments& arguments,
                      const std::string& words) {
    const Refusal refused = refusal(name, arguments);
    EXPECT_EQ(refused.result, ControlResult::failed);
    EXPECT_NE(refused.message.find(words), std::string::npos) << refused.message;
  }
  CellDescription cell_;
};

TEST_F(ControlTest, RequestsAreRead) {
  EXPECT_EQ(action<requests::SetState>("set_state", {{"state", "1"}}).state, SimulationState::playing);
  EXPECT_EQ(action<requests::SetState>("set_state", {{"state", "paused"}}).state, SimulationState::paused);
  EXPECT_EQ(action<requests::Step>("step", {{"steps", "12"}}).steps, 12U);
  EXPECT_EQ(action<requests::Step>("step", {}).steps, 1U);
  const auto pace = action<requests::SetPace>("set_pace", {{"pace", "realtime"}, {"factor", "2.5"}});
  EXPECT_EQ(pace.pace, Pace::realtime);
  EXPECT_EQ(pace.factor, 2.5);
  const auto controller = action<requests::RegisterController>(
      "register_controller",
      {{"name", "plc"}, {"period", "0.008"}, {"command_timeout", "3"}, {"targets", "Gripper1, Robot1"}});
  EXPECT_EQ(controller.period, 0.008);
  EXPECT_EQ(controller.command_timeout, 3.0);
  EXPECT_EQ(controller.targets, (std::vector<std::string>{"Gripper1", "Robot1"}));
  EXPECT_EQ(action<requests::ExplainPart>("explain_part", {{"part", "Table"}}).part, "Table");
  const auto all = action<requests::SetLevelOfDetail>("set_level_of_detail", {{"level_of_detail", "2"}});
  EXPECT_EQ(all.process, "all");
  EXPECT_EQ(all.level_of_detail, 2);
  EXPECT_EQ(
      action<requests::SetLevelOfDetail>("set_level_of_detail", {{"level_of_detail", "3"}}).level_of_detail,
      3);
  EXPECT_EQ(action<requests::SetLevelOfDetail>("set_level_of_detail",
                                               {{"level_of_detail", "1"}, {"process", "all"}})
                .process,
            "all");
  EXPECT_EQ(action<requests::SetLevelOfDetail>("set_level_of_detail",
                                               {{"level_of_detail", "1"}, {"process", "packing"}})
                .process,
            "packing");
  for (const int scope : {0, 1, 2, 3, 4, 5, 255})
    EXPECT_EQ(action<requests::Reset>("reset", {{"scope", std::to_string(scope)}}).scope, scope);
}

TEST_F(ControlTest, AnUnknownRequestIsUnsupported) {
  for (const char* name : {"load_world", "save_snapshots", ""}) {
    const Refusal refused = refusal(name, {});
    EXPECT_EQ(refused.result, ControlResult::unsupported);
    EXPECT_NE(refused.message.find("get_state"), std::string::npos) << refused.message;
  }
  EXPECT_TRUE(refusal("save_snapshots", {}).message.ends_with("Did you mean 'save_snapshot'?"));
}

TEST_F(ControlTest, InvalidArgumentsAreNamedWithTheAllowedOnes) {
  expect_failure("get_state", {{"x", "1"}}, "no argument 'x'; it takes none");
  expect_failure("step", {{"step", "1"}}, "no argument 'step'; it takes steps");
  expect_failure("step", {{"steps", "0"}}, "'steps' is '0'; allowed is a whole number from 1");
  expect_failure("step", {{"steps", "1.5"}}, "'1.5'");
  expect_failure("step", {{"steps", "-1"}}, "'-1'");
  expect_failure("step", {{"steps", "1"}, {"steps", "2"}}, "twice");
  expect_failure("set_state", {{"state", "7"}}, "'7'; allowed is stopped, playing, paused or quitting");
  expect_failure("set_state", {}, "needs the argument 'state'");
  expect_failure("set_pace", {{"pace", "fast"}}, "'fast'; allowed is realtime, free or lockstep");
  for (const char* factor : {"nan", "inf", "0", "-1", "1e9", "x", ""}) {
    expect_failure("set_pace", {{"pace", "realtime"}, {"factor", factor}}, "'factor'");
  }
  expect_failure("reset", {{"scope", "8"}}, "'scope' is '8'");
  const Refusal unknown =
      refusal("register_controller", {{"name", "a"}, {"period", "0.008"}, {"targets", "Robot1,Robot9"}});
  EXPECT_EQ(unknown.result, ControlResult::not_found);
  EXPECT_EQ(unknown.message,
            "There is no target 'Robot9' in this cell; it has Robot1, Gripper1. Did you mean 'Robot1'?");
  expect_failure("register_controller", {{"name", "a"}, {"period", "0.008"}}, "'targets'");
  expect_failure("register_controller", {{"name", "a"}, {"period", "-0.0005"}, {"targets", "Robot1"}},
                 "'period'");
  expect_failure("register_controller", {{"period", "0.008"}, {"targets", "Robot1"}}, "'name'");
}

TEST_F(ControlTest, ANameThatIsNearlyRightIsSuggested) {
  EXPECT_EQ(refusal("set_pace", {{"pace", "free"}, {"faktor", "2"}}).message,
            "'set_pace' has no argument 'faktor'; it takes pace, factor. Did you mean 'factor'?");
  EXPECT_TRUE(refusal("explain_part", {{"part", "Tabel"}}).message.ends_with("Did you mean 'Table'?"));
  EXPECT_FALSE(refusal("explain_part", {{"part", "Oven"}}).message.ends_with("?"));
}

TEST_F(ControlTest, AnUnknownPartIsNotFound) {
  const Refusal reply = refusal("explain_part", {{"part", "Q"}});
  EXPECT_EQ(reply.result, ControlResult::not_found);
  EXPECT_EQ(reply.message, "There is no component 'Q' in this cell; it has P, Table.");
  expect_failure("explain_part", {}, "needs the argument 'part'");
  expect_failure("explain_part", {{"name", "P"}}, "no argument 'name'; it takes part");
}

TEST_F(ControlTest, LevelsOfDetailAreChecked) {
  for (const char* level : {"0", "4", "-1", "1.5", "two", ""})
    expect_failure("set_level_of_detail", {{"level_of_detail", level}}, "'level_of_detail'");
  expect_failure("set_level_of_detail", {{"process", "assembly"}},
                 "needs the argument 'level_of_detail', a whole number from 1 to 3");
  expect_failure("set_level_of_detail", {{"level_of_detail", "2"}, {"robot", "Robot1"}},
                 "no argument 'robot'; it takes level_of_detail, process");
  const Refusal reply = refusal("set_level_of_detail", {{"level_of_detail", "2"}, {"process", "welding"}});
  EXPECT_EQ(reply.result, ControlResult::not_found);
  EXPECT_EQ(reply.message, "There is no process 'welding' in this cell; it has all, assembly, packing.");
  EXPECT_EQ(features().levels_of_detail, (std::vector<std::int32_t>{1, 2, 3}));
}

TEST_F(ControlTest, ALongListOfNamesIsCut) {
  cell_.components.resize(4096);
  for (auto& component : cell_.components) component.name = std::string(100, 'x');
  const Refusal reply = refusal("explain_part", {{"part", std::string(100, 'q')}});
  EXPECT_EQ(reply.result, ControlResult::not_found);
  EXPECT_LT(reply.message.size(), 1024U);
}

TEST(Control, EachRequestComesBackFromItsValuesAsItWas) {
  const auto back = [](const requests::Any& request) {
    const auto parsed = parse(control_request(request), nullptr);
    EXPECT_TRUE(std::holds_alternative<requests::Any>(parsed));
    return std::get<requests::Any>(parsed);
  };
  for (const double value : {0.1, 1.0 / 3.0, 42.0, 1e-300, 123456.789012345}) {
    const requests::SetEntityState put{.entity = "P", .position = takt_msgs::msg::Vector3{value, -value, 0}};
    EXPECT_EQ(std::get<requests::SetEntityState>(back(put)), put);
  }
  const requests::RegisterController plc{"plc", 0.008, 3.0, {"a, b", "c"}};
  EXPECT_EQ(std::get<requests::RegisterController>(back(plc)), plc);
  const requests::SpawnEntity spawn{.name = "X", .allow_renaming = true, .copy_of = "A"};
  EXPECT_EQ(std::get<requests::SpawnEntity>(back(spawn)), spawn);
}

TEST(Control, AValueOfAnotherKindIsRefused) {
  Value text{.kind = ValueKind::text, .text = "3"};
  const auto parsed = parse({1, "step", {{"steps", text}}}, nullptr);
  ASSERT_TRUE(std::holds_alternative<Refusal>(parsed));
  EXPECT_EQ(std::get<Refusal>(parsed).message,
            "Argument 'steps' is '3'; allowed is a whole number from 1 to 1000000000.");
}

TEST(Control, AnExplanationComesThroughItsValues) {
  requests::ExplainPartResponse reported{.part = "P", .hierarchy = 2, .partner = "G"};
  reported.sequence_count = ~std::uint64_t{0} / 2;
  reported.sequences = {{{"P", "G"}}};
  reported.contacts = {{.a = "P", .b = "G", .measured = true, .distance = -1e-6, .normal = {0, 0, 1}}};
  reported.components = {{"P", ComponentType::part, 2}, {"G", ComponentType::gripper, {}}};
  requests::ExplainPartResponse back;
  EXPECT_FALSE(read_arguments("explain_part", arguments_of(reported), back));
  EXPECT_EQ(back, reported);
}

}  // namespace
}  // namespace takt
