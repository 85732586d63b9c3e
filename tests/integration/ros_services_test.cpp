// The control requests as ROS 2 services, called as rmw_fastrtps calls: the request carries the caller's
// reader of replies in its related_sample_identity, the reply carries back that and the request's number.
#include <gtest/gtest.h>

#include <cmath>

#include "idl/common/stamp.h"
#include "idl/common/text.h"
#include "ros2_service_msgs.h"
#include "server/dds/ros_service_messages.h"
#include "tests/support/hosted_service.h"
#include "tests/support/ros_caller.h"

namespace {

namespace srv = simulation_interfaces::srv;
using takt::HostOptions;
using takt::test::Caller;
using takt::test::HostedService;
using takt::test::RawDdsClient;
using takt::test::test_cell;
using takt::test::test_domain;

#define CALLER(Type, name) Caller<srv::Type##_Request, srv::Type##_Response> name

TEST(RosServices, AStockNodeRunsTheCell) {
  HostedService service(false);
  // The callers outlive the participant that calls them.
  std::unique_ptr<CALLER(GetSimulatorFeatures, )> features;
  std::unique_ptr<CALLER(GetSimulationState, )> get_state;
  std::unique_ptr<CALLER(SetSimulationState, )> set_state;
  std::unique_ptr<CALLER(StepSimulation, )> step;
  std::unique_ptr<CALLER(ResetSimulation, )> reset;
  std::unique_ptr<CALLER(LoadWorld, )> load;
  std::unique_ptr<CALLER(UnloadWorld, )> unload;
  RawDdsClient dds(test_domain());
  const auto make = [&](auto& caller, const char* name) {
    caller = std::make_unique<std::remove_reference_t<decltype(*caller)>>(dds, name);
  };
  make(features, "get_simulator_features");
  make(get_state, "get_simulation_state");
  make(set_state, "set_simulation_state");
  make(step, "step_simulation");
  make(reset, "reset_simulation");
  make(load, "load_world");
  make(unload, "unload_world");

  const auto known = features->call({}).features;
  EXPECT_NE(std::find(known.features.begin(), known.features.end(), 32), known.features.end());
  EXPECT_NE(known.custom_info.find("set_level_of_detail"), std::string::npos);

  EXPECT_EQ(get_state->call({}).state.state, 4);  // no world
  srv::StepSimulation_Request steps;
  steps.steps = 100;
  EXPECT_EQ(step->call(steps).result.result, 3);
  srv::LoadWorld_Request world;
  EXPECT_EQ(load->call(world).result.result, 102);
  world.world_resource.uri = "/nowhere.yaml";
  const auto refused = load->call(world);
  EXPECT_NE(refused.result.result, 1);
  EXPECT_NE(refused.result.error_message.find("/nowhere.yaml"), std::string::npos);
  world.world_resource.uri = service.two_robots().string();
  const auto loaded = load->call(world);
  ASSERT_EQ(loaded.result.result, 1) << loaded.result.error_message;
  EXPECT_EQ(loaded.world.name, "service_test");
  EXPECT_EQ(get_state->call({}).state.state, 0);

  srv::SetSimulationState_Request pause;
  pause.state.state = 2;
  EXPECT_EQ(set_state->call(pause).result.result, 1);
  EXPECT_EQ(step->call(steps).result.result, 1);
  steps.steps = 0;
  EXPECT_EQ(step->call(steps).result.result, 4);
  srv::ResetSimulation_Request scope;
  scope.scope = 255;
  EXPECT_EQ(reset->call(scope).result.result, 1);
  EXPECT_EQ(unload->call({}).result.result, 1);
  EXPECT_EQ(unload->call({}).result.result, 101);
}

TEST(RosServices, EntitiesAreListedMovedMadeAndDeleted) {
  HostedService service;
  std::unique_ptr<CALLER(GetEntities, )> list;
  std::unique_ptr<CALLER(GetEntitiesStates, )> all;
  std::unique_ptr<CALLER(GetEntityInfo, )> info;
  std::unique_ptr<CALLER(GetEntityBounds, )> bounds;
  std::unique_ptr<CALLER(GetEntityState, )> get;
  std::unique_ptr<CALLER(SetEntityState, )> set;
  std::unique_ptr<CALLER(SpawnEntity, )> spawn;
  std::unique_ptr<CALLER(SpawnEntities, )> spawn_several;
  std::unique_ptr<CALLER(DeleteEntity, )> remove;
  std::unique_ptr<Caller<takt_msgs::srv::Control_Request, takt_msgs::srv::Control_Response>> control;
  RawDdsClient dds(test_domain());
  const auto make = [&](auto& caller, const char* name) {
    caller = std::make_unique<std::remove_reference_t<decltype(*caller)>>(dds, name);
  };
  make(list, "get_entities");
  make(all, "get_entities_states");
  make(info, "get_entity_info");
  make(bounds, "get_entity_bounds");
  make(get, "get_entity_state");
  make(set, "set_entity_state");
  make(spawn, "spawn_entity");
  make(spawn_several, "spawn_entities");
  make(remove, "delete_entity");
  make(control, "control");

  const auto names = [&](const std::string& filter, std::vector<std::uint8_t> categories = {}) {
    srv::GetEntities_Request request;
    request.filters.filter = filter;
    for (const std::uint8_t category : categories) {
      simulation_interfaces::msg::EntityCategory wanted;
      wanted.category = category;
      request.filters.categories.push_back(wanted);
    }
    const auto response = list->call(request);
    return std::pair(response.result.result, response.entities);
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(names("^[PC]$").second, (Names{"P", "C"}));
  EXPECT_EQ(names("", {0}).second, (Names{"P", "C"}));
  EXPECT_EQ(names("^Gripper1$", {1}).second, (Names{"Gripper1"}));
  EXPECT_EQ(names("nothing like it"), std::pair(std::uint8_t{1}, Names{}));
  EXPECT_EQ(names("(").first, 4);
  EXPECT_EQ(names("(a{1,30000}){1,30000}").first, 0);

  srv::GetEntitiesStates_Request parts;
  parts.filters.filter = "^[PC]$";
  const auto states = all->call(parts);
  EXPECT_EQ(states.result.result, 1);
  EXPECT_EQ(states.entities, (Names{"P", "C"}));
  ASSERT_EQ(states.states.size(), 2U);
  parts.filters.filter = "(";
  EXPECT_EQ(all->call(parts).result.result, 4);
  const auto known = info->call({"C"});
  EXPECT_EQ(known.result.result, 1);
  EXPECT_EQ(known.info.category.category, 0);
  EXPECT_EQ(known.info.description, "part of 0.5 kg, hierarchy 3");
  EXPECT_EQ(info->call({"nobody"}).result.result, 2);
  const auto box = bounds->call({"P"});
  ASSERT_EQ(box.result.result, 1);
  EXPECT_EQ(box.bounds.type, 1);
  ASSERT_EQ(box.bounds.points.size(), 2U);
  EXPECT_GT(box.bounds.points[0].x, box.bounds.points[1].x);
  EXPECT_EQ(bounds->call({"nobody"}).result.result, 2);

  srv::GetEntityState_Request which;
  which.entity = "C";
  const auto before = get->call(which);
  ASSERT_EQ(before.result.result, 1);
  EXPECT_EQ(before.state.header.frame_id, "world");
  EXPECT_EQ(before.state, states.states[1]);
  srv::SetEntityState_Request there;
  there.entity = "C";
  there.state = before.state;
  there.set_pose = true;
  there.state.pose.position.x = 0.31;
  ASSERT_EQ(set->call(there).result.result, 1);
  const auto after = get->call(which);
  EXPECT_EQ(after.state.pose.position.x, 0.31);
  EXPECT_NEAR(after.state.pose.orientation.w, before.state.pose.orientation.w, 1e-15);
  there.set_acceleration = true;
  const auto no_acceleration = set->call(there);
  EXPECT_EQ(no_acceleration.result.result, 0);
  EXPECT_NE(no_acceleration.result.error_message.find("set_acceleration"), std::string::npos);
  there.set_acceleration = false;
  which.entity = "C\xFF\n";
  const auto no_text = get->call(which);
  EXPECT_EQ(no_text.result.result, 4);
  EXPECT_NE(no_text.result.error_message.find("is no text: 'C?"), std::string::npos);
  there.state.header.frame_id = "base\xFF";
  EXPECT_NE(set->call(there).result.error_message.find("'base?'"), std::string::npos);
  there.state.header.frame_id = "base";
  EXPECT_EQ(set->call(there).result.result, 0);
  which.entity = "nobody";
  EXPECT_EQ(get->call(which).result.result, 2);

  takt_msgs::srv::Control_Request any;
  any.request = "set_state";
  any.arguments = takt::arguments_of(takt::requests::SetState{.state = takt::SimulationState::stopped});
  ASSERT_EQ(control->call(any).result, 1);
  srv::SpawnEntity_Request copy;
  copy.allow_renaming = true;
  copy.entity_resource.uri = "copy_of:C?mass=0.25";
  copy.initial_pose.pose.position.x = 0.3;
  copy.initial_pose.pose.position.z = 0.9;
  const auto spawned = spawn->call(copy);
  ASSERT_EQ(spawned.result.result, 1) << spawned.result.error_message;
  EXPECT_EQ(spawned.entity_name, "C_2");
  copy.entity_resource.uri = "copy_of:C?mass";
  EXPECT_EQ(spawn->call(copy).result.result, 106);
  srv::SpawnEntities_Request several;
  several.spawn_requests.resize(3);
  for (auto& one : several.spawn_requests) {
    one.allow_renaming = true;
    one.entity_resource.uri = "copy_of:C";
    one.initial_pose.pose.position.z = 1.5;
  }
  several.spawn_requests[1].entity_resource.uri.clear();
  several.spawn_requests[2].initial_pose.pose.position.z = 2.5;
  const auto some = spawn_several->call(several);
  EXPECT_EQ(some.result.result, 150);
  ASSERT_EQ(some.results.size(), 3U);
  EXPECT_EQ(some.results[0].result.result, 1) << some.results[0].result.error_message;
  EXPECT_EQ(some.results[0].entity_name, "C_3");
  EXPECT_EQ(some.results[1].result.result, 104);
  EXPECT_EQ(some.results[2].entity_name, "C_4");
  several.spawn_requests.resize(1);
  EXPECT_EQ(spawn_several->call(several).result.result, 1);
  several.spawn_requests.resize(101);
  EXPECT_EQ(spawn_several->call(several).result.result, 4);
  any.request = "get_state";
  any.arguments = {};
  const auto state = control->call(any);
  EXPECT_EQ(state.result, 1);
  EXPECT_FALSE(state.values.empty());
  srv::DeleteEntity_Request gone;
  gone.entity = "C_2";
  EXPECT_EQ(remove->call(gone).result.result, 1);
  EXPECT_EQ(remove->call(gone).result.result, 2);
}

TEST(RosServices, WorldsNamedPosesAndSpawnablesAreListed) {
  HostOptions options = HostedService::paused();
  const takt::test::TemporaryDirectory cells;
  options.scenarios = cells.path();
  const std::string scenario = takt::test::service_scenario_text();
  cells.write("poses.yaml", scenario +
                                "description: a cell with poses\ntags: [test, poses]\n"
                                "named_poses:\n"
                                "  Drop: {description: above the table, tags: [spawn], "
                                "pose: {position_m: [0.1, 0.2, 1.5], rpy_deg: [0, 0, 90]}, "
                                "bounds_m: {lower: [-0.1, -0.1, -0.1], upper: [0.1, 0.1, 0.2]}}\n"
                                "  Corner: {pose: {position_m: [1, 1, 0]}}\n");
  cells.write("plain.yaml", scenario);
  cells.write("broken.yaml", "takt_scenario: 1\n");
  HostedService service(false, std::move(options));
  std::unique_ptr<CALLER(GetAvailableWorlds, )> worlds;
  std::unique_ptr<CALLER(GetCurrentWorld, )> current;
  std::unique_ptr<CALLER(LoadWorld, )> load;
  std::unique_ptr<CALLER(GetNamedPoses, )> poses;
  std::unique_ptr<CALLER(GetNamedPoseBounds, )> bounds;
  std::unique_ptr<CALLER(GetSpawnables, )> spawnables;
  std::unique_ptr<CALLER(SpawnEntity, )> spawn;
  std::unique_ptr<CALLER(SetEntityInfo, )> set_info;
  std::unique_ptr<CALLER(GetEntityInfo, )> info;
  std::unique_ptr<CALLER(GetEntities, )> list;
  std::unique_ptr<CALLER(GetEntitiesStates, )> states;
  std::unique_ptr<CALLER(DeleteEntity, )> remove;
  RawDdsClient dds(test_domain());
  const auto make = [&](auto& caller, const char* name) {
    caller = std::make_unique<std::remove_reference_t<decltype(*caller)>>(dds, name);
  };
  make(worlds, "get_available_worlds");
  make(current, "get_current_world");
  make(load, "load_world");
  make(poses, "get_named_poses");
  make(bounds, "get_named_pose_bounds");
  make(spawnables, "get_spawnables");
  make(spawn, "spawn_entity");
  make(set_info, "set_entity_info");
  make(info, "get_entity_info");
  make(list, "get_entities");
  make(states, "get_entities_states");
  make(remove, "delete_entity");

  EXPECT_EQ(current->call({}).result.result, 101);
  EXPECT_EQ(poses->call({}).result.result, 3);
  EXPECT_EQ(spawnables->call({}).result.result, 3);
  srv::GetAvailableWorlds_Request search;
  const auto all = worlds->call(search);
  ASSERT_EQ(all.result.result, 1) << all.result.error_message;
  EXPECT_NE(all.result.error_message.find("1 file cannot be read"), std::string::npos)
      << all.result.error_message;
  ASSERT_EQ(all.worlds.size(), 2U);
  search.filter.tags = {"poses", "other"};
  const auto tagged = worlds->call(search);
  ASSERT_EQ(tagged.worlds.size(), 1U);
  const auto& world = tagged.worlds[0];
  EXPECT_EQ(world.name, "service_test");
  EXPECT_EQ(world.description, "a cell with poses");
  EXPECT_EQ(world.tags, (std::vector<std::string>{"test", "poses"}));
  search.filter.filter_mode = 1;
  EXPECT_TRUE(worlds->call(search).worlds.empty());
  search.additional_sources = {"no_such_folder"};
  EXPECT_EQ(worlds->call(search).result.result, 2);
  search.filter.tags.clear();
  search.continue_on_error = true;
  EXPECT_EQ(worlds->call(search).worlds.size(), 2U);

  srv::LoadWorld_Request wanted;
  wanted.world_resource = world.world_resource;
  const auto loaded = load->call(wanted);
  ASSERT_EQ(loaded.result.result, 1) << loaded.result.error_message;
  EXPECT_EQ(loaded.world, world);
  EXPECT_EQ(current->call({}).world, world);

  const auto named = poses->call({});
  ASSERT_EQ(named.poses.size(), 2U);
  EXPECT_EQ(named.poses[0].name, "Drop");
  EXPECT_EQ(named.poses[0].description, "above the table");
  EXPECT_EQ(named.poses[0].pose.position.z, 1.5);
  EXPECT_NEAR(named.poses[0].pose.orientation.z, std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(named.poses[0].pose.orientation.w, std::sqrt(0.5), 1e-15);
  srv::GetNamedPoses_Request to_spawn;
  to_spawn.tags.tags = {"spawn"};
  EXPECT_EQ(poses->call(to_spawn).poses.size(), 1U);
  EXPECT_EQ(bounds->call({"Drop"}).bounds.points,
            (std::vector<geometry_msgs::msg::Vector3>{{0.1, 0.1, 0.2}, {-0.1, -0.1, -0.1}}));
  EXPECT_EQ(bounds->call({"Corner"}).bounds.type, 0);
  EXPECT_EQ(bounds->call({"Roof"}).result.result, 2);

  // What is listed can be spawned, at a named pose.
  const auto spawnable = spawnables->call({});
  ASSERT_EQ(spawnable.spawnables.size(), 2U);
  EXPECT_EQ(spawnable.spawnables[1].entity_resource.uri, "copy_of:C");
  EXPECT_EQ(spawnable.spawnables[1].description, "another C, 0.5 kg, hierarchy 3");
  EXPECT_EQ(spawnable.spawnables[1].spawn_bounds.type, 1);
  srv::SpawnEntity_Request at_drop;
  at_drop.allow_renaming = true;
  at_drop.entity_resource = spawnable.spawnables[1].entity_resource;
  at_drop.initial_pose.pose = named.poses[0].pose;
  EXPECT_EQ(spawn->call(at_drop).entity_name, "C_2");
  EXPECT_EQ(spawnables->call({}).spawnables.size(), 3U);
  EXPECT_NE(spawnables->call({{"/somewhere"}}).result.error_message.find("/somewhere"), std::string::npos);
  EXPECT_EQ(spawnables->call({{"/somewhere"}}).result.result, 1);

  srv::SetEntityInfo_Request person{"C_2", {{2}, "a worker", {"person", "moves"}}};
  ASSERT_EQ(set_info->call(person).result.result, 1);
  EXPECT_EQ(info->call({"C_2"}).info, person.info);
  srv::GetEntities_Request people;
  people.filters.categories = {{2}};
  people.filters.tags.tags = {"moves"};
  EXPECT_EQ(list->call(people).entities, std::vector<std::string>{"C_2"});
  EXPECT_EQ(states->call({people.filters}).entities, std::vector<std::string>{"C_2"});
  person.entity = "nobody";
  EXPECT_EQ(set_info->call(person).result.result, 2);
  person = {"C_2", {{3}, "", {}}};
  EXPECT_EQ(set_info->call(person).result.result, 4);
  // Another Part of the same name is another entity.
  ASSERT_EQ(remove->call({"C_2"}).result.result, 1);
  EXPECT_EQ(spawn->call(at_drop).entity_name, "C_2");
  EXPECT_EQ(info->call({"C_2"}).info.category.category, 0);
}

/// A node looks up frames and clock by this stamp: a nanosecond less is another instant.
TEST(RosServices, StampsEqualTheClock) {
  for (int step = 0; step <= 20'000; ++step) {
    const double time_s = step * 0.001;
    const takt::ControlReply reply{
        1, takt::ControlResult::ok, "",
        takt::arguments_of(takt::requests::GetEntityStateResponse{.time = time_s})};
    srv::GetEntityState_Response response;
    takt::ros::respond(reply, "", response);
    ASSERT_EQ(response.state.header.stamp, takt::to_time(time_s)) << step;
    ASSERT_EQ(response.state.header.stamp.nanosec % 1'000'000, 0U) << step;
  }
}

TEST(RosServices, TwoCallersGetTheirOwnReplies) {
  HostedService service;
  std::unique_ptr<CALLER(GetEntityState, )> one, other;
  RawDdsClient first(test_domain()), second(test_domain());
  one = std::make_unique<CALLER(GetEntityState, )>(first, "get_entity_state");
  other = std::make_unique<CALLER(GetEntityState, )>(second, "get_entity_state");
  srv::GetEntityState_Request p, c;
  p.entity = "P", c.entity = "C";
  // Both count their requests from the same number on.
  std::vector<std::int64_t> to_one, to_other;
  for (int i = 0; i < 5; ++i) {
    to_one.push_back(one->send(p));
    to_other.push_back(other->send(c));
  }
  const double x_of_p = one->await(to_one[0]).state.pose.position.x;
  const double x_of_c = other->await(to_other[0]).state.pose.position.x;
  EXPECT_NE(x_of_p, x_of_c);
  for (std::size_t i = 0; i < to_one.size(); ++i) {
    EXPECT_EQ(one->await(to_one[i]).state.pose.position.x, x_of_p);
    EXPECT_EQ(other->await(to_other[i]).state.pose.position.x, x_of_c);
  }
}

}  // namespace
