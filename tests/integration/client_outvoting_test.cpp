// Samples that the server's own writer sent once and contradicts from then on, as a forged one is contradicted.
#include <gtest/gtest.h>

#include "client_lib/client.h"
#include "tests/support/scripted_cell.h"

namespace {

using takt::Client;
using takt::Event;
using takt::Seconds;
using takt::State;
using takt::test::kGenerous;
using takt::test::ScriptedCell;
using takt::test::small_description;
using takt::test::small_state;
using takt::test::test_domain;
using takt::test::unique_cell_name;

class ClientOutvoting : public testing::Test {
 protected:
  static void SetUpTestSuite() { ScriptedCell::use_real_transports(); }
  void SetUp() override {
    takt::ClientOptions options;
    options.cell = name_;
    options.domain = static_cast<int>(test_domain());
    options.timeout = options.liveliness_timeout = kGenerous;
    server_ = std::make_unique<ScriptedCell>(name_, small_description(name_));
    client_ = std::make_unique<Client>(options);
    ASSERT_TRUE(server_->wait_for_readers("state", 1));
    ASSERT_TRUE(server_->wait_for_readers("events", 1));
    server_->publish("state", small_state(0, 10));
    ASSERT_EQ(client_->state().step, 10U);
  }
  /// Publishes steps of epoch 0 from this one on until the client has one of them.
  State go_on(std::uint64_t step) {
    const std::uint64_t first = step;
    for (;; ++step) {
      server_->publish("state", small_state(0, step));
      const auto seen = client_->wait_for(
          takt::topics::state,
          [&](const State& s) { return s.epoch == 0 && s.step >= first && s.step <= step; }, Seconds{0.02});
      if (seen) return *seen;
    }
  }

  const std::string name_ = unique_cell_name("outvoting");
  std::unique_ptr<ScriptedCell> server_;
  std::unique_ptr<Client> client_;
};

TEST_F(ClientOutvoting, AStateFarAheadWaitsForItsConfirmation) {
  auto forged = small_state(0, 11);
  forged.time = 1e9;
  server_->publish("state", forged);
  server_->publish("state", small_state(4'000'000'000, 1));
  server_->publish("state", small_state(0, 12));
  const auto next = client_->wait_for(
      takt::topics::state, [](const State& s) { return s.step != 10; }, kGenerous);
  ASSERT_TRUE(next.has_value());
  EXPECT_EQ(next->step, 12U);
  EXPECT_EQ(next->sample_number, 2U) << "the others were never handed out";
}

TEST_F(ClientOutvoting, ALeapThatGoesOnIsBelieved) {
  server_->publish("state", small_state(7, 1));
  server_->publish("state", small_state(7, 2));
  const auto next = client_->wait_for(
      takt::topics::state, [](const State& s) { return s.epoch == 7; }, kGenerous);
  ASSERT_TRUE(next.has_value());
  EXPECT_EQ(next->step, 2U);
}

TEST_F(ClientOutvoting, AnEpochAheadIsOutvoted) {
  server_->publish("state", small_state(1, 0));
  ASSERT_TRUE(client_->wait_for(
      takt::topics::state, [](const State& s) { return s.epoch == 1; }, kGenerous));
  EXPECT_EQ(go_on(11).epoch, 0U);
}

TEST_F(ClientOutvoting, AStepAheadIsOutvoted) {
  auto forged = small_state(0, std::uint64_t{1} << 60U);
  forged.time = 0.011;
  server_->publish("state", forged);
  ASSERT_TRUE(client_->wait_for(
      takt::topics::state, [](const State& s) { return s.step > 100'000; }, kGenerous));
  EXPECT_LT(go_on(11).step, 100'000U);
}

TEST_F(ClientOutvoting, ADescriptionThatDoesNotFitIsOutvoted) {
  const auto before = client_->cell();
  auto forged = small_description(name_);
  forged.scenario_generation = 900;
  forged.components.clear();
  server_->publish("description", forged);
  ASSERT_TRUE(client_->wait_for(
      takt::topics::description, [](const auto& d) { return d.scenario_generation == 900; }, kGenerous));
  EXPECT_EQ(go_on(11).cell, before);
  EXPECT_EQ(client_->cell(), before);
}

TEST_F(ClientOutvoting, ADescriptionOfAnEarlierScenarioIsOutvoted) {
  auto later = small_description(name_);
  later.scenario_generation = 5;
  server_->publish("description", later);
  ASSERT_TRUE(client_->wait_for(
      takt::topics::description, [](const auto& d) { return d.scenario_generation == 5; }, kGenerous));
  const auto before = client_->cell();
  auto forged = small_description(name_);
  forged.scenario_generation = 3;
  server_->publish("description", forged);
  ASSERT_TRUE(client_->wait_for(
      takt::topics::description, [](const auto& d) { return d.scenario_generation == 3; }, kGenerous));
  for (std::uint64_t step = 11;; ++step) {
    auto state = small_state(0, step);
    state.scenario_generation = 5;
    server_->publish("state", state);
    const auto seen = client_->wait_for(
        takt::topics::state, [](const State& s) { return s.scenario_generation == 5; }, Seconds{0.02});
    if (!seen) continue;
    EXPECT_EQ(seen->cell, before);
    break;
  }
}

TEST_F(ClientOutvoting, TheSameDescriptionAgainIsTheSame) {
  const auto before = client_->cell();
  server_->publish("description", small_description(name_));
  server_->publish_event(1, "behind");
  ASSERT_TRUE(client_->wait_for(takt::topics::event, kGenerous));
  EXPECT_EQ(go_on(11).cell, before);
}

TEST_F(ClientOutvoting, EventsBehindANumberFarAheadAreHandedOut) {
  server_->publish_event(1, "first");
  server_->publish_event(std::uint64_t{1} << 60U, "forged");
  server_->publish_event(2, "second");
  server_->publish_event(3, "third");
  server_->publish_event(4, "fourth");
  for (const char* code : {"first", "forged", "second", "third", "fourth"}) {
    const auto event = client_->wait_for(takt::topics::event, kGenerous);
    ASSERT_TRUE(event.has_value()) << code;
    EXPECT_EQ(event->code, code);
  }
}

}  // namespace
