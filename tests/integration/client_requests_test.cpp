// The typed requests of takt::Client: their samples, and no old state after a reply.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "client_lib/client.h"
#include "client_lib/lockstep_controller.h"
#include "tests/support/hosted_service.h"
#include "tests/support/hosting_client.h"
#include "tests/support/process_resources.h"
#include "tests/support/scripted_cell.h"

namespace {

using takt::Client;
using takt::ClientError;
using takt::ComponentType;
using takt::LockstepController;
using takt::PartState;
using takt::Seconds;
using takt::SimulationState;
using takt::State;
using takt::test::client_options;
using takt::test::expect_words;
using takt::test::HostedService;
using takt::test::ScriptedCell;

TEST(ClientRequests, TheStateIsNeverOlderThanTheReply) {
  HostedService service;
  Client client(client_options());
  for (std::uint64_t steps = 1; steps <= 30; ++steps) {
    const std::uint64_t before = client.state().step;
    client.step(steps);
    EXPECT_EQ(client.state().step, before + steps);
  }
  for (std::uint32_t epoch = 1; epoch <= 10; ++epoch) {
    client.reset();
    const State state = client.state();
    EXPECT_EQ(state.epoch, epoch);
    EXPECT_EQ(state.step, 0U);
    client.step(3);
    EXPECT_EQ(client.status().epoch, epoch);
  }
  client.play();
  EXPECT_EQ(client.status().state, SimulationState::playing);
  client.pause();
  EXPECT_EQ(client.status().state, SimulationState::paused);
  client.set_state(SimulationState::stopped);
  EXPECT_EQ(client.state().step, 0U);
}

TEST(ClientRequests, AnsweredRequestsTakeLittleMemory) {
  HostedService service;
  Client client(client_options());
  const auto ask = [&](int times) {
    for (int i = 0; i < times; ++i) (void)client.get_state();
  };
  ask(50);
  const double before = takt::test::process_resources().allocated_bytes;
  constexpr int kRequests = 500;
  ask(kRequests);
  const double more = takt::test::process_resources().allocated_bytes - before;
  EXPECT_LT(more / kRequests, 5000.0);  // of DDS, a reply takes 37 000
}

TEST(ClientRequests, ALoadReturnsTheNewDescription) {
  HostedService service;
  Client client(client_options());
  client.step(10);
  const auto arm = client.load_scenario(service.one_arm().string());
  EXPECT_EQ(arm->scenario, "one_arm");
  EXPECT_EQ(client.cell(), arm);
  EXPECT_EQ(client.state().cell, arm);
  EXPECT_EQ(client.state().step, 0U);
  takt::LoadOptions options;
  options.overrides = {"parts.Q.mass_kg=0.75", "solver.step_s=0.001"};
  options.level_of_detail = 1;
  const auto heavier = client.load_scenario(service.one_arm().string(), options);
  EXPECT_EQ(heavier->step_size, 0.001);
  EXPECT_EQ(heavier->components.at(static_cast<std::size_t>(heavier->find_component("Q"))).mass, 0.75);
  const auto again = client.reload_scenario();
  EXPECT_GT(again->scenario_generation, heavier->scenario_generation);
  EXPECT_EQ(again->step_size, 0.001);

  client.unload_scenario();
  EXPECT_EQ(client.cell()->scenario, "");
  EXPECT_EQ(client.get_state(), SimulationState::no_scenario);
  EXPECT_EQ(client.cell()->robots.size(), 0U);
  try {
    client.reload_scenario();
    FAIL() << "loaded again what was unloaded";
  } catch (const ClientError& error) {
    EXPECT_EQ(error.kind(), ClientError::Kind::refused);
    EXPECT_EQ(error.result(), takt::ControlResult::no_scenario_loaded);
  }
}

TEST(ClientRequests, PartsComeAndGo) {
  HostedService service;
  Client client(client_options());
  client.set_state(SimulationState::stopped);
  takt::requests::SpawnEntity spawn;
  spawn.name = "C";
  spawn.copy_of = "C";
  spawn.allow_renaming = true;
  spawn.mass = 0.25;
  spawn.position = {0.3, 0.2, 0.9};
  spawn.orientation = {0.0, 0.0, std::sqrt(0.5), std::sqrt(0.5)};
  EXPECT_EQ(client.spawn_entity(spawn).entity, "C_2");
  EXPECT_GE(client.cell()->find_component("C_2"), 0);

  const auto parts = client.get_entities("C*", ComponentType::part);
  ASSERT_EQ(parts.size(), 2U);
  EXPECT_EQ(parts[0].name, "C");
  EXPECT_EQ(parts[0].mass, 0.5);
  EXPECT_EQ(parts[1].name, "C_2");
  EXPECT_EQ(parts[1].mass, 0.25);
  EXPECT_EQ(parts[1].hierarchy, parts[0].hierarchy);
  EXPECT_EQ(client.get_entities().size(), client.cell()->components.size());
  for (const auto& gripper : client.get_entities({}, ComponentType::gripper))
    EXPECT_EQ(gripper.type, ComponentType::gripper);

  // In the air: it falls by g t^2 / 2.
  client.step(50);
  const auto fallen = client.get_entity_state("C_2");
  EXPECT_EQ(fallen.step, 50U);
  EXPECT_EQ(fallen.state, PartState::free);
  EXPECT_EQ(fallen.partner, std::nullopt);
  EXPECT_NEAR(fallen.position.z, 0.9 - 0.5 * 9.80665 * 0.05 * 0.05, 1e-6);
  EXPECT_NEAR(fallen.linear_velocity.z, -9.80665 * 0.05, 1e-9);
  EXPECT_NEAR(fallen.orientation.z, std::sqrt(0.5), 1e-12);
  const auto table = client.get_entity_state("Table1");
  EXPECT_EQ(table.type, ComponentType::ground);
  EXPECT_EQ(table.state, PartState::fixed);

  client.set_state(SimulationState::stopped);
  client.delete_entity("C_2");
  EXPECT_LT(client.cell()->find_component("C_2"), 0);
  try {
    client.delete_entity("C_2");
    FAIL() << "deleted twice";
  } catch (const ClientError& error) {
    EXPECT_EQ(error.result(), takt::ControlResult::not_found);
  }
}

TEST(ClientRequests, FeaturesNameTheRequests) {
  HostedService service;
  Client client(client_options());
  const auto features = client.call(takt::requests::GetFeatures{});
  for (const char* name : {"load_scenario", "get_entities", "step", "set_pace"})
    EXPECT_EQ(std::count(features.requests.begin(), features.requests.end(), name), 1) << name;
  EXPECT_EQ(features.paces, (std::vector<std::string>{"realtime", "free", "lockstep"}));
}

TEST(ClientRequests, ALockstepControllerCommandsEachBoundary) {
  HostedService service;
  Client client(client_options());
  const std::vector<double> start = client.state().robot("Robot1").position;
  {
    takt::LockstepOptions options;
    options.targets = {"Robot1", "Gripper1"};
    options.period_s = 0.004;
    LockstepController controller(client, options);
    EXPECT_EQ(controller.state().step, 0U);
    std::vector<double> target = start;
    for (std::uint64_t k = 1; k <= 50; ++k) {
      target[5] += 1e-4;
      controller.move("Robot1", target);
      if (k == 10) controller.grip("Gripper1", takt::GripperAction::close);
      const State& state = controller.advance();
      EXPECT_EQ(state.step, 4 * k);
      EXPECT_NEAR(state.robot("Robot1").position[5], target[5], 1e-12);
    }
    EXPECT_TRUE(controller.state().gripper("Gripper1").closed);
    EXPECT_THROW(controller.move("Robot2", start), ClientError);
    EXPECT_THROW(controller.move("Gripper1", start), ClientError);
    client.reset();
    try {
      controller.advance();
      FAIL() << "the reset was not noticed";
    } catch (const ClientError& error) {
      EXPECT_EQ(error.kind(), ClientError::Kind::lost);
    }
  }
  EXPECT_EQ(client.state().robot("Robot1").position, start);
}

class ClientVocabulary : public testing::Test {
 protected:
  static void SetUpTestSuite() { ScriptedCell::use_real_transports(); }

