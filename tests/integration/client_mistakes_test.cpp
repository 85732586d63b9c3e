// Arguments that takt::Client refuses without sending, and its settings from the environment: each sentence
// has the value given and the values allowed. And the rarer arguments of its requests.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>

#include "client_lib/client.h"
#include "tests/support/hosted_service.h"
#include "tests/support/hosting_client.h"

namespace takt::test {
namespace {

using Kind = ClientError::Kind;

void expect_refused(Kind kind, std::initializer_list<const char*> words,
                    const std::function<void()>& action) {
  try {
    action();
    ADD_FAILURE() << "it was done, though " << *words.begin();
  } catch (const ClientError& error) {
    EXPECT_EQ(error.kind(), kind) << error.what();
    expect_words(error.what(), words);
  }
}

/// An environment variable for the time of a test; without a value it is not there.
class Environment {
 public:
  explicit Environment(const char* name) : name_(name) {
    if (const char* value = std::getenv(name)) before_ = value;
  }
  ~Environment() { set(before_ ? before_->c_str() : nullptr); }
  void set(const char* value) const {
    if (value != nullptr)
      ::setenv(name_, value, 1);
    else
      ::unsetenv(name_);
  }

 private:
  const char* name_;
  std::optional<std::string> before_;
};

TEST(ClientMistakes, InvalidEnvironmentVariablesAreReported) {
  const Environment domain("TAKT_DOMAIN"), cell("TAKT_CELL"), secure("TAKT_SECURE");
  for (const char* wrong : {"x", "1x", "-1", "233"}) {
    domain.set(wrong);
    expect_refused(Kind::invalid, {"TAKT_DOMAIN is '", wrong, "allowed is a number from 0 to 232"},
                   [] { static_cast<void>(ClientOptions::default_domain()); });
  }
  domain.set("232");
  EXPECT_EQ(ClientOptions::default_domain(), 232);
  for (const char* none : {static_cast<const char*>(nullptr), ""}) {
    domain.set(none);
    EXPECT_EQ(ClientOptions::default_domain(), 0);
    cell.set(none);
    EXPECT_EQ(ClientOptions::default_cell(), "cell");
  }
  cell.set("hall");
  EXPECT_EQ(ClientOptions::default_cell(), "hall");
  secure.set("keys");
  EXPECT_EQ(ClientOptions::default_secure_directory(), "keys");
  secure.set(nullptr);
  EXPECT_EQ(ClientOptions::default_secure_directory(), "");
  ClientOptions options = client_options();
  options.cell.clear();
  expect_refused(Kind::invalid, {"The name of the cell is empty."}, [&] { const Client client(options); });
}

TEST(ClientMistakes, StatesHaveNames) {
  EXPECT_EQ(to_string(ComponentType::part), "part");
  EXPECT_EQ(to_string(PartState::free), "free");
  EXPECT_EQ(to_string(PartState::grasped), "grasped");
  EXPECT_EQ(to_string(PartState::placed), "placed");
  EXPECT_EQ(to_string(PartState::assembled), "assembled");
  EXPECT_EQ(to_string(SimulationState::stopped), "stopped");
  EXPECT_EQ(to_string(SimulationState::quitting), "quitting");
  EXPECT_EQ(to_string(SimulationState::no_scenario), "no_scenario");
  EXPECT_EQ(to_string(SimulationState::loading_scenario), "loading_scenario");
  EXPECT_EQ(to_string(Severity::information), "information");
  EXPECT_EQ(to_string(Severity::warning), "warning");
  EXPECT_EQ(to_string(Severity::error), "error");
}

TEST(ClientMistakes, InvalidNamesAndNumbersAreReported) {
  HostedService service;
  Client cell(client_options());
  const State state = cell.state();
  expect_refused(Kind::not_found, {"no component 'X'", "P, C"},
                 [&] { static_cast<void>(state.component("X")); });
  expect_refused(Kind::not_found, {"no robot 'X'", "Robot1, Robot2"},
                 [&] { static_cast<void>(state.robot("X")); });
  expect_refused(Kind::not_found, {"no gripper 'X'", "Gripper1, Gripper2"},
                 [&] { static_cast<void>(state.gripper("X")); });
  EXPECT_EQ(&state.gripper("Gripper2"), &state.grippers.at(1));
  expect_refused(Kind::not_found, {"no device 'Oven'", "it has none"}, [&] {
    cell.set_signals("Oven", {{"lamp", 1.0}});
  });
  expect_refused(Kind::not_found, {"no gripper 'X'", "Gripper1, Gripper2"},
                 [&] { cell.set_gripper("X", GripperAction::close); });
  const std::vector<double> six(6, 0.0);
  expect_refused(Kind::not_found, {"no robot 'X'", "Robot1, Robot2"}, [&] { cell.send_trajectory("X", {}); });
  expect_refused(Kind::not_found, {"no robot 'X'", "Robot1, Robot2"},
                 [&] { cell.send_joint_command("X", six); });
  for (const double stamp : {-1.0, 3e9, std::nan("")})
    expect_refused(Kind::invalid, {"The stamp", "between 0 and 2147483647 s"},
                   [&] { cell.send_joint_command("Robot1", six, {}, stamp); });
  for (const double time : {-1.0, 3e9, std::nan("")})
    expect_refused(Kind::invalid, {"The time of point 1 for 'Robot1'", "between 0 and 2147483647 s"}, [&] {
      cell.send_trajectory("Robot1", {{time, six}});
    });
  expect_refused(Kind::invalid, {"has 6 joints", "point 2 for 'Robot1' has 2 positions"}, [&] {
    cell.send_trajectory("Robot1", {{1.0, six}, {2.0, {1.0, 2.0}}});
  });
  expect_refused(Kind::invalid, {"point 1 for 'Robot1' has 0 positions"}, [&] {
    cell.send_trajectory("Robot1", {{1.0, {}}});
  });
  expect_refused(Kind::invalid, {"A value of point 1 for 'Robot1'", "must be a finite number"}, [&] {
    cell.send_trajectory("Robot1", {{1.0, std::vector<double>(6, std::numeric_limits<double>::infinity())}});
  });
  expect_refused(Kind::invalid, {"finite"}, [&] { cell.set_pace(Pace::realtime, std::nan("")); });
  cell.load_scenario(service.one_arm().string());
  expect_refused(Kind::not_found, {"no gripper 'Gripper1'", "it has none"},
                 [&] { cell.set_gripper("Gripper1", GripperAction::close); });
  const State of_arm = cell.state();
  expect_refused(Kind::not_found, {"no gripper 'Gripper1'", "it has none."},
                 [&] { static_cast<void>(of_arm.gripper("Gripper1")); });
}

TEST(ClientMistakes, RareArgumentsArrive) {
  HostedService service;
  Client cell(client_options());
  cell.set_state(SimulationState::stopped);
  requests::SpawnEntity spawn;
  spawn.name = "Small";
  spawn.uri = std::string(TAKT_CONFIG_DIR) + "/meshes/C.obj";
  spawn.mesh_scale = 0.5;
  spawn.mass = 0.1;
  spawn.hierarchy = 4;
  spawn.position = {0.0, 0.0, 2.0};
  EXPECT_EQ(cell.spawn_entity(spawn).entity, "Small");
  const auto found = cell.get_entities("Small");
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].hierarchy, 4);
  EXPECT_EQ(found[0].mass, 0.1);
  cell.set_entity_state(
      {.entity = "Small",
       .orientation = takt_msgs::msg::Quaternion{0.0, 0.0, std::sqrt(0.5), std::sqrt(0.5)}});
  cell.set_entity_state({.entity = "Small", .linear_velocity = takt_msgs::msg::Vector3{0.5, 0.0, 0.0}});
  const auto state = cell.get_entity_state("Small");
  EXPECT_NEAR(state.orientation.z, std::sqrt(0.5), 1e-12);
  EXPECT_NEAR(state.linear_velocity.x, 0.5, 1e-12);
  EXPECT_NEAR(state.position.z, 2.0, 1e-12);
}

}  // namespace
}  // namespace takt::test
