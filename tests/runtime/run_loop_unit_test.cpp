#include "server/runtime/loop/run_loop.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "idl/common/lockstep.h"
#include "tests/support/loop_reader.h"
#include "tests/support/service_cell.h"

namespace takt {
namespace {

using test::LoopReader;
using test::swing;

/// What a controller sends ahead, received in the loop's thread: the whole of a batch is there before the loop goes on.
class BatchesAhead final : public InputReceiver {
 public:
  /// Sends the next batch if the loop waits for it.
  explicit BatchesAhead(std::function<bool()> send) : send_(std::move(send)) {}
  void begin() { begun_ = true; }
  bool receive_until_ns(std::int64_t, const std::function<bool()>& ready) override {
    return begun_ && send_() && ready();
  }
  void interrupt() override {}

 private:
  const std::function<bool()> send_;
  std::atomic<bool> begun_{false};
};

class RunLoopTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { model_ = test::service_model(); }
  static void TearDownTestSuite() { model_.reset(); }

  void start(RunLoopOptions options, InputReceiver* receiver = nullptr) {
    options.on_instant = [this](const Simulation& simulation) {
      hashes_[simulation.epoch()].push_back(simulation.state_hash());
    };
    loop_ = std::make_unique<RunLoop>(simulation_, options);
    reader_ = std::make_unique<LoopReader>(*loop_);
    loop_->receive_with(receiver);
    loop_->start();
  }
  void expect_ok(const ControlReply& reply) { EXPECT_EQ(reply.result, ControlResult::ok) << reply.message; }

  /// The hashes of all steps when the swing is commanded in-process, as takt-run does: at every boundary all
  /// commands, stamped with its time, in the very next step.
  static std::vector<std::uint64_t> direct_hashes(std::uint64_t steps, double period_s, int robots,
                                                  bool gripper) {
    Simulation simulation(model_);
    std::vector<std::uint64_t> hashes{simulation.state_hash()};
    std::uint64_t boundary = 0;
    while (simulation.step_index() < steps) {
      std::vector<Command> commands;
      if (simulation.step_index() == period_boundary_step(boundary, period_s, model_->step_s)) {
        ++boundary;
        for (int robot = 0; robot < robots; ++robot) {
          JointCommand command = swing(robot, simulation.time_s());
          command.period_s = period_s;
          commands.emplace_back(command);
        }
        if (gripper)
          commands.emplace_back(
              GripperCommand{0, SimTime::from_seconds(simulation.time_s()), GripperAction::close, 0.0, 0.0});
      }
      EXPECT_TRUE(simulation.step(commands));
      hashes.push_back(simulation.state_hash());
    }
    return hashes;
  }

