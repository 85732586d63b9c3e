// Observation of a cell's samples by takt::Client: description, states, events, and their loss.
#include <gtest/gtest.h>

#include <numeric>

#include "client_lib/client.h"
#include "tests/support/hosting_client.h"
#include "tests/support/scripted_cell.h"

namespace {

using takt::Client;
using takt::ClientError;
using takt::Event;
using takt::Seconds;
using takt::State;
using takt::test::kGenerous;
using takt::test::ScriptedCell;
using takt::test::small_description;
using takt::test::small_state;
using takt::test::test_domain;
using takt::test::unique_cell_name;

class ClientObservation : public testing::Test {
 protected:
  static void SetUpTestSuite() { ScriptedCell::use_real_transports(); }

  takt::ClientOptions options() const {
    takt::ClientOptions made;
    made.cell = name_;
    made.domain = static_cast<int>(test_domain());
    made.timeout = kGenerous;
    made.liveliness_timeout = kGenerous;
    return made;
  }
  void connect() {
    server_ = std::make_unique<ScriptedCell>(name_, small_description(name_));
    client_ = std::make_unique<Client>(options());
    ASSERT_TRUE(server_->wait_for_readers("state", 1));
    ASSERT_TRUE(server_->wait_for_readers("events", 1));
  }
  /// Publishes and waits until the client has it.
  State publish_and_see(const takt_msgs::msg::CellState& state) {
    server_->publish("state", state);
    const auto seen = client_->wait_for(
        takt::topics::state, [&](const State& s) { return s.epoch == state.epoch && s.step == state.step; },
        kGenerous);
    EXPECT_TRUE(seen.has_value());
    return seen.value_or(State());
  }

