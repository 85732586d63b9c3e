#include <gtest/gtest.h>

#include <functional>

#include "server/runtime/requests/control.h"
#include "tests/support/text_requests.h"

namespace takt {
namespace {

using test::TextArguments;

template <Request Type>
Type action(const TextArguments& arguments) {
  auto parsed = parse(test::text_request(7, std::string(request_info<Type>().name), arguments), nullptr);
  if (const auto* refused = std::get_if<Refusal>(&parsed)) {
    ADD_FAILURE() << refused->message;
    return {};
  }
  return std::get<Type>(std::get<requests::Any>(parsed));
}

void expect_failure(const std::string& name, const TextArguments& arguments, const std::string& words) {
  auto parsed = parse(test::text_request(7, name, arguments), nullptr);
  const auto* refused = std::get_if<Refusal>(&parsed);
  ASSERT_NE(refused, nullptr) << "accepted, though " << words;
  EXPECT_EQ(refused->result, ControlResult::failed);
  EXPECT_NE(refused->message.find(words), std::string::npos) << refused->message;
}

TEST(HostRequests, ALoadHasFileOverridesAndLevel) {
  const auto load = action<requests::LoadScenario>({{"uri", "file:///a/b.yaml"},
                                                    {"overrides", "x.y=1\n\nz=[1, 2],w={a: 1, b: 2}"},
                                                    {"level_of_detail", "2"}});
  EXPECT_EQ(load.uri, "file:///a/b.yaml");
  EXPECT_EQ(load.overrides, (std::vector<std::string>{"x.y=1", "z=[1, 2]", "w={a: 1, b: 2}"}));
  EXPECT_EQ(load.level_of_detail, 2);
  const auto plain = action<requests::LoadScenario>({{"uri", "cell.yaml"}});
  EXPECT_TRUE(plain.overrides.empty());
  EXPECT_FALSE(plain.level_of_detail.has_value());
  expect_failure("load_scenario", {}, "'uri'");
  expect_failure("load_scenario", {{"uri", "a"}, {"level_of_detail", "4"}}, "'level_of_detail' is '4'");
  expect_failure("load_scenario", {{"uri", "a"}, {"file", "b"}}, "has no argument 'file'");
  expect_failure("unload_scenario", {{"uri", "a"}}, "it takes none");
}

TEST(HostRequests, AWatchHasPairsAndADuration) {
  const auto watch = action<requests::WatchPressures>({{"pairs", "P-*, O-P"}, {"duration", "2.5"}});
  EXPECT_EQ(watch.pairs, (std::vector<std::string>{"P-*", "O-P"}));
  EXPECT_EQ(watch.duration, 2.5);
  EXPECT_EQ(action<requests::WatchPressures>({{"pairs", "*"}}).duration, 10.0);
  expect_failure("watch_pressures", {}, "'pairs'");
  expect_failure("watch_pressures", {{"pairs", "*"}, {"duration", "-1"}}, "'duration' is '-1'");
}

TEST(HostRequests, ASpawnHasANewPartOrACopy) {
  const auto made = action<requests::SpawnEntity>({{"name", "A"},
                                                   {"uri", "a.obj"},
                                                   {"mass", "0.5"},
                                                   {"mesh_scale", "0.001"},
                                                   {"hierarchy", "3"},
                                                   {"position", "1, -2e-1 3"},
                                                   {"orientation", "0.6 0 0 0.8"}});
  EXPECT_EQ(made.uri, "a.obj");
  EXPECT_EQ(made.mass, 0.5);
  EXPECT_EQ(made.mesh_scale, 0.001);
  EXPECT_EQ(made.hierarchy, 3);
  EXPECT_EQ(made.position, (takt_msgs::msg::Vector3{1.0, -0.2, 3.0}));
  EXPECT_EQ(made.orientation, (takt_msgs::msg::Quaternion{0.6, 0.0, 0.0, 0.8}));
  const auto copy = action<requests::SpawnEntity>(
      {{"name", "B"}, {"copy_of", "A"}, {"position", "0 0 0"}, {"allow_renaming", "true"}});
  EXPECT_EQ(copy.copy_of, "A");
  EXPECT_TRUE(copy.allow_renaming);
  EXPECT_FALSE(copy.mass.has_value());
  EXPECT_EQ(copy.orientation, takt_msgs::msg::Quaternion{});

  const TextArguments good{{"name", "A"}, {"copy_of", "B"}, {"position", "0 0 0"}};
  const auto with = [&](const std::string& name, const std::string& value) {
    TextArguments arguments = good;
    std::erase_if(arguments, [&](const auto& argument) { return argument.first == name; });
    arguments.emplace_back(name, value);
    return arguments;
  };
  expect_failure("spawn_entity", with("mass", "0"), "'mass' is '0'");
  expect_failure("spawn_entity", with("hierarchy", "0"), "'hierarchy' is '0'");
  expect_failure("spawn_entity", with("allow_renaming", "yes"), "true or false");
  expect_failure("spawn_entity", {{"name", "A"}, {"copy_of", "B"}}, "'position'");
  for (const char* position :
       {"", "0 0", "0 0 0 0", "0 0 nan", "0 0 inf", "0 0 1e999", "0 0 2e9", "a b c", "0;0;0"})
    expect_failure("spawn_entity", with("position", position), "3 finite numbers");
  for (const char* orientation : {"0 0 0 0", "0 0 0 2", "1 1 1 1"})
    expect_failure("spawn_entity", with("orientation", orientation), "length 1");
}

}  // namespace
}  // namespace takt