  static std::shared_ptr<CellModel> model_;
  Simulation simulation_{model_};
  std::map<std::uint32_t, std::vector<std::uint64_t>>
      hashes_;  // by epoch; written by the loop until it is stopped
  std::unique_ptr<RunLoop> loop_;
  std::unique_ptr<LoopReader> reader_;
};
std::shared_ptr<CellModel> RunLoopTest::model_;

TEST_F(RunLoopTest, APausedLoopStepsOnlyOnRequest) {
  start({.pace = Pace::free, .state = SimulationState::paused});
  const ControlReply state = reader_->request("get_state");
  EXPECT_EQ(test::value_of(state, "state"), "paused");
  const ControlReply stepped = reader_->request("step", {{"steps", "25"}});
  expect_ok(stepped);
  EXPECT_EQ(test::value_of(stepped, "step"), "25");
  loop_->stop();
  EXPECT_EQ(simulation_.step_index(), 25U);
  EXPECT_EQ(hashes_[simulation_.epoch()].size(), 26U);  // the first instant and one per step
}

TEST_F(RunLoopTest, SingleStepsAreRefusedWhilePlaying) {
  start({.pace = Pace::free});
  EXPECT_EQ(reader_->request("step", {{"steps", "1"}}).result, ControlResult::incorrect_state);
  expect_ok(reader_->request("set_state", {{"state", "2"}}));
  expect_ok(reader_->request("step", {{"steps", "1"}}));
}

TEST_F(RunLoopTest, AResetGivesTheSameHashesAgainUnderANewEpoch) {
  start({.pace = Pace::free, .state = SimulationState::paused});
  expect_ok(reader_->request("step", {{"steps", "40"}}));
  expect_ok(reader_->request("reset", {{"scope", "255"}}));
  expect_ok(reader_->request("step", {{"steps", "40"}}));
  loop_->stop();
  ASSERT_EQ(hashes_.size(), 2U);
  EXPECT_EQ(hashes_.begin()->second, hashes_.rbegin()->second);
  EXPECT_EQ(hashes_.rbegin()->first, hashes_.begin()->first + 1);
  EXPECT_EQ(reader_->count("reset"), 1U);
}

TEST_F(RunLoopTest, QuestionsAreAnsweredOneByOneAndChangeNothing) {
  start({.pace = Pace::free, .state = SimulationState::paused});
  // Taken in one go by the loop, or in several: each is answered or refused, and the loop continues.
  std::vector<std::uint64_t> asked;
  for (int i = 0; i < 200; ++i) asked.push_back(reader_->submit("explain_part", {{"part", "P"}}));
  expect_ok(reader_->request("step", {{"steps", "40"}}));
  int answered = 0;
  for (const std::uint64_t id : asked) {
    const auto reply = reader_->reply_to(id);
    ASSERT_TRUE(reply.has_value());
    if (reply->result == ControlResult::ok) {
      ++answered;
      EXPECT_EQ(test::value_of(*reply, "partner"), "Table1");
    } else {
      EXPECT_EQ(reply->result, ControlResult::failed);
      EXPECT_NE(reply->message.find("64 questions are waiting"), std::string::npos) << reply->message;
    }
  }
  EXPECT_GE(answered, 64);
  loop_->stop();
  Simulation silent(model_);
  while (silent.step_index() < 40) ASSERT_TRUE(silent.step({}));
  EXPECT_EQ(simulation_.state_hash(), silent.state_hash());
}

TEST_F(RunLoopTest, RequestsThatCannotBeExecutedChangeNothing) {
  start({.pace = Pace::free, .state = SimulationState::paused});
  const auto refused = [&](const std::string& name, const test::TextArguments& arguments) {
    const ControlReply reply = reader_->request(name, arguments);
    EXPECT_EQ(reply.result, ControlResult::failed) << name;
    return reply.message;
  };
  EXPECT_NE(refused("set_entity_state", {{"entity", "P"}}).find("a position, an orientation"),
            std::string::npos);
  const auto plc = [&](const char* period, const char* targets) {
    return refused("register_controller", {{"name", "a"}, {"period", period}, {"targets", targets}});
  };
  EXPECT_NE(plc("0.0005", "Robot1").find("a period of 0.001"), std::string::npos);
  EXPECT_NE(plc("0.008", "").find("has a target at least"), std::string::npos);
  EXPECT_NE(plc("0.008", "Robot1,Robot1").find("names the target 'Robot1' twice"), std::string::npos);
  EXPECT_EQ(reader_->count("controller_registered"), 0U);
}

TEST_F(RunLoopTest, AStoppedLoopIsPausedAndReset) {
  start({.pace = Pace::free});
  ASSERT_TRUE(reader_->wait_until([&] { return reader_->snapshot && reader_->snapshot->step > 100; }));
  expect_ok(reader_->request("set_state", {{"state", "stopped"}}));
  const ControlReply state = reader_->request("get_state");
  EXPECT_EQ(test::value_of(state, "state"), "stopped");
  EXPECT_EQ(test::value_of(state, "step"), "0");
}

TEST_F(RunLoopTest, ARequestDuringStepsIsHandled) {
  start({.pace = Pace::free, .state = SimulationState::paused});
  const auto many = reader_->submit("step", {{"steps", "1000000000"}});
  EXPECT_EQ(reader_->request("step", {{"steps", "1"}}).result, ControlResult::incorrect_state);
  expect_ok(reader_->request("set_state", {{"state", "2"}}));
  const auto ended = reader_->reply_to(many);
  ASSERT_TRUE(ended);
  EXPECT_EQ(ended->result, ControlResult::failed);
}

TEST_F(RunLoopTest, TheNewestCommandOfATargetIsAppliedAtTheNextStep) {
  start({.pace = Pace::free, .state = SimulationState::paused});
  for (const double time_s : {0.1, 0.2, 0.3}) {
    EXPECT_FALSE(loop_->append(swing(1, time_s), 1, monotonic_now_ns()));
  }
  expect_ok(reader_->request("step", {{"steps", "1"}}));
  loop_->stop();
  Snapshot snapshot = simulation_.make_snapshot();
  simulation_.read_snapshot(snapshot);
  EXPECT_EQ(snapshot.robots[1].commands_applied, 1U);
  EXPECT_EQ(snapshot.robots[1].newest_stamp.ns, 300'000'000);
  EXPECT_EQ(snapshot.robots[0].commands_applied, 0U);
}

/// Answers every boundary of the controllers in lockstep, slowly or fast, until the step is reached.
void answer_boundaries(RunLoop& loop, LoopReader& reader, std::uint64_t last_step, double period_s,
                       int robots, bool gripper, bool reverse) {
  std::uint64_t boundary = 0;
  while (true) {
    const std::uint64_t step = period_boundary_step(boundary, period_s, loop.cell().step_s);
    if (step >= last_step) return;
    ASSERT_TRUE(reader.wait_until([&] { return reader.snapshot && reader.snapshot->step == step; }));
    const double time_s = reader.snapshot->time_s;
    std::vector<Command> commands;
    for (int robot = 0; robot < robots; ++robot) commands.emplace_back(swing(robot, time_s));
    if (gripper)
      commands.emplace_back(GripperCommand{0, SimTime::from_seconds(time_s), GripperAction::close, 0.0, 0.0});
    if (reverse) std::reverse(commands.begin(), commands.end());
    for (const Command& command : commands) EXPECT_FALSE(loop.append(command, 1, monotonic_now_ns()));
    ++boundary;
  }
}

TEST_F(RunLoopTest, LockstepGivesTheBitsOfDirectSteps) {
  constexpr std::uint64_t kSteps = 400;
  const auto expected = direct_hashes(kSteps, 0.008, 2, true);
  for (const bool reverse : {false, true}) {
    hashes_.clear();
    simulation_.reset();
    start({.pace = Pace::lockstep, .state = SimulationState::paused, .pause_at_s = 0.4});
    expect_ok(
        reader_->request("register_controller",
                         {{"name", "plc"}, {"period", "0.008"}, {"targets", "Robot1,Robot2,Gripper1"}}));
    expect_ok(reader_->request("set_state", {{"state", "1"}}));
    answer_boundaries(*loop_, *reader_, kSteps, 0.008, 2, true, reverse);
    ASSERT_TRUE(reader_->wait_for_event("end_of_scenario"));
    loop_->stop();
    EXPECT_EQ(hashes_.rbegin()->second, expected);
    EXPECT_EQ(reader_->count("command_rejected"), 0U);
  }
}

/// Counts the instants that the loop writes itself, as an adapter would.
class CountingWriter final : public InstantWriter {
 public:
  explicit CountingWriter(LoopOutput& output) : output_(output) { output.instant_writer.set(this); }
  ~CountingWriter() { output_.instant_writer.set(nullptr); }
  void write_instant() override {
    ++count;
    output_.news.post();
  }
  std::atomic<int> count{0};

