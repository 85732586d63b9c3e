// The takt requests of simulation_interfaces requests, and the early refusals: result and sentence of each.
// And replies that lack fields of the response.
#include <gtest/gtest.h>

#include "server/dds/ros_service_messages.h"

namespace takt::ros {
namespace {

void expect_no(const Question& question, ControlResult result, const std::string& words) {
  const auto* refused = std::get_if<Refusal>(&question);
  ASSERT_NE(refused, nullptr) << "it was asked, though " << words;
  EXPECT_EQ(refused->result, result) << refused->message;
  EXPECT_NE(refused->message.find(words), std::string::npos) << refused->message;
}

std::string argument_of(const Question& question, const std::string& name) {
  const auto* asked = std::get_if<Asked>(&question);
  if (asked == nullptr) return std::get<Refusal>(question).message;
  for (const auto& [key, value] : asked->request.arguments)
    if (key == name) return text_of(value);
  return "no " + name;
}

TEST(RosQuestions, RequestsAboutWorldsNeedAFile) {
  srv::LoadWorld_Request load;
  expect_no(ask(load), ControlResult::uri_missing, "The uri of a scenario file is missing.");
  load.world_resource.resource_string = "takt_scenario: 1";
  expect_no(ask(load), ControlResult::unsupported, "cannot be passed as text here");
  for (const char* good : {"cell.yaml", "file:///cells/cell.YML"}) {
    load.world_resource.uri = good;
    EXPECT_EQ(argument_of(ask(load), "uri"), good);
  }
  load.world_resource.uri = "factory.sdf";
  expect_no(ask(load), ControlResult::unsupported_world_format, "is no scenario file; allowed is NAME.yaml");
}

TEST(RosQuestions, UnsupportedFiltersForEntitiesAreRefused) {
  const auto with = [](const std::string& filter) {
    srv::GetEntities_Request request;
    request.filters.filter = filter;
    return ask(request);
  };
  srv::GetEntities_Request tagged;
  tagged.filters.tags.filter_mode = 2;
  expect_no(ask(tagged), ControlResult::failed, "filter_mode of tags is 2; allowed are 0");
  srv::GetNamedPoses_Request poses;
  poses.tags.filter_mode = 2;
  expect_no(ask(poses), ControlResult::failed, "filter_mode of tags is 2; allowed are 0");
  srv::GetAvailableWorlds_Request worlds;
  worlds.filter.filter_mode = 2;
  expect_no(ask(worlds), ControlResult::failed, "filter_mode of tags is 2; allowed are 0");
  srv::GetEntities_Request bounded;
  bounded.filters.bounds.points.resize(2);
  expect_no(ask(bounded), ControlResult::unsupported, "There is no filter by bounds here");
  for (const std::string& wrong : {std::string(201, 'a'), std::string("a{3}"), std::string("a\nb")})
    expect_no(with(wrong), ControlResult::unsupported, "at most 200 characters, without repetition counts");
  expect_no(with("(a"), ControlResult::failed, "The filter '(a' is no POSIX extended regular expression.");
  EXPECT_TRUE(std::holds_alternative<Asked>(with(std::string(200, 'a'))));
}

TEST(RosQuestions, OnlySettableFieldsAreSet) {
  srv::SetEntityState_Request request;
  request.entity = "P";
  request.state.header.frame_id = "map";
  expect_no(ask(request), ControlResult::unsupported, "The frame 'map' is not known here");
  request.state.header.frame_id = "world";
  request.set_acceleration = true;
  expect_no(ask(request), ControlResult::unsupported, "An acceleration cannot be set");
  request.set_acceleration = false;
  EXPECT_EQ(argument_of(ask(request), "position"), "no position");
  request.set_pose = true;
  request.state.pose.position.x = 1.5;
  EXPECT_EQ(argument_of(ask(request), "position"), "1.5 0 0");
  EXPECT_EQ(argument_of(ask(request), "linear_velocity"), "no linear_velocity");
  const auto orientation = [&](double x, double y, double z, double w) {
    auto& q = request.state.pose.orientation;
    q = {x, y, z, w};
    return argument_of(ask(request), "orientation");
  };
  EXPECT_EQ(orientation(0, 0, 0, 0), "0 0 0 1") << "a message that says nothing of it";
  EXPECT_EQ(orientation(1, 0, 0, 0), "1 0 0 0");
  EXPECT_EQ(orientation(0, 1, 0, 0), "0 1 0 0");
  EXPECT_EQ(orientation(0, 0, 1, 0), "0 0 1 0");
  EXPECT_EQ(orientation(0, 0, 0, 2), "0 0 0 2");
  request.set_twist = true;
  request.state.twist.angular.z = 0.5;
  EXPECT_EQ(argument_of(ask(request), "angular_velocity"), "0 0 0.5");
}

TEST(RosQuestions, FilesAndCopiesAreSpawned) {
  srv::SpawnEntity_Request request;
  const auto with = [&](const std::string& uri) {
    request.entity_resource.uri = uri;
    return ask(request);
  };
  expect_no(with(""), ControlResult::no_resource, "The uri is missing: a mesh file, or copy_of:NAME");
  request.entity_namespace = "line1";
  expect_no(with("a.obj"), ControlResult::unsupported, "Parts have no topics of their own");
  request.entity_namespace = "";
  request.initial_pose.header.frame_id = "map";
  expect_no(with("a.obj"), ControlResult::unsupported, "The frame 'map' is not known here");
  request.initial_pose.header.frame_id = "";
  for (const char* wrong : {"arm.urdf", "a", "a.sdf#b", "b.obj.gz?mass=1"})
    expect_no(with(wrong), ControlResult::unsupported_spawn_format, "its extension is one of obj, stl, glb");
  EXPECT_EQ(argument_of(with("cell.glb#Frame/Housing"), "uri"), "cell.glb#Frame/Housing");
  for (const char* wrong : {"a.obj?mass_kg", "a.obj?=3", "a.obj?a=1&&b=2"})
    expect_no(with(wrong), ControlResult::spawn_parse_error, "stand NAME=VALUE, separated by &.");
  const Question bolt = with("bolts/m6.obj?mass=0.02&hierarchy=3");
  EXPECT_EQ(argument_of(bolt, "uri"), "bolts/m6.obj");
  EXPECT_EQ(argument_of(bolt, "mass"), "0.02");
  EXPECT_EQ(argument_of(bolt, "hierarchy"), "3");
  EXPECT_EQ(argument_of(bolt, "name"), "");
  EXPECT_EQ(argument_of(bolt, "allow_renaming"), "false");
  EXPECT_EQ(argument_of(with("a.obj?"), "uri"), "a.obj");
  EXPECT_EQ(argument_of(with("copy_of:P"), "name"), "");
  // An unnamed object gets a name if that is allowed.
  request.allow_renaming = true;
  EXPECT_EQ(argument_of(with("bolts/m6.obj?mass=0.02"), "name"), "m6");
  EXPECT_EQ(argument_of(with("copy_of:P"), "name"), "P");
  EXPECT_EQ(argument_of(with("copy_of:P"), "copy_of"), "P");
  request.name = "Q";
  EXPECT_EQ(argument_of(with("copy_of:P"), "name"), "Q");
  EXPECT_EQ(argument_of(with("m6.obj"), "name"), "Q");
}

TEST(RosAnswers, AnswersOfFailuresHaveNoOtherFields) {
  const ControlReply failed{1, ControlResult::failed, "It could not be."};
  srv::GetEntities_Response entities;
  respond(failed, "\n", entities);
  EXPECT_EQ(entities.result.error_message, "It could not be.");
  EXPECT_TRUE(entities.entities.empty());
  srv::GetEntityState_Response state;
  respond(failed, "", state);
  EXPECT_EQ(state.result.result, 4);
  EXPECT_EQ(state.state.header.frame_id, "");
  srv::GetSimulationState_Response simulation;
  respond(failed, "", simulation);
  EXPECT_EQ(simulation.state.state, 0);
}

srv::GetEntities_Request filtered(const std::string& expression,
                                  const std::vector<std::uint8_t>& categories = {},
                                  const std::vector<std::string>& tags = {}, bool all_tags = false) {
  srv::GetEntities_Request request;
  request.filters.filter = expression;
  for (const std::uint8_t category : categories) request.filters.categories.push_back({category});
  request.filters.tags = {tags, std::uint8_t{all_tags}};
  return request;
}

TEST(RosAnswers, EntitiesAreListedByExpressionCategoryAndTags) {
  requests::GetEntitiesResponse listed;
  listed.entities = {{.name = "P1", .category = EntityCategory::object, .tags = {"red", "small"}},
                     {.name = "G", .category = EntityCategory::robot, .tags = {"red"}},
                     {.name = "T", .category = EntityCategory::static_object}};
  ControlReply reply{1, ControlResult::ok, "", arguments_of(listed)};
  const auto names = [&](const srv::GetEntities_Request& request) {
    srv::GetEntities_Response response;
    respond(reply, std::get<Asked>(ask(request)).note, response);
    return response.entities;
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(names(filtered("")), (Names{"P1", "G", "T"}));
  EXPECT_EQ(names(filtered("^P")), Names{"P1"});
  EXPECT_EQ(names(filtered("", {0})), Names{"P1"});
  EXPECT_EQ(names(filtered("", {1})), Names{"G"});
  EXPECT_EQ(names(filtered("T|G", {1, 5})), (Names{"G", "T"}));
  EXPECT_EQ(names(filtered("", {}, {"small", "red"})), (Names{"P1", "G"}));
  EXPECT_EQ(names(filtered("", {}, {"small", "red"}, true)), Names{"P1"});
  EXPECT_EQ(names(filtered("", {1}, {"small"})), Names{});
  srv::GetEntities_Response nothing;
  reply.values[0].value.text = "[{";
  respond(reply, "", nothing);
  EXPECT_TRUE(nothing.entities.empty());
}

TEST(RosAnswers, SpawnablesCanBeSpawnedAsTheyAreListed) {
  requests::GetSpawnablesResponse listed;
  listed.spawnables = {
      {.copy_of = "P", .description = "another P", .lower = {{-1, -2, -3}}, .upper = {{1, 2, 3}}},
      {.uri = "/meshes/bolt.obj"}};
  srv::GetSpawnables_Response response;
  respond({1, ControlResult::ok, "", arguments_of(listed)}, "", response);
  ASSERT_EQ(response.spawnables.size(), 2U);
  srv::SpawnEntity_Request spawn;
  spawn.entity_resource = response.spawnables[0].entity_resource;
  EXPECT_EQ(argument_of(ask(spawn), "copy_of"), "P");
  const auto& bounds = response.spawnables[0].spawn_bounds;
  EXPECT_EQ(bounds.type, 1);
  EXPECT_EQ(bounds.points, (std::vector<geometry_msgs::msg::Vector3>{{1, 2, 3}, {-1, -2, -3}}));
  spawn.entity_resource = response.spawnables[1].entity_resource;
  EXPECT_EQ(argument_of(ask(spawn), "uri"), "/meshes/bolt.obj");
  EXPECT_EQ(argument_of(ask(spawn), "mass"), "1");
  EXPECT_EQ(response.spawnables[1].spawn_bounds.type, 0);
}

TEST(RosAnswers, ANamedPoseHasABoxOrIsUnbounded) {
  requests::GetNamedPosesResponse listed;
  listed.poses = {{.name = "Drop", .tags = {"spawn"}, .position = {1, 2, 3}, .orientation = {0, 0, 1, 0}},
                  {.name = "Shelf", .lower = {{-1, -1, 0}}, .upper = {{1, 1, 2}}}};
  const ControlReply reply{1, ControlResult::ok, "", arguments_of(listed)};
  srv::GetNamedPoses_Request wanted;
  wanted.tags.tags = {"spawn"};
  srv::GetNamedPoses_Response poses;
  respond(reply, std::get<Asked>(ask(wanted)).note, poses);
  ASSERT_EQ(poses.poses.size(), 1U);
  EXPECT_EQ(poses.poses[0].pose.position, (geometry_msgs::msg::Point{1, 2, 3}));
  EXPECT_EQ(poses.poses[0].pose.orientation, (geometry_msgs::msg::Quaternion{0, 0, 1, 0}));
  const auto bounds_of = [&](const std::string& name) {
    srv::GetNamedPoseBounds_Response response;
    respond(reply, name, response);
    return response;
  };
  EXPECT_EQ(bounds_of("Drop").bounds.type, 0);
  EXPECT_EQ(bounds_of("Shelf").bounds.type, 1);
  EXPECT_EQ(bounds_of("Shelf").bounds.points,
            (std::vector<geometry_msgs::msg::Vector3>{{1, 1, 2}, {-1, -1, 0}}));
  EXPECT_EQ(bounds_of("Roof").result.result, 2);
  EXPECT_EQ(bounds_of("Roof").result.error_message, "There is no named pose 'Roof'; there are Drop, Shelf.");
}

}  // namespace
}  // namespace takt::ros