  std::string name_ = unique_cell_name("observed");
  std::unique_ptr<ScriptedCell> server_;
  std::unique_ptr<Client> client_;
};

TEST_F(ClientObservation, ALateJoinerGetsADescriptionOfMegabytes) {
  auto description = small_description(name_);
  auto& vertices = description.components[1].vertices;
  vertices.resize(2'000'000);
  std::iota(vertices.begin(), vertices.end(), 0.5F);
  server_ = std::make_unique<ScriptedCell>(name_, description);
  const Client late(options());
  const auto cell = late.cell();
  EXPECT_EQ(cell->cell, name_);
  ASSERT_EQ(cell->components.size(), 3U);
  EXPECT_EQ(cell->components[1].vertices, vertices);
  EXPECT_EQ(cell->find_component("Jaw"), 2);
  EXPECT_EQ(cell->find_component("nothing"), -1);
  EXPECT_EQ(cell->robots.at(1).joints.at(1).name, "elbow");
}

TEST_F(ClientObservation, TheErrorOfAnUnknownCellNamesTheKnownOnes) {
  server_ = std::make_unique<ScriptedCell>(name_, small_description(name_));
  takt::ClientOptions wrong = options();
  wrong.cell = "nowhere";
  wrong.timeout = Seconds{3.0};
  std::string sentence;
  constexpr int kAttempts = 20;  // discovery of the known ones may take longer on a loaded machine
  for (int i = 0; i < kAttempts && sentence.find("'" + name_ + "'") == std::string::npos; ++i) {
    try {
      const Client client(wrong);
      FAIL() << "connected to a cell that does not exist";
    } catch (const ClientError& error) {
      EXPECT_EQ(error.kind(), ClientError::Kind::not_found);
      sentence = error.what();
    }
  }
  EXPECT_NE(sentence.find("'nowhere'"), std::string::npos) << sentence;
  EXPECT_NE(sentence.find("'" + name_ + "'"), std::string::npos) << sentence;
}

TEST_F(ClientObservation, CellsOfADomainAreListed) {
  server_ = std::make_unique<ScriptedCell>(name_, small_description(name_));
  // The list ends when all have answered, long before its time is over.
  const auto cells = takt::list_cells(static_cast<int>(test_domain()), kGenerous);
  const auto found =
      std::find_if(cells.begin(), cells.end(), [&](const auto& cell) { return cell.name == name_; });
  ASSERT_NE(found, cells.end());
  EXPECT_TRUE(found->status.has_value());
}

TEST_F(ClientObservation, ADomainOutOfRangeIsRefused) {
  takt::ClientOptions wrong = options();
  wrong.domain = 233;
  EXPECT_THROW(Client{wrong}, ClientError);
}

TEST_F(ClientObservation, AStateIsReadByName) {
  connect();
  auto state = small_state(0, 7);
  state.components[1].position.y = 2.0;
  state.components[1].orientation.w = 0.4;
  state.components[1].partner = 2;
  state.robots[1].position = {0.5, -0.25};
  state.grippers[0].width = 0.04;
  state.grippers[0].closed = true;
  state.grippers[0].in_position = true;
  state.grippers[0].part = 1;
  const State seen = publish_and_see(state);
  EXPECT_EQ(seen.component("B").position.y, 2.0);
  EXPECT_EQ(seen.component("B").orientation.w, 0.4);
  EXPECT_EQ(seen.partner_of("B"), "Jaw");
  EXPECT_EQ(seen.partner_of("Table"), "");
  EXPECT_EQ(seen.robot("Robot2").position, (std::vector<double>{0.5, -0.25}));
  EXPECT_TRUE(seen.gripper("Gripper1").closed);
  EXPECT_TRUE(seen.gripper("Gripper1").in_position);
  EXPECT_FALSE(seen.gripper("Gripper1").moving);
  EXPECT_EQ(seen.part_present("Gripper1"), "B");
  try {
    seen.component("b");
    FAIL() << "found a component that does not exist";
  } catch (const ClientError& error) {
    EXPECT_STREQ(error.what(), "The cell has no component 'b'; it has Table, B, Jaw.");
  }
}

TEST_F(ClientObservation, OlderInstantsAreDroppedAndRepeatedOnesKept) {
  connect();
  EXPECT_EQ(publish_and_see(small_state(0, 10)).sample_number, 1U);
  server_->publish("state", small_state(0, 9));
  EXPECT_EQ(publish_and_see(small_state(0, 11)).sample_number, 2U);  // step 9 was not counted
  EXPECT_EQ(publish_and_see(small_state(1, 0)).sample_number, 3U);   // a reset
  server_->publish("state", small_state(0, 12));                     // from the time ahead of the reset
  server_->publish("state", small_state(1, 0));
  const auto repeated = client_->wait_for(
      takt::topics::state, [](const State& s) { return s.sample_number == 4; }, kGenerous);
  ASSERT_TRUE(repeated.has_value());
  EXPECT_EQ(repeated->epoch, 1U);
  EXPECT_EQ(repeated->step, 0U);
}

TEST_F(ClientObservation, StatesThatDoNotFitTheDescriptionAreDropped) {
  connect();
  auto short_of_a_component = small_state(0, 1);
  short_of_a_component.components.pop_back();
  server_->publish("state", short_of_a_component);
  auto partner_that_does_not_exist = small_state(0, 2);
  partner_that_does_not_exist.components[0].partner = 3;
  server_->publish("state", partner_that_does_not_exist);
  EXPECT_EQ(publish_and_see(small_state(0, 3)).sample_number, 1U);
}

/// The client reads samples into the memory of earlier ones.
TEST_F(ClientObservation, AStateHasNothingOfEarlierOnesAfterPartsAppearAndVanish) {
  connect();
  const State first = publish_and_see(small_state(0, 1));
  std::uint64_t step = 1;
  std::uint32_t generation = 0;
  for (const std::size_t parts : {400, 0, 3, 401, 1}) {
    auto description = small_description(name_);
    description.scenario_generation = ++generation;
    auto state = small_state(0, 0);
    state.scenario_generation = generation;
    for (std::size_t i = 0; i < parts; ++i) {
      description.components.push_back({.name = "P" + std::to_string(i), .type = takt::ComponentType::part});
      auto& part = state.components.emplace_back();
      part.position.x = static_cast<double>(1000 * generation + i);
      part.partner = 0;
    }
    server_->publish("description", description);
    for (int i = 0; i < 8; ++i) {
      state.step = ++step;
      state.robots[i % 2].motor_power.assign(i % 3 == 0 ? 2 : 0, 1.0 + i);
      const State seen = publish_and_see(state);
      EXPECT_TRUE(static_cast<const takt_msgs::msg::CellState&>(seen) == state)
          << parts << " at step " << step;
      EXPECT_EQ(seen.cell->components.size(), 3 + parts);
    }
  }
  EXPECT_TRUE(static_cast<const takt_msgs::msg::CellState&>(first) == small_state(0, 1));
}

TEST_F(ClientObservation, WaitForStateEndsWithNothingAtItsTimeout) {
  connect();
  publish_and_see(small_state(0, 1));
  EXPECT_FALSE(client_
                   ->wait_for(
                       takt::topics::state, [](const State&) { return false; }, Seconds{0.05})
                   .has_value());
}

TEST_F(ClientObservation, EventsComeInOrderAndGapsAreCounted) {
  connect();
  for (const std::uint64_t number : {5U, 6U, 6U, 9U, 8U, 10U}) server_->publish_event(number, "number");
  server_->publish_event(11, "last");
  const auto first = client_->wait_for(takt::topics::event, kGenerous);
  ASSERT_TRUE(first.has_value());
  EXPECT_EQ(first->sequence_number, 5U);
  EXPECT_EQ(first->missed_before, 0U);  // events ahead of this client's start are not missed
  EXPECT_EQ(client_->wait_for(takt::topics::event, kGenerous).value_or(Event()).sequence_number, 6U);
  const auto after_gap = client_->wait_for(takt::topics::event, kGenerous);
  ASSERT_TRUE(after_gap.has_value());
  EXPECT_EQ(after_gap->sequence_number, 9U);
  EXPECT_EQ(after_gap->missed_before, 2U);
  const auto last = client_->wait_for(
      takt::topics::event, [](const Event& e) { return e.code == "last"; }, kGenerous);
  ASSERT_TRUE(last.has_value());
  EXPECT_EQ(last->sequence_number, 11U);
  EXPECT_FALSE(client_->wait_for(takt::topics::event, Seconds{0.0}).has_value());
}

TEST_F(ClientObservation, AServerThatGoesAwayEndsEveryWait) {
  connect();
  publish_and_see(small_state(0, 1));
  EXPECT_TRUE(client_->connected());
  server_.reset();
  try {
    (void)client_->wait_for(
        takt::topics::state, [](const State&) { return false; }, kGenerous);
    FAIL() << "the wait did not end with an error";
  } catch (const ClientError& error) {
    EXPECT_EQ(error.kind(), ClientError::Kind::lost);
  }
  EXPECT_FALSE(client_->connected());
  EXPECT_THROW((void)client_->wait_for(takt::topics::event, kGenerous), ClientError);
  EXPECT_THROW(client_->request("get_features"), ClientError);
}

TEST_F(ClientObservation, AServerThatFallsSilentCountsAsGone) {
  server_ = std::make_unique<ScriptedCell>(name_, small_description(name_));
  takt::ClientOptions impatient = options();
  impatient.liveliness_timeout = Seconds{0.5};
  const Client client(impatient);
  try {
    (void)client.wait_for(
        takt::topics::state, [](const State&) { return false; }, kGenerous);
    FAIL() << "the wait did not end with an error";
  } catch (const ClientError& error) {
    EXPECT_EQ(error.kind(), ClientError::Kind::lost);
    EXPECT_NE(std::string(error.what()).find("silent"), std::string::npos) << error.what();
  }
}

TEST_F(ClientObservation, ARestartedServerReplacesTheKnownState) {
  connect();
  publish_and_see(small_state(4, 1000));
  server_.reset();
  auto other = small_description(name_);
  other.scenario = "second run";
  server_ = std::make_unique<ScriptedCell>(name_, other);
  ASSERT_TRUE(server_->wait_for_readers("state", 1));
  // It may not know yet that the first one has gone. The description is announced behind the state.
  while (client_->cell()->scenario != other.scenario) ASSERT_TRUE(client_->wait_for_connection(kGenerous));
  const State seen = publish_and_see(small_state(0, 1));
  EXPECT_EQ(seen.cell->scenario, "second run");
  EXPECT_TRUE(client_->connected());
}

}  // namespace