 private:
  LoopOutput& output_;
};

TEST_F(RunLoopTest, LockstepWritesInstantsAtBoundariesAndThoseOfAWatch) {
  constexpr int kSteps = 400;
  struct Case {
    const char* watch;  ///< period in s; nullptr: without
    int instants;       ///< beside those for observers
  };
  // Of the 40 multiples of 10 ms each fourth is a boundary.
  for (const auto& [watch, instants] :
       {Case{nullptr, kSteps / 8}, Case{"0.01", kSteps / 8 + 30}, Case{"0", kSteps}}) {
    simulation_.reset();
    start({.pace = Pace::lockstep, .state = SimulationState::paused, .pause_at_s = 1e-3 * kSteps});
    CountingWriter writer(loop_->output());
    expect_ok(
        reader_->request("register_controller",
                         {{"name", "plc"}, {"period", "0.008"}, {"targets", "Robot1,Robot2,Gripper1"}}));
    if (watch != nullptr)
      expect_ok(reader_->request("watch_instants", {{"period", watch}, {"duration", "3600"}}));
    writer.count = 0;  // without the first instant
    const std::int64_t began_ns = monotonic_now_ns();
    expect_ok(reader_->request("set_state", {{"state", "1"}}));
    answer_boundaries(*loop_, *reader_, kSteps, 0.008, 2, true, false);
    ASSERT_TRUE(reader_->wait_for_event("end_of_scenario"));
    loop_->stop();
    const auto for_observers =
        static_cast<int>((monotonic_now_ns() - began_ns) / InstantSchedule::kObservers_ns) + 1;
    EXPECT_GE(writer.count, instants);
    EXPECT_LE(writer.count, std::min(kSteps, instants + for_observers));
  }
}

TEST_F(RunLoopTest, CommandsAheadGiveTheBitsOfDirectStepsAndInstantsOnlyWhereTheyAreWaitedFor) {
  constexpr std::uint64_t kSteps = 400;
  for (const double period_s : {0.008, 0.0025}) {
    const auto boundaries = static_cast<std::uint64_t>(std::ceil(0.001 * kSteps / period_s - 1e-6));
    hashes_.clear();
    simulation_.reset();
    std::uint64_t sent = 0;
    int waits = 0;
    const auto time_s = [&](std::uint64_t boundary) {
      return static_cast<double>(period_boundary_step(boundary, period_s, 0.001)) * 0.001;
    };
    BatchesAhead batches([&] {
      if (sent == boundaries || loop_->present() < SimTime::from_seconds(time_s(sent))) return false;
      for (const std::uint64_t last = std::min(sent + kMostLookahead, boundaries); sent < last; ++sent) {
        for (int robot = 0; robot < 2; ++robot)
          EXPECT_FALSE(loop_->append(swing(robot, time_s(sent)), 1, monotonic_now_ns()));
        const GripperCommand close{0, SimTime::from_seconds(time_s(sent)), GripperAction::close, 0.0, 0.0};
        EXPECT_FALSE(loop_->append(close, 1, monotonic_now_ns()));
      }
      ++waits;
      return true;
    });
    start({.pace = Pace::lockstep, .state = SimulationState::paused, .pause_at_s = 0.4}, &batches);
    CountingWriter writer(loop_->output());
    expect_ok(reader_->request(
        "register_controller",
        {{"name", "plc"}, {"period", std::to_string(period_s)}, {"targets", "Robot1,Robot2,Gripper1"}}));
    writer.count = 0;
    const std::int64_t began_ns = monotonic_now_ns();
    batches.begin();
    expect_ok(reader_->request("set_state", {{"state", "1"}}));
    ASSERT_TRUE(reader_->wait_for_event("end_of_scenario"));
    loop_->stop();
    loop_->receive_with(nullptr);
    EXPECT_EQ(hashes_.rbegin()->second, direct_hashes(kSteps, period_s, 2, true));
    EXPECT_EQ(reader_->count("command_rejected"), 0U);
    EXPECT_EQ(waits, static_cast<int>((boundaries + kMostLookahead - 1) / kMostLookahead));
    const auto for_observers =
        static_cast<int>((monotonic_now_ns() - began_ns) / InstantSchedule::kObservers_ns) +
        static_cast<int>(0.001 * kSteps / InstantSchedule::kObservers_s) + 1;
    EXPECT_LE(writer.count, waits + for_observers);
  }
}

TEST_F(RunLoopTest, ASenderThatBeginsAgainDiscardsItsCommandsAhead) {
  start({.pace = Pace::lockstep, .state = SimulationState::paused, .pause_at_s = 0.04});
  expect_ok(
      reader_->request("register_controller", {{"name", "plc"}, {"period", "0.008"}, {"targets", "Robot1"}}));
  const auto send = [&](double time_s) {
    EXPECT_FALSE(loop_->append(swing(0, time_s), 1, monotonic_now_ns()));
  };
  for (const double time_s : {0.0, 0.008, 0.016, 0.024, 0.032}) send(time_s);
  send(0.0);  // discards those behind it
  expect_ok(reader_->request("set_state", {{"state", "1"}}));
  ASSERT_TRUE(reader_->wait_until([&] {
    return reader_->snapshot && reader_->snapshot->step == 8 && reader_->status &&
           reader_->status->waiting_count == 1;
  }));
  // Beyond the lookahead there is no room.
  send(0.008 + 0.008 * kMostLookahead);
  ASSERT_TRUE(reader_->wait_until([&] { return reader_->count("command_rejected") == 1; }));
  for (const double time_s : {0.008, 0.016, 0.024, 0.032}) send(time_s);
  ASSERT_TRUE(reader_->wait_for_event("end_of_scenario"));
  loop_->stop();
  EXPECT_EQ(hashes_.rbegin()->second, direct_hashes(40, 0.008, 1, false));
  EXPECT_EQ(reader_->count("command_rejected"), 1U);
}

TEST_F(RunLoopTest, CommandsAheadAreForgottenAtAReset) {
  start({.pace = Pace::lockstep, .state = SimulationState::paused, .pause_at_s = 0.04});
  expect_ok(
      reader_->request("register_controller", {{"name", "plc"}, {"period", "0.008"}, {"targets", "Robot1"}}));
  const auto send = [&](double time_s) {
    EXPECT_FALSE(loop_->append(swing(0, time_s), 1, monotonic_now_ns()));
  };
  for (const double time_s : {0.008, 0.016, 0.024}) send(time_s);
  expect_ok(reader_->request("reset", {{"scope", "255"}}));
  expect_ok(reader_->request("set_state", {{"state", "1"}}));
  send(0.0);
  ASSERT_TRUE(reader_->wait_until([&] { return reader_->snapshot && reader_->snapshot->step == 8; }));
  ASSERT_TRUE(reader_->wait_until([&] { return reader_->status && reader_->status->waiting_count == 1; }));
  loop_->stop();
  EXPECT_EQ(simulation_.step_index(), 8U);
}

TEST_F(RunLoopTest, CommandsAheadKeepTheirBoundariesAtAnotherPace) {
  start({.pace = Pace::lockstep, .state = SimulationState::paused, .pause_at_s = 0.04});
  expect_ok(
      reader_->request("register_controller", {{"name", "plc"}, {"period", "0.008"}, {"targets", "Robot1"}}));
  for (const double time_s : {0.0, 0.008, 0.016, 0.024, 0.032})
    EXPECT_FALSE(loop_->append(swing(0, time_s), 1, monotonic_now_ns()));
  (void)reader_->request("get_state");  // the loop has collected them
  expect_ok(reader_->request("set_pace", {{"pace", "free"}}));
  EXPECT_FALSE(loop_->append(swing(0, 0.0), 1, monotonic_now_ns()));
  for (const double time_s : {0.008, 0.016, 0.024, 0.032})
    EXPECT_FALSE(loop_->append(swing(0, time_s), 1, monotonic_now_ns()));
  (void)reader_->request("get_state");
  expect_ok(reader_->request("set_state", {{"state", "1"}}));
  ASSERT_TRUE(reader_->wait_for_event("end_of_scenario"));
  loop_->stop();
  EXPECT_EQ(hashes_.rbegin()->second, direct_hashes(40, 0.008, 1, false));
}

TEST_F(RunLoopTest, LockstepKeepsAPeriodThatIsNoMultipleOfTheStep) {
  constexpr std::uint64_t kSteps = 100;
  start({.pace = Pace::lockstep, .state = SimulationState::paused, .pause_at_s = 0.1});
  expect_ok(reader_->request("register_controller",
                             {{"name", "plc"}, {"period", "0.0025"}, {"targets", "Robot1"}}));
  expect_ok(reader_->request("set_state", {{"state", "1"}}));
  answer_boundaries(*loop_, *reader_, kSteps, 0.0025, 1, false, false);
  ASSERT_TRUE(reader_->wait_for_event("end_of_scenario"));
  loop_->stop();
  EXPECT_EQ(hashes_.rbegin()->second, direct_hashes(kSteps, 0.0025, 1, false));
}

TEST_F(RunLoopTest, LockstepWaitsForEveryTargetAndThenPauses) {
  start({.pace = Pace::lockstep, .state = SimulationState::paused});
  expect_ok(reader_->request(
      "register_controller",
      {{"name", "plc"}, {"period", "0.008"}, {"command_timeout", "3"}, {"targets", "Robot1,Gripper1"}}));
  expect_ok(reader_->request("set_state", {{"state", "1"}}));
  EXPECT_FALSE(loop_->append(swing(0, 0.0), 1, monotonic_now_ns()));
  ASSERT_TRUE(reader_->wait_until([&] {
    return reader_->status && reader_->status->waiting_count == 1 &&
           reader_->status->waiting_for[0].view() == "plc";
  }));
  const auto late = reader_->wait_for_event("controller_late");
  ASSERT_TRUE(late);
  EXPECT_EQ(describe(*late, loop_->cell()).subject, "plc");
  EXPECT_NE(describe(*late, loop_->cell()).message.find("for Gripper1 at the boundary 0 s"),
            std::string::npos);
  ASSERT_TRUE(reader_->wait_for_event("controller_timeout"));
  EXPECT_EQ(test::value_of(reader_->request("get_state"), "state"), "paused");
  EXPECT_EQ(reader_->count("controller_late"), 1U);
  loop_->stop();
  EXPECT_EQ(simulation_.step_index(), 0U);
}

TEST_F(RunLoopTest, EachOfSeveralLateControllersIsNamed) {
  start({.pace = Pace::lockstep, .state = SimulationState::paused});
  for (const char* robot : {"Robot1", "Robot2"})
    expect_ok(reader_->request("register_controller", {{"name", std::string("of_") + robot},
                                                       {"period", "0.008"},
                                                       {"command_timeout", "3"},
                                                       {"targets", robot}}));
  expect_ok(reader_->request("set_state", {{"state", "1"}}));
  const auto named = [&](std::string_view code) {
    std::set<std::string> names;
    for (const EventRecord& event : reader_->events)
      if (info_of(event).code == code) names.emplace(describe(event, loop_->cell()).subject);
    return names;
  };
  const std::set<std::string> both{"of_Robot1", "of_Robot2"};
  EXPECT_TRUE(reader_->wait_until([&] { return named("controller_timeout") == both; }));
  EXPECT_EQ(named("controller_late"), both);
  EXPECT_EQ(reader_->count("controller_late"), 2U);
  EXPECT_EQ(test::value_of(reader_->request("get_state"), "state"), "paused");
}

TEST_F(RunLoopTest, RequestsToAHeldLoopWaitForItsRelease) {
  start({.state = SimulationState::paused});
  for (int round = 0; round < 300; ++round) {
    expect_ok(reader_->request("set_state", {{"state", "2"}}));
    std::uint64_t play = 0;
    std::thread asking([&] { play = reader_->submit("set_state", {{"state", "1"}}); });
    const auto held = loop_->suspend();
    asking.join();
    ASSERT_TRUE(held.has_value());
    // Either it was executed earlier, and the holder of the loop sees it, or it is executed afterwards.
    reader_->read();
    const bool answered = std::any_of(reader_->replies.begin(), reader_->replies.end(),
                                      [&](const ControlReply& reply) { return reply.id == play; });
    EXPECT_EQ(answered, *held == SimulationState::playing) << "round " << round;
    loop_->resume();
    ASSERT_TRUE(reader_->reply_to(play));
  }
}

TEST_F(RunLoopTest, LockstepWithoutAControllerWaitsAndReportsIt) {
  start({.pace = Pace::lockstep});
  ASSERT_TRUE(reader_->wait_until([&] { return reader_->status && reader_->status->waiting_count == 1; }));
  EXPECT_EQ(reader_->status->waiting_for[0].view(), "(no controller is registered)");
  EXPECT_EQ(reader_->status->step, 0U);
}

TEST_F(RunLoopTest, LockstepRefusesOtherStampsAndOtherTargets) {
  start({.pace = Pace::lockstep, .state = SimulationState::paused});
  expect_ok(
      reader_->request("register_controller", {{"name", "plc"}, {"period", "0.008"}, {"targets", "Robot1"}}));
  expect_ok(reader_->request("set_state", {{"state", "1"}}));
  EXPECT_FALSE(loop_->append(swing(0, 0.004), 1, monotonic_now_ns()));  // between the boundaries
  EXPECT_FALSE(loop_->append(swing(1, 0.0), 1, monotonic_now_ns()));    // no controller declared Robot2
  ASSERT_TRUE(reader_->wait_until([&] { return reader_->count("command_rejected") == 2; }));
  const auto reason = [&](std::size_t from_the_end) {
    const std::string sentence =
        describe(reader_->events[reader_->events.size() - from_the_end], loop_->cell()).message;
    return sentence.substr(0, sentence.find(':'));
  };
  EXPECT_EQ(reason(2), to_string(RejectionCode::out_of_range));
  EXPECT_EQ(reason(1), to_string(RejectionCode::invalid_request));
  EXPECT_FALSE(loop_->append(swing(0, 0.0), 1, monotonic_now_ns()));
  ASSERT_TRUE(reader_->wait_until([&] { return reader_->snapshot && reader_->snapshot->step == 8; }));
  EXPECT_FALSE(
      loop_->append(swing(0, 0.0), 2, monotonic_now_ns()));  // the crossed boundary again: no harm, no event
  EXPECT_FALSE(loop_->append(swing(0, 0.004), 3, monotonic_now_ns()));
  ASSERT_TRUE(reader_->wait_until([&] { return reader_->count("command_rejected") == 3; }));
  EXPECT_EQ(reason(1), to_string(RejectionCode::stale));
  EXPECT_NE(describe(reader_->events.back(), loop_->cell()).message.find("stamped 0.004 s"),
            std::string::npos);
  loop_->stop();
  EXPECT_EQ(simulation_.step_index(), 8U);
}

TEST_F(RunLoopTest, AnAnswerThatWasSentTwiceIsNoFaultWhereItsControllerHasLeft) {
  start({.pace = Pace::lockstep, .state = SimulationState::paused});
  expect_ok(
      reader_->request("register_controller", {{"name", "plc"}, {"period", "0.008"}, {"targets", "Robot1"}}));
  expect_ok(reader_->request("set_state", {{"state", "1"}}));
  const auto send = [&](double time_s, std::uint64_t sender) {
    EXPECT_FALSE(loop_->append(swing(0, time_s), sender, monotonic_now_ns()));
  };
  for (const double time_s : {0.0, 0.008}) send(time_s, 1);
  ASSERT_TRUE(reader_->wait_until([&] { return reader_->snapshot && reader_->snapshot->step == 16; }));
  expect_ok(reader_->request("unregister_controller", {{"name", "plc"}}));
  send(0.008, 1);
  // Those of another sender, and for the present time, are faults.
  send(0.008, 2);
  send(0.016, 1);
  ASSERT_TRUE(reader_->wait_until([&] { return reader_->count("command_rejected") == 2; }));
  loop_->stop();
  EXPECT_EQ(reader_->count("command_rejected"), 2U);
}

TEST_F(RunLoopTest, AnAnswerThatWasSentTwiceIsNoFaultBehindAReset) {
  start({.pace = Pace::lockstep, .state = SimulationState::paused});
  expect_ok(
      reader_->request("register_controller", {{"name", "plc"}, {"period", "0.008"}, {"targets", "Robot1"}}));
  expect_ok(reader_->request("set_state", {{"state", "1"}}));
  const auto send = [&](double time_s, std::uint64_t sender) {
    EXPECT_FALSE(loop_->append(swing(0, time_s), sender, monotonic_now_ns()));
  };
  for (const double time_s : {0.0, 0.008}) send(time_s, 1);
  ASSERT_TRUE(reader_->wait_until([&] { return reader_->snapshot && reader_->snapshot->step == 16; }));
  expect_ok(reader_->request("unregister_controller", {{"name", "plc"}}));
  expect_ok(reader_->request("reset", {}));
  send(0.008, 1);
  send(0.008, 2);  // of another sender
  ASSERT_TRUE(reader_->wait_until([&] { return reader_->count("command_rejected") == 1; }));
  send(0.016, 1);  // it answered no such state
  ASSERT_TRUE(reader_->wait_until([&] { return reader_->count("command_rejected") == 2; }));
  loop_->stop();
  EXPECT_EQ(reader_->count("command_rejected"), 2U);
}

TEST_F(RunLoopTest, OneTargetHasOneController) {
  start({.pace = Pace::free, .state = SimulationState::paused});
  const test::TextArguments first{{"name", "a"}, {"period", "0.008"}, {"targets", "Robot1"}};
  expect_ok(reader_->request("register_controller", first));
  expect_ok(reader_->request("register_controller", first));  // the same one again
  const ControlReply second =
      reader_->request("register_controller", {{"name", "b"}, {"period", "0.008"}, {"targets", "Robot1"}});
  EXPECT_EQ(second.result, ControlResult::failed);
  EXPECT_NE(second.message.find("already declared by the controller 'a'"), std::string::npos)
      << second.message;
  expect_ok(reader_->request("unregister_controller", {{"name", "a"}}));
  EXPECT_EQ(reader_->request("unregister_controller", {{"name", "a"}}).result, ControlResult::not_found);
}

TEST(RunLoopFault, AFaultPausesTheLoopAndAResetClearsIt) {
  // Parts that fall far faster than the gravity of the cell lets them.
  const auto model = test::service_model();
  model->interaction.weight_feed_forward = false;
  for (RigidBodyParameters& part : model->parts) part.gravity_W.z() = -1e30;
  Simulation simulation(model);
  RunLoop loop(simulation, {.pace = Pace::free});
  LoopReader reader(loop);
  loop.start();
  const auto fault = reader.wait_for_event("simulation_fault");
  ASSERT_TRUE(fault);
  EXPECT_NE(describe(*fault, loop.cell()).message.find("gains energy without a cause"), std::string::npos);
  ASSERT_TRUE(reader.wait_until([&] { return reader.status && !reader.status->fault.empty(); }));
  EXPECT_EQ(reader.status->state, SimulationState::paused);
  EXPECT_EQ(reader.request("set_state", {{"state", "1"}}).result, ControlResult::incorrect_state);
  EXPECT_EQ(reader.request("step").result, ControlResult::incorrect_state);
  EXPECT_EQ(reader.request("reset").result, ControlResult::ok);
  ASSERT_TRUE(reader.wait_until([&] { return reader.status->fault.empty() && reader.status->step == 0; }));
  EXPECT_EQ(reader.request("step").result, ControlResult::ok);
}

TEST_F(RunLoopTest, ThePaceRealtimeFollowsTheClock) {
  start({.pace = Pace::realtime, .factor = 2.0, .pause_at_s = 0.5});
  ASSERT_TRUE(reader_->wait_for_event("end_of_scenario"));
  // Never faster than the clock: half a second at factor 2.
  loop_->stop();
  ASSERT_TRUE(reader_->wait_until([&] { return reader_->status->state == SimulationState::quitting; }));
  EXPECT_GE(reader_->status->wall_time_s, 0.249);
  EXPECT_EQ(simulation_.step_index(), 500U);
}

TEST_F(RunLoopTest, TheLoopQuitsOnRequest) {
  std::atomic<bool> reported{false};
  loop_ = std::make_unique<RunLoop>(simulation_, RunLoopOptions{.state = SimulationState::paused});
  reader_ = std::make_unique<LoopReader>(*loop_);
  loop_->set_on_quit([&] { reported = true; });
  loop_->start();
  expect_ok(reader_->request("set_state", {{"state", "3"}}));
  loop_->stop();
  EXPECT_TRUE(reported);
  EXPECT_TRUE(loop_->quitting());
}

}  // namespace
}  // namespace takt
