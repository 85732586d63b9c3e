#include "server/runtime/requests/host_requests.h"

#include <gtest/gtest.h>

#include <functional>

#include "server/runtime/requests/entity_requests.h"

namespace takt {
namespace {

template <typename Action>
Action action(const std::string& name, TextArguments arguments, bool with_spawned = false) {
  auto parsed = parse_host_request({7, name, std::move(arguments)}, with_spawned);
  if (!parsed) {
    ADD_FAILURE() << name << " is no request of the host";
    return {};
  }
  if (const auto* reply = std::get_if<ControlReply>(&*parsed)) {
    ADD_FAILURE() << reply->message;
    return {};
  }
  return std::get<Action>(std::get<HostAction>(*parsed));
}

void expect_failure(const std::string& name, TextArguments arguments, const std::string& words) {
  auto parsed = parse_host_request({7, name, std::move(arguments)});
  ASSERT_TRUE(parsed.has_value());
  const auto* reply = std::get_if<ControlReply>(&*parsed);
  ASSERT_NE(reply, nullptr) << "accepted, though " << words;
  EXPECT_EQ(reply->id, 7U);
  EXPECT_EQ(reply->result, ControlResult::failed);
  EXPECT_NE(reply->message.find(words), std::string::npos) << reply->message;
}

TEST(HostRequests, LoadReadsFileOverridesAndLevel) {
  const auto load = action<LoadScenario>(
      "load_scenario", {{"uri", "file:///a/b.yaml"}, {"overrides", "x.y=1\n\nz=[1, 2]\n"}, {"lod", "2"}});
  EXPECT_EQ(load.file, "/a/b.yaml");
  EXPECT_EQ(load.options.overrides, (std::vector<std::string>{"x.y=1", "z=[1, 2]"}));
  EXPECT_EQ(load.options.level_of_detail, 2);
  const auto plain = action<LoadScenario>("load_scenario", {{"uri", "cell.yaml"}});
  EXPECT_EQ(plain.file, "cell.yaml");
  EXPECT_TRUE(plain.options.overrides.empty());
  EXPECT_FALSE(plain.options.level_of_detail.has_value());
  expect_failure("load_scenario", {}, "'uri'");
  expect_failure("load_scenario", {{"uri", "a"}, {"lod", "4"}}, "'lod' is '4'");
  expect_failure("load_scenario", {{"uri", "a"}, {"file", "b"}}, "has no argument 'file'");
  expect_failure("unload_scenario", {{"uri", "a"}}, "it takes none");
}

TEST(HostRequests, WatchReadsPairsAndHowLong) {
  const auto watch = action<WatchPressures>("watch_pressures", {{"pairs", "P-*, O-P"}, {"for_s", "2.5"}});
  EXPECT_EQ(watch.pairs, "P-*, O-P");
  EXPECT_EQ(watch.for_s, 2.5);
  EXPECT_EQ(action<WatchPressures>("watch_pressures", {{"pairs", "*"}}).for_s, 10.0);
  expect_failure("watch_pressures", {}, "'pairs'");
  expect_failure("watch_pressures", {{"pairs", "*"}, {"for_s", "-1"}}, "'for_s' is '-1'");
}

TEST(HostRequests, SpawnReadsANewPartOrACopy) {
  const auto made = action<SpawnEntity>("spawn_entity", {{"name", "A"},
                                                         {"uri", "a.obj"},
                                                         {"mass_kg", "0.5"},
                                                         {"mesh_scale", "0.001"},
                                                         {"hierarchy", "3"},
                                                         {"position", "1, -2e-1 3"},
                                                         {"orientation", "0.6 0 0 0.8"}});
  EXPECT_EQ(made.mesh, "a.obj");
  EXPECT_EQ(made.mass_kg, 0.5);
  EXPECT_EQ(made.mesh_scale, 0.001);
  EXPECT_EQ(made.hierarchy, 3);
  EXPECT_EQ(made.X_WB.p, Vec3(1.0, -0.2, 3.0));
  // A turn by 2 atan(0.6 / 0.8) about x: cosine 0.28, sine 0.96.
  EXPECT_NEAR(made.X_WB.R(1, 1), 0.28, 1e-15);
  EXPECT_NEAR(made.X_WB.R(2, 1), 0.96, 1e-15);
  const auto copy = action<SpawnEntity>(
      "spawn_entity", {{"name", "B"}, {"copy_of", "A"}, {"position", "0 0 0"}, {"allow_renaming", "true"}});
  EXPECT_EQ(copy.copy_of, "A");
  EXPECT_TRUE(copy.allow_renaming);
  EXPECT_FALSE(copy.mass_kg.has_value());
  EXPECT_EQ(copy.X_WB, Pose{});

  const TextArguments good{{"name", "A"}, {"copy_of", "B"}, {"position", "0 0 0"}};
  const auto with = [&](const std::string& name, const std::string& value) {
    TextArguments arguments = good;
    std::erase_if(arguments, [&](const auto& argument) { return argument.first == name; });
    arguments.emplace_back(name, value);
    return arguments;
  };
  expect_failure("spawn_entity", with("uri", "c.obj"), "either 'uri'");
  expect_failure("spawn_entity", {{"name", "A"}, {"position", "0 0 0"}}, "either 'uri'");
  expect_failure("spawn_entity", {{"name", "A"}, {"uri", "a.obj"}, {"position", "0 0 0"}},
                 "'mass_kg' is missing");
  expect_failure("spawn_entity", with("mesh_scale", "2"), "'mesh_scale' only together");
  expect_failure("spawn_entity", with("mass_kg", "0"), "'mass_kg' is '0'");
  expect_failure("spawn_entity", with("hierarchy", "0"), "'hierarchy' is '0'");
  expect_failure("spawn_entity", with("allow_renaming", "yes"), "true or false");
  expect_failure("spawn_entity", {{"name", "A"}, {"copy_of", "B"}}, "'position'");
  for (const char* position : {"", "0 0", "0 0 0 0", "0 0 nan", "0 0 inf", "0 0 1e999", "a b c", "0;0;0"})
    expect_failure("spawn_entity", with("position", position), "3 finite numbers");
  for (const char* orientation : {"0 0 0 0", "0 0 0 2", "1 1 1 1"})
    expect_failure("spawn_entity", with("orientation", orientation), "length 1");
}

TEST(HostRequests, AResetIsTheHostsOnlyWhereSomethingWasSpawnedAndItsScopeIncludesThat) {
  EXPECT_FALSE(parse_host_request({7, "reset", {}}).has_value());
  for (const char* scope : {"1", "2", "3"})
    EXPECT_FALSE(parse_host_request({7, "reset", {{"scope", scope}}}, true).has_value()) << scope;
  EXPECT_TRUE(action<ResetSpawned>("reset", {{"scope", "4"}}, true).spawned_only);
  EXPECT_FALSE(action<ResetSpawned>("reset", {}, true).spawned_only);
  EXPECT_FALSE(action<ResetSpawned>("reset", {{"scope", "255"}}, true).spawned_only);
  // What is wrong is for the loop to say.
  EXPECT_FALSE(parse_host_request({7, "reset", {{"scope", "9"}}}, true).has_value());
}

}  // namespace
}  // namespace takt
