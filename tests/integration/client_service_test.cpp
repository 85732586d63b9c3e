// takt::Client, takt and takt-controller against the real service.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "client_lib/client.h"
#include "client_lib/kinematics/arm.h"
#include "client_lib/tools/takt_controller/session.h"
#include "tests/support/built_programs.h"
#include "tests/support/child_process.h"
#include "tests/support/dds_service.h"
#include "tests/support/hosting_client.h"

namespace {

using takt::Client;
using takt::ClientError;
using takt::Event;
using takt::GripperAction;
using takt::Seconds;
using takt::SimulationState;
using takt::State;
using takt::test::ChildProcess;
using takt::test::DdsService;
using takt::test::kBin;
using takt::test::kBlockScenario;
using takt::test::kConfig;
using takt::test::kGenerous;

takt::ClientOptions options_for(const std::string& cell) {
  takt::ClientOptions options;
  options.cell = cell;
  options.domain = static_cast<int>(takt::test::test_domain());
  options.timeout = kGenerous;
  options.liveliness_timeout = kGenerous;
  return options;
}

takt::RunLoopOptions paused_loop() {
  takt::RunLoopOptions options;
  options.state = takt::SimulationState::paused;
  return options;
}

std::string contents(const std::filesystem::path& file) {
  std::stringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

TEST(ClientAndService, TheDescriptionEqualsThatOfTheCellBitByBit) {
  const DdsService service(paused_loop());
  const Client client(options_for(takt::test::test_cell()));
  const auto cell = client.cell();
  const auto& truth = service.model->description;
  ASSERT_EQ(cell->components.size(), truth.components.size());
  for (std::size_t i = 0; i < truth.components.size(); ++i) {
    EXPECT_EQ(cell->components[i].name, truth.components[i].name);
    EXPECT_EQ(cell->components[i].vertices, truth.components[i].mesh->vertices);
  }
  ASSERT_EQ(cell->robots.size(), truth.robots.size());
  for (std::size_t i = 0; i < truth.robots.size(); ++i) {
    const takt::ArmModel arm = takt::arm_model(cell->robots[i]);
    EXPECT_EQ(takt::pose_of(cell->robots[i].base), truth.robots[i].X_WR);
    EXPECT_EQ(arm.X_JF, truth.robots[i].arm.X_JF);
    ASSERT_EQ(arm.joint_count(), truth.robots[i].arm.joint_count());
    for (std::size_t j = 0; j < truth.robots[i].arm.joints.size(); ++j) {
      EXPECT_EQ(arm.joints[j].X_PJ, truth.robots[i].arm.joints[j].X_PJ);
      EXPECT_EQ(arm.joints[j].axis, truth.robots[i].arm.joints[j].axis);
      EXPECT_EQ(arm.joints[j].upper, truth.robots[i].arm.joints[j].upper);
    }
  }
  ASSERT_EQ(cell->grippers.size(), truth.grippers.size());
  for (std::size_t i = 0; i < truth.grippers.size(); ++i) {
    EXPECT_EQ(takt::pose_of(cell->grippers[i].mount), truth.grippers[i].X_FG);
    EXPECT_EQ(takt::pose_of(cell->grippers[i].tool_center_point), truth.grippers[i].X_GT);
  }
}

TEST(ClientAndService, StepsAndResetsShowInTheState) {
  const DdsService service(paused_loop());
  Client client(options_for(takt::test::test_cell()));
  EXPECT_EQ(client.get_state(), SimulationState::paused);
  client.step(25);
  const auto stepped = client.wait_for(
      takt::topics::state, [](const State& s) { return s.step == 25; }, kGenerous);
  ASSERT_TRUE(stepped.has_value());
  EXPECT_NEAR(stepped->time, 0.025, 1e-12);
  client.reset();
  const auto reset = client.wait_for(
      takt::topics::state, [](const State& s) { return s.epoch == 1; }, kGenerous);
  ASSERT_TRUE(reset.has_value());
  EXPECT_EQ(reset->step, 0U);
  client.play();
  EXPECT_EQ(client.get_state(), SimulationState::playing);
  try {
    client.step(1);
    FAIL() << "a playing cell was stepped";
  } catch (const ClientError& error) {
    EXPECT_EQ(error.kind(), ClientError::Kind::refused);
    EXPECT_EQ(error.result(), takt::ControlResult::incorrect_state);  // incorrect state
  }
}

TEST(ClientAndService, CommandsMoveTheCellAndRejectedOnesAreEvents) {
  const DdsService service(paused_loop());
  Client client(options_for(takt::test::test_cell()));
  const std::vector<double> start = client.state().robot("Robot1").position;
  std::vector<double> target = start;
  target[5] += 0.001;
  client.send_joint_command("Robot1", target);
  client.set_gripper("Gripper1", GripperAction::close);
  // The commands come on other topics than the request: each step may be before or after their arrival.
  std::optional<State> moved;
  for (int i = 0; i < 1000 && !moved; ++i) {
    client.step(10);
    const State now = client.state();
    if (std::abs(now.robot("Robot1").position[5] - target[5]) < 1e-12 && now.gripper("Gripper1").closed)
      moved = now;
  }
  const State newest = client.state();
  ASSERT_TRUE(moved.has_value()) << "after " << newest.step << " steps joint 5 is at "
                                 << newest.robot("Robot1").position[5] << " rad instead of " << target[5]
                                 << ", the gripper is " << newest.gripper("Gripper1").width << " m wide";
  EXPECT_LT(moved->gripper("Gripper1").width, 0.1);

  target[2] = 100.0;
  client.send_joint_command("Robot1", target);
  const auto refused = client.wait_for(
      takt::topics::event, [](const Event& e) { return e.code == "command_rejected"; }, kGenerous);
  ASSERT_TRUE(refused.has_value());
  EXPECT_EQ(refused->subject, "Robot1");
  EXPECT_NE(refused->message.find("elbow_joint"), std::string::npos) << refused->message;
}

TEST(ClientAndService, AKilledServerIsNoticed) {
  const std::string cell = takt::test::test_cell() + "_killed";
  ChildProcess server({kBin + "/takt-server", kBlockScenario, "--cell", cell, "--domain",
                       std::to_string(takt::test::test_domain()), "--paused"});
  ASSERT_TRUE(server.wait_for_output("ready")) << server.text;
  takt::ClientOptions options = options_for(cell);
  options.liveliness_timeout = Seconds{2.0};
  const Client client(options);
  client.state();
  server.signal(SIGKILL);
  try {
    (void)client.wait_for(
        takt::topics::state, [](const State&) { return false; }, kGenerous);
    FAIL() << "the wait did not end with an error";
  } catch (const ClientError& error) {
    EXPECT_EQ(error.kind(), ClientError::Kind::lost);
  }
}

/// The block assembly over DDS in lockstep against the same program in one process without DDS.
TEST(ClientAndService, BlockAssemblyInLockstepEqualsTheRunInOneProcess) {
  const std::string scenario = kBlockScenario;
  const auto report =
      std::filesystem::temp_directory_path() / ("takt_report_" + std::to_string(getpid()) + ".json");
  ChildProcess run({kBin + "/takt-run", "run", scenario, "--report", report.string()});
  ASSERT_EQ(run.wait(), 0) << run.text;
  const std::string in_process = contents(report);
  std::filesystem::remove(report);

  const std::string cell = takt::test::test_cell() + "_lockstep";
  const std::string domain = std::to_string(takt::test::test_domain());
  ChildProcess server({kBin + "/takt-server", scenario, "--cell", cell, "--domain", domain, "--paused"});
  ASSERT_TRUE(server.wait_for_output("ready")) << server.text;
  takt::tool::SessionOptions session;
  session.program = kConfig / "programs" / "block_assembly.lua";
  session.client = options_for(cell);
  session.pace = takt::Pace::lockstep;
  session.start = true;
  session.until_s = 42.0;
  ASSERT_EQ(takt::tool::run_session(session), 0);

  Client client(options_for(cell));
  const State end = client.state();
  EXPECT_EQ(end.step, 42000U);
  char hash[32];
  std::snprintf(hash, sizeof(hash), "\"0x%016llx\"", static_cast<unsigned long long>(end.state_hash));
  EXPECT_NE(in_process.find(hash), std::string::npos)
      << hash << " is not the hash of " << in_process.substr(0, 500);

  ChildProcess check({kBin + "/takt", "check", scenario, "--cell", cell, "--domain", domain});
  EXPECT_EQ(check.wait(), 0) << check.text;
  client.reset();
  ChildProcess check_at_start({kBin + "/takt", "check", scenario, "--cell", cell, "--domain", domain});
  EXPECT_EQ(check_at_start.wait(), 1) << check_at_start.text;
  client.set_state(SimulationState::quitting);
  EXPECT_EQ(server.wait(), 0) << server.text;
}

TEST(ClientAndService, AFaultyProgramIsReportedWithItsPlace) {
  const DdsService service(paused_loop());
  const auto program =
      std::filesystem::temp_directory_path() / ("takt_program_" + std::to_string(getpid()) + ".lua");
  std::ofstream(program) << "local x = 1\nerror('this program is broken')\n";
  ChildProcess controller({kBin + "/takt-controller", program.string(), "--cell", takt::test::test_cell(),
                           "--domain", std::to_string(takt::test::test_domain())});
  EXPECT_EQ(controller.wait(), 1);
  std::filesystem::remove(program);
  EXPECT_NE(controller.text.find(".lua:2"), std::string::npos) << controller.text;
  EXPECT_NE(controller.text.find("this program is broken"), std::string::npos) << controller.text;
}

/// A cell that runs faster or slower than wall time goes on so when a robot's program joins it.
TEST(ClientAndService, AProgramInRealTimeKeepsTheFactorOfThePace) {
  const DdsService service(paused_loop());
  Client client(options_for(takt::test::test_cell()));
  client.set_pace(takt::Pace::realtime, 0.5);
  ChildProcess controller({kBin + "/takt-controller", kConfig / "programs" / "block_assembly.lua", "--pace",
                           "realtime", "--start", "--cell", takt::test::test_cell(), "--domain",
                           std::to_string(takt::test::test_domain())});
  const auto plays = client.wait_for(
      takt::topics::status, [](const takt::Status& s) { return s.state == SimulationState::playing; },
      kGenerous);
  ASSERT_TRUE(plays) << controller.text;
  EXPECT_EQ(plays->pace, takt::Pace::realtime);
  EXPECT_EQ(plays->pace_factor, 0.5);
  controller.signal(SIGTERM);
  EXPECT_EQ(controller.wait(), 128 + SIGTERM) << controller.text;
}

TEST(TaktCommand, ExitCodesSeparateUsageFromFailure) {
  const std::string domain = std::to_string(takt::test::test_domain());
  ChildProcess usage({kBin + "/takt", "no_such_command"});
  EXPECT_EQ(usage.wait(), 2) << usage.text;
  ChildProcess json_usage({kBin + "/takt", "--json", "spawn"});
  EXPECT_EQ(json_usage.wait(), 2);
  EXPECT_NE(json_usage.text.find(R"({"error":"NAME is required","kind":"usage"})"), std::string::npos)
      << json_usage.text;
  ChildProcess help({kBin + "/takt", "--help"});
  EXPECT_EQ(help.wait(), 0);
  EXPECT_NE(help.text.find("takt record"), std::string::npos) << help.text;
  ChildProcess nowhere(
      {kBin + "/takt", "status", "--cell", "nowhere", "--timeout", "0.5", "--domain", domain});
  EXPECT_EQ(nowhere.wait(), 3);
  EXPECT_NE(nowhere.text.find("'nowhere'"), std::string::npos) << nowhere.text;
}

TEST(ClientAndService, AnExplanationDoesNotChangeTheRun) {
  const DdsService service(paused_loop());
  Client client(options_for(takt::test::test_cell()));
  client.step(30);
  const auto part = client.explain_part("P");
  EXPECT_EQ(part.part, "P");
  EXPECT_EQ(part.step, 30U);
  EXPECT_EQ(part.partner, "Table1");
  EXPECT_EQ(part.rule, takt::PartnerRule::only_end);
  EXPECT_EQ(part.state, takt::PartState::placed);
  EXPECT_EQ(part.state_because, "Table1");
  EXPECT_EQ(part.sequence_count, 1U);
  ASSERT_EQ(part.sequences.size(), 1U);
  EXPECT_EQ(part.sequences[0].components, (std::vector<std::string>{"P", "Table1"}));
  const auto component = [&](const std::string& name) {
    return *std::find_if(part.components.begin(), part.components.end(),
                         [&](const auto& one) { return one.name == name; });
  };
  EXPECT_EQ(component("P").hierarchy, 2);
  EXPECT_EQ(component("Table1").type, takt::ComponentType::ground);
  ASSERT_EQ(part.connections.size(), 1U);
  EXPECT_NEAR(part.connections[0].force.z, 0.3 * 9.80665, 1e-6);
  ASSERT_EQ(part.contacts.size(), 1U);
  EXPECT_TRUE(part.contacts[0].measured);
  EXPECT_NEAR(part.contacts[0].distance, 0.0, 2e-4);
  EXPECT_NEAR(part.contacts[0].position.z, 0.7, 1e-3);

  const auto table = client.explain_part("Table1");
  EXPECT_EQ(table.type, takt::ComponentType::ground);
  EXPECT_EQ(table.held, (std::vector<std::string>{"P", "C"}));
  EXPECT_FALSE(table.rule);

  try {
    (void)client.explain_part("Q");
    FAIL() << "a Part that does not exist was explained";
  } catch (const ClientError& error) {
    EXPECT_EQ(error.result(), takt::ControlResult::not_found);  // not found
    EXPECT_NE(std::string(error.what()).find("no component 'Q' in this cell; it has P, C, Table1"),
              std::string::npos)
        << error.what();
  }

  // The cell continues as one without requests.
  client.play();
  for (int i = 0; i < 20; ++i) (void)client.explain_part("P");
  client.pause();
  const State paused_at = client.state();
  client.step(10);
  const auto end = client.wait_for(
      takt::topics::state, [&](const State& s) { return s.step >= paused_at.step + 10; }, kGenerous);
  ASSERT_TRUE(end.has_value());
  takt::Simulation silent(service.model);
  while (silent.step_index() < end->step) ASSERT_TRUE(silent.step({}));
  EXPECT_EQ(silent.state_hash(), end->state_hash);
}

TEST(TaktCommand, ExplainHasAFormForPeopleAndOneForPrograms) {
  const DdsService service(paused_loop());
  Client(options_for(takt::test::test_cell())).step(30);
  const std::string domain = std::to_string(takt::test::test_domain());
  const auto takt = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), kBin + "/takt");
    arguments.insert(arguments.end(), {"--cell", takt::test::test_cell(), "--domain", domain});
    return arguments;
  };
  ChildProcess person(takt({"explain", "P"}));
  EXPECT_EQ(person.wait(), 0) << person.text;
  for (const char* words :
       {"At 0.030 s (step 30): P is placed", "Table1 holds it since the start",
        "P (part 2) > Table1 (ground)   <- chosen", "P - Table1: ", "Force of Table1 on it: 2.9420 N"}) {
    EXPECT_NE(person.text.find(words), std::string::npos) << words << " in\n" << person.text;
  }
  ChildProcess program(takt({"explain", "P", "--json"}));
  EXPECT_EQ(program.wait(), 0) << program.text;
  EXPECT_NE(program.text.find("\"partner\": \"Table1\""), std::string::npos) << program.text;
  ChildProcess unknown(takt({"explain", "Q"}));
  EXPECT_EQ(unknown.wait(), 1);
  EXPECT_NE(unknown.text.find("no component 'Q'"), std::string::npos) << unknown.text;
  ChildProcess nothing(takt({"explain"}));
  EXPECT_EQ(nothing.wait(), 2) << nothing.text;
}

TEST(TaktCommand, RecordWritesOneRowPerPeriod) {
  const DdsService service(paused_loop());
  Client client(options_for(takt::test::test_cell()));
  ChildProcess record({kBin + "/takt", "record", "-", "--until", "0.05", "--period", "0.01", "--cell",
                       takt::test::test_cell(), "--domain", std::to_string(takt::test::test_domain())});
  // Waits for each row ahead of the next step, so that no row is missed.
  for (const char* row : {"\n0,", "\n0.01,", "\n0.02,", "\n0.03,", "\n0.04,"}) {
    ASSERT_TRUE(record.wait_for_output(row)) << record.text;
    client.step(10);
  }
  EXPECT_EQ(record.wait(), 0) << record.text;
  EXPECT_EQ(record.text.substr(0, record.text.find(',')), "time");
  EXPECT_NE(record.text.find("\n0.05,"), std::string::npos) << record.text;
  EXPECT_NE(record.text.find("6 rows"), std::string::npos) << record.text;
}

}  // namespace