  void connect(const std::map<std::string, std::string>& reply) {
    server_ = std::make_unique<ScriptedCell>(
        name_, takt::test::small_description(name_),
        [this, reply](ScriptedCell& cell, const takt_msgs::msg::ControlRequest& request) {
          if (request.request == "get_state") return cell.reply(request, 1, "Paused.", {{"state", "paused"}});
          asked_ = request.request;
          for (const auto& argument : request.arguments)
            asked_ += " " + argument.name + "=" + takt::text_of(argument.value);
          cell.reply(request, 1, "Done.", reply);
        });
    takt::ClientOptions options = client_options();
    options.cell = name_;
    options.domain = static_cast<int>(takt::test::test_domain());
    client_ = std::make_unique<Client>(options);
  }
  State publish_and_see(std::uint32_t epoch, std::uint64_t step) {
    server_->wait_for_readers("state", 1);
    for (;;) {
      server_->publish("state", takt::test::small_state(epoch, step));
      const auto seen = client_->wait_for(
          takt::topics::state, [&](const State& s) { return s.epoch == epoch && s.step == step; },
          Seconds{0.2});
      if (seen) return *seen;
    }
  }

  std::string name_ = takt::test::unique_cell_name("vocabulary");
  std::string asked_;  ///< read after the reply to it has come
  std::unique_ptr<ScriptedCell> server_;
  std::unique_ptr<Client> client_;
};

TEST_F(ClientVocabulary, RequestsAboutPartsAndFilesHaveTheArgumentsOfTheServer) {
  connect({});
  client_->set_entity_state({.entity = "B",
                             .position = takt_msgs::msg::Vector3{0.1, -0.25, 1e-9},
                             .angular_velocity = takt_msgs::msg::Vector3{0.0, 0.0, 2.5}});
  EXPECT_EQ(asked_, "set_entity_state entity=B position=0.1 -0.25 1e-09 angular_velocity=0 0 2.5");
  client_->attach("B", "Table");
  EXPECT_EQ(asked_, "attach part=B to=Table");
  client_->detach("B");
  EXPECT_EQ(asked_, "detach part=B");
  client_->save_snapshot("before");
  EXPECT_EQ(asked_, "save_snapshot name=before");
  client_->restore_snapshot("before");
  EXPECT_EQ(asked_, "restore_snapshot name=before");
  client_->restore_snapshot();
  EXPECT_EQ(asked_, "restore_snapshot name=");
  client_->start_recording("run");
  EXPECT_EQ(asked_, "start_recording name=run");
  client_->stop_recording();
  EXPECT_EQ(asked_, "stop_recording");
}

TEST_F(ClientVocabulary, SamplesOlderThanAReplyAreDropped) {
  connect({{"epoch", "2"}, {"step", "40"}});
  publish_and_see(1, 100);
  client_->restore_snapshot("before");
  server_->publish("state", takt::test::small_state(1, 101));  // under way ahead of the reply
  server_->publish("state", takt::test::small_state(2, 39));
  EXPECT_FALSE(client_->wait_for(takt::topics::state, Seconds{0.3}).has_value());
  publish_and_see(2, 40);
  EXPECT_EQ(client_->state().epoch, 2U);
  EXPECT_EQ(client_->state().step, 40U);
}

TEST_F(ClientVocabulary, AMovedPartIsSeenInTheNextSampleOnly) {
  connect({});
  const std::uint64_t before = publish_and_see(0, 5).sample_number;
  client_->set_entity_state({.entity = "B", .position = takt_msgs::msg::Vector3{0, 0, 1}});
  EXPECT_FALSE(client_->wait_for(takt::topics::state, Seconds{0.1}).has_value());
  EXPECT_GT(publish_and_see(0, 5).sample_number, before);
}

}  // namespace
