// Several servers side by side on one host and in one domain, distinguished by the names of their cells.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "client_lib/client.h"
#include "tests/support/child_process.h"
#include "tests/support/dds_service.h"
#include "tests/support/hosted_service.h"
#include "tests/support/hosting_client.h"

namespace {

using takt::Client;
using takt::ClientOptions;
using takt::Seconds;
using takt::SimulationState;
using takt::test::ChildProcess;
using takt::test::kGenerous;

TEST(SeveralCells, CellsInOneDomainAreIndependent) {
  const std::string domain = std::to_string(takt::test::test_domain());
  std::vector<std::string> names;
  std::vector<std::unique_ptr<ChildProcess>> servers;
  std::vector<std::unique_ptr<Client>> cells;
  for (const char* end : {"_a", "_b", "_a_b"}) names.push_back(takt::test::test_cell() + end);
  for (const std::string& name : names) {
    servers.push_back(std::make_unique<ChildProcess>(
        std::vector<std::string>{std::string(TAKT_BIN_DIR) + "/takt-server",
                                 std::string(TAKT_CONFIG_DIR) + "/scenarios/block_assembly.yaml", "--cell",
                                 name, "--domain", domain, "--paused"}));
  }
  for (const std::string& name : names) {
    ClientOptions options;
    options.cell = name;
    options.domain = static_cast<int>(takt::test::test_domain());
    options.timeout = options.liveliness_timeout = kGenerous;
    cells.push_back(std::make_unique<Client>(options));
  }
  // The same name everywhere: only the cell's own robot follows.
  const auto home = cells[0]->state().robots[0].position;
  for (auto& cell : cells) ASSERT_EQ(cell->state().robots[0].position, home);
  auto moved = home;
  moved[0] += 1e-3;
  cells[0]->send_joint_command("Robot1", moved);
  // Commands and requests have topics of their own: steps until it has arrived, then those of its period.
  for (int i = 0; i < 1000 && cells[0]->status().commands_applied == 0; ++i) cells[0]->step(1);
  for (auto& cell : cells) cell->step(100);
  EXPECT_NEAR(cells[0]->state().robots[0].position[0], moved[0], 1e-12);
  for (const std::size_t other : {std::size_t{1}, std::size_t{2}}) {
    EXPECT_EQ(cells[other]->state().robots[0].position, home);
    EXPECT_EQ(cells[other]->status().commands_applied, 0U);
  }
  EXPECT_EQ(cells[1]->state().state_hash, cells[2]->state().state_hash);
  EXPECT_NE(cells[0]->state().state_hash, cells[1]->state().state_hash);

  // One changes its pace and its scenario, one ends; the third continues.
  cells[1]->reload_scenario();
  cells[1]->set_pace(takt::Pace::free);
  EXPECT_EQ(cells[2]->state().step, 100U);
  EXPECT_EQ(cells[2]->status().pace, takt::Pace::realtime);
  cells[0]->set_state(SimulationState::quitting);
  EXPECT_EQ(servers[0]->wait(), 0);
  cells[2]->step(50);
  EXPECT_EQ(cells[2]->state().step, 150U);
}

/// ROS tools expect one source of time in a domain: a second one is reported, and can be separated.
TEST(SeveralCells, ASharedClockIsReportedAndCanBeSeparate) {
  const std::string domain = std::to_string(takt::test::test_domain());
  const auto server = [&](const std::string& name, std::vector<std::string> more = {}) {
    std::vector<std::string> command{std::string(TAKT_BIN_DIR) + "/takt-server",
                                     std::string(TAKT_CONFIG_DIR) + "/scenarios/block_assembly.yaml",
                                     "--cell",
                                     name,
                                     "--domain",
                                     domain,
                                     "--paused"};
    command.insert(command.end(), more.begin(), more.end());
    return std::make_unique<ChildProcess>(command);
  };
  takt::test::HostedService service;
  takt::test::RawCellClient client;

  const std::string own_name = takt::test::test_cell() + "_own";
  const auto own = server(own_name, {"--namespaced-clock-and-tf"});
  const auto any = [](const auto& messages) { return !messages.empty(); };
  const std::string own_topics = "rt/" + own_name + "/";
  const auto clock = client.dds.read<rosgraph_msgs::msg::Clock>(own_topics + "clock", true, false, 10);
  const auto frames = client.dds.read<tf2_msgs::msg::TFMessage>(own_topics + "tf", true, false, 100);
  const auto fixed = client.dds.read<tf2_msgs::msg::TFMessage>(own_topics + "tf_static", true, true, 1);
  EXPECT_TRUE(clock->wait_until(any) && frames->wait_until(any) && fixed->wait_until(any));

  const auto shared = server(takt::test::test_cell() + "_shared");
  takt::test::msg::Event event;
  ASSERT_TRUE(
      client.wait_for_event("clock_shared", takt::test::test_cell(), "--namespaced-clock-and-tf", &event));
  EXPECT_EQ(event.severity, takt::Severity::warning);
  EXPECT_TRUE(shared->wait_for_output("writes /clock too")) << shared->text;
  EXPECT_TRUE(shared->wait_for_output("ready")) << shared->text;
  EXPECT_EQ(client.count_events("clock_shared"), 1U) << "of the one that has its own";

  // With each scenario the writers are discovered again; the report is not repeated.
  ClientOptions options;
  options.cell = takt::test::test_cell() + "_shared";
  options.domain = static_cast<int>(takt::test::test_domain());
  options.timeout = options.liveliness_timeout = kGenerous;
  Client other(options);
  other.reload_scenario();
  other.set_state(SimulationState::quitting);
  EXPECT_EQ(shared->wait(), 0);
  // A third one is another one.
  const auto third = server(takt::test::test_cell() + "_third");
  EXPECT_TRUE(client.events->wait_until([&](const auto& events) {
    return std::count_if(events.begin(), events.end(),
                         [](const auto& e) { return e.code == "clock_shared"; }) >= 2;
  }));
  EXPECT_EQ(client.count_events("clock_shared"), 2U);
  own->signal(SIGTERM);
  EXPECT_EQ(own->wait(), 0);
  EXPECT_EQ(own->text.find("/clock too"), std::string::npos) << own->text;
}

TEST(SeveralCells, ATakenNameIsReported) {
  takt::test::HostedService service;
  takt::Client client(takt::test::client_options());
  takt::test::ChildProcess second({std::string(TAKT_BIN_DIR) + "/takt-server", "--cell",
                                   takt::test::test_cell(), "--domain",
                                   std::to_string(takt::test::test_domain())});
  const auto reported = client.wait_for(
      takt::topics::event, [](const auto& e) { return e.code == "cell_name_taken"; }, kGenerous);
  ASSERT_TRUE(reported.has_value());
  EXPECT_EQ(reported->subject, takt::test::test_cell());
  EXPECT_TRUE(second.wait_for_output("another name (--cell)")) << second.text;
  std::vector<takt::FoundCell> found;
  do {  // a list on a busy machine may end ahead of the second announcement
    found = takt::list_cells(static_cast<int>(takt::test::test_domain()), Seconds{20.0});
  } while (found.size() == 1 && found[0].servers == 1);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].name, takt::test::test_cell());
  EXPECT_EQ(found[0].servers, 2);
}

}  // namespace
