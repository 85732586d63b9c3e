// Random commands and requests through the step loop, recorded and replayed: the same bits. Logs that are
// torn are good up to their last whole record, altered ones are refused, and a disk that is full costs the
// log only.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <random>

#include "idl/common/text.h"
#include "server/runtime/host/replay.h"
#include "server/runtime/recording/log_recorder.h"
#include "tests/support/loop_reader.h"
#include "tests/support/service_cell.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/test_device.h"

namespace takt::test {
namespace {

std::string read_bytes(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}
void write_bytes(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

RecorderOptions options(std::size_t checkpoint_every = 100) {
  RecorderOptions result;
  result.version = "takt-server test";
  result.cell = "cell";
  result.checkpoint_every = checkpoint_every;
  return result;
}

ReplayResult replay_of(const std::filesystem::path& file, const std::shared_ptr<const CellModel>& model) {
  ReplayOptions replay_options;
  replay_options.load = [&](const LogScenario&) { return model; };
  return replay(file, replay_options);
}

/// With a device, and a robot that brakes when its set-points stay away.
std::shared_ptr<CellModel> recorded_model() {
  const auto model = service_model();
  add_chamber(*model);
  model->description.robots[0].command_deadline = {0.02, SafeAction::stop, {5.0, 5.0, 5.0, 5.0, 5.0, 5.0}};
  return model;
}

Command trajectory(const CellDescription& cell, double first, double time_s, bool with_velocities,
                   bool with_efforts) {
  RawTrajectory raw;
  for (const JointModel& joint : cell.robots[0].arm.joints) raw.names.push_back(joint.name);
  const auto point = [&](double q, double t) {
    const JointCommand at = swing(0, q);
    RawTrajectoryPoint result{{at.position.begin(), at.position.end()}, {}, {}, {}, t};
    result.positions.resize(raw.names.size());
    if (with_efforts) result.effort.assign(raw.names.size(), 100.0 * q);
    if (with_velocities) result.velocities.assign(raw.names.size(), 0.0);
    raw.points.push_back(result);
  };
  point(first, 0.5 * time_s);
  point(0.5 * first, time_s);
  return std::get<TrajectoryCommand>(validate(cell, 0, raw));
}

/// A random course of a cell. Returns the hash at the end.
std::uint64_t random_run(const std::shared_ptr<const CellModel>& model, LogRecorder* recorder, unsigned seed,
                         int actions, bool from_the_middle = false) {
  std::mt19937 dice(seed);
  const auto below = [&](unsigned n) { return dice() % n; };
  Simulation simulation(model);
  RunLoopOptions loop_options;
  loop_options.pace = Pace::free;
  loop_options.state = SimulationState::paused;
  RunLoop loop(simulation, loop_options);
  LoopReader reader(loop);
  const auto begin = [&](bool at_its_beginning) {
    if (recorder == nullptr) return;
    EXPECT_EQ(recorder->begin_scenario({}, simulation, at_its_beginning), "");
    loop.record_with(recorder);
  };
  if (!from_the_middle) begin(true);
  loop.start();
  SavedState saved;
  for (int i = 0; i < actions; ++i) {
    if (from_the_middle && i == actions / 2) {
      EXPECT_TRUE(loop.between_steps([&] { begin(false); }));
    }
    switch (below(14)) {
      case 0:
        reader.request("attach", {{"part", "P"}, {"to", below(2) == 0 ? "Gripper1" : "C"}});
        break;
      case 1:
        reader.request("detach", {{"part", "P"}});
        break;
      case 2:
        reader.request(
            "set_entity_state",
            {{"entity", "C"},
             {"position", "0.3 " + exact_text(-0.2 + 1e-4 * static_cast<double>(below(100))) + " 0.71"},
             {"linear_velocity", "0 0.01 0"}});
        break;
      case 3:
        if (below(4) == 0) reader.request("reset");
        break;
      case 4:
        reader.request("set_level_of_detail", {{"level_of_detail", below(2) == 0 ? "1" : "2"}});
        break;
      case 5:
        EXPECT_TRUE(loop.between_steps([&] { EXPECT_EQ(loop.saver().save(saved), ""); }));
        break;
      case 6:
        if (!saved.bytes.empty()) {
          EXPECT_TRUE(loop.between_steps([&] { EXPECT_EQ(loop.restore(saved.bytes), ""); }));
        }
        break;
      case 11:
        reader.request("force_signal",
                       {{"signal", below(2) == 0 ? "Gripper1.close" : "Gripper2.part_present"},
                        {"value", below(2) == 0 ? "1" : "0"}});
        break;
      case 12:
        reader.request("release_signal", {{"signal", "all"}});
        break;
      case 13:
        reader.request("set_inputs", {{"inputs", "Gripper1.close, Gripper2.set_width"},
                                      {"values", below(2) == 0 ? "1 0.02" : "0 0.01"}});
        break;
      case 8: {
        if (simulation.description().devices.empty()) break;
        DeviceCommand command;
        command.device = 0;
        command.count = 2;
        command.signals = {WarmChamber::lamp, WarmChamber::set_point};
        command.values = {static_cast<double>(below(2)), 20.0 + static_cast<double>(below(200))};
        (void)loop.append(command, 1, monotonic_now_ns());
        break;
      }
      case 9:
        (void)loop.append(
            trajectory(loop.cell(), 1e-3 * static_cast<double>(below(40)),
                       0.05 + 1e-3 * static_cast<double>(below(100)), below(2) == 0, below(2) == 0),
            1, monotonic_now_ns());
        break;
      case 7: {
        GripperCommand command;
        command.gripper = static_cast<int>(below(2));
        command.action = static_cast<GripperAction>(below(2));
        (void)loop.append(command, 1, monotonic_now_ns());
        break;
      }
      default: {
        JointCommand command = swing(static_cast<int>(below(2)), 1e-3 * static_cast<double>(below(40)));
        command.stamp = {};
        command.has_effort = below(2) == 0;
        if (command.has_effort) command.effort[below(6)] = static_cast<double>(below(20)) - 10.0;
        if (command.has_effort && below(3) == 0) {
          const int robot = command.robot;
          command = {};
          command.robot = robot, command.has_effort = true, command.torque_mode = true;
          command.effort[0] = static_cast<double>(below(20)) - 10.0;
        }
        (void)loop.append(command, 1, monotonic_now_ns());
      }
    }
    reader.request("step", {{"steps", std::to_string(1 + below(60))}});
  }
  loop.stop();
  return simulation.state_hash();
}

int records_of(const std::filesystem::path& file, LogKind kind) {
  LogReader reader(file);
  LogEntry entry;
  int count = 0;
  while (reader.next(entry)) count += entry.kind == kind ? 1 : 0;
  return count;
}

TEST(Recording, RandomCommandsAndRequestsAreReplayedWithTheSameBits) {
  const TemporaryDirectory directory;
  const auto model = recorded_model();
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const auto file = directory / ("run" + std::to_string(seed));
    const bool from_the_middle = seed % 3 == 0;
    std::uint64_t hash = 0;
    {
      LogRecorder recorder(file, options(seed % 2 == 0 ? 100 : 1));
      hash = random_run(model, &recorder, seed, 90, from_the_middle);
      EXPECT_FALSE(recorder.failed()) << recorder.failure();
    }
    EXPECT_EQ(random_run(model, nullptr, seed, 90, from_the_middle), hash) << "recording changes nothing";
    const ReplayResult result = replay_of(file, model);
    EXPECT_EQ(result.difference, "") << seed;
    EXPECT_EQ(result.early_end, "");
    EXPECT_TRUE(result.complete);
    EXPECT_EQ(result.state_hash, hash);
    EXPECT_GT(result.commands, 0U);
    EXPECT_GT(result.requests, 3U);
    for (const LogKind kind : {LogKind::trajectory_command, LogKind::device_command, LogKind::deadlines})
      EXPECT_GT(records_of(file, kind), 0) << static_cast<int>(kind);
    EXPECT_EQ(result.version, "takt-server test");
  }
}

/// The same records, with the first joint command altered by one bit; returns its step.
std::uint64_t with_another_command(const std::filesystem::path& from, const std::filesystem::path& to) {
  LogReader reader(from);
  LogFraming framing;
  std::vector<std::byte> bytes = LogFraming::file_head();
  LogEntry entry;
  std::uint64_t altered = 0;
  bool done = false;
  while (reader.next(entry)) {
    std::vector<std::byte> content(9);
    content[0] = static_cast<std::byte>(entry.kind);
    std::memcpy(&content[1], &entry.step, sizeof(entry.step));
    if (entry.kind == LogKind::joint_command && !done) {
      // A middle bit of the second joint.
      constexpr std::size_t kBeforePositions = 4 + 8 + 8 + 1 + 1;
      entry.content[kBeforePositions + 8 + 4] ^= std::byte{1};
      altered = entry.step;
      done = true;
    }
    content.insert(content.end(), entry.content.begin(), entry.content.end());
    framing.append(bytes, content);
  }
  EXPECT_TRUE(done);
  write_bytes(to, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  return altered;
}

TEST(Recording, AReplayReportsTheFirstDifferenceAndRefusesOtherModels) {
  const TemporaryDirectory directory;
  const auto model = service_model();
  const auto file = directory / "run";
  {
    LogRecorder recorder(file, options(1000));
    random_run(model, &recorder, 22, 40);
  }
  const std::uint64_t altered = with_another_command(file, directory / "altered");
  const ReplayResult result = replay_of(directory / "altered", model);
  EXPECT_NE(result.difference, "");
  EXPECT_GT(result.different_step, altered);
  EXPECT_LE(result.different_step, altered + 10);  // it shows where the last bit of a set-point matters

  auto heavier = std::make_shared<CellModel>(*model);
  heavier->description.scenario = "another";
  try {
    replay_of(file, heavier);
    ADD_FAILURE() << "another scenario was replayed";
  } catch (const LogError& error) {
    EXPECT_NE(std::string(error.what()).find("'service_test'"), std::string::npos) << error.what();
  }
  try {
    replay_of(file, service_contact_model());
    ADD_FAILURE() << "another model was replayed";
  } catch (const LogError& error) {
    EXPECT_NE(std::string(error.what()).find("another model"), std::string::npos) << error.what();
  }
}

TEST(Recording, AnotherFormatIsRefusedWithAReason) {
  const TemporaryDirectory directory;
  const auto file = directory / "run";
  {
    LogRecorder recorder(file, options());
    random_run(service_model(), &recorder, 4, 3);
  }
  std::string bytes = read_bytes(file);
  bytes[8] = 1;  // the format, behind eight letters; of logs without efforts
  write_bytes(file, bytes);
  try {
    LogReader reader(file);
    ADD_FAILURE() << "a log of another format was read";
  } catch (const LogError& error) {
    EXPECT_NE(std::string(error.what()).find("has format 1; this program reads format 4"), std::string::npos)
        << error.what();
  }
}

TEST(Recording, TornFilesAreReadToTheLastWholeRecordAndFlippedBytesRefused) {
  const TemporaryDirectory directory;
  const auto file = directory / "run", damaged = directory / "damaged";
  {
    LogRecorder recorder(file, options(10));
    random_run(service_model(), &recorder, 5, 25);
  }
  const std::string whole = read_bytes(file);
  std::vector<std::uint64_t> ends;  // of the whole records
  {
    LogReader reader(file);
    LogEntry entry;
    ends.push_back(reader.read_bytes());
    while (reader.next(entry)) ends.push_back(reader.read_bytes());
    EXPECT_FALSE(reader.torn());
    EXPECT_EQ(ends.back(), whole.size());
    ASSERT_GT(ends.size(), 30U);
  }
  std::mt19937 dice(3);
  for (int i = 0; i < 1000; ++i) {
    const std::size_t cut = dice() % whole.size();
    write_bytes(damaged, whole.substr(0, cut));
    LogReader reader(damaged);
    LogEntry entry;
    std::size_t records = 0;
    while (reader.next(entry)) ++records;
    const auto after = std::upper_bound(ends.begin(), ends.end(), cut);
    const std::size_t expected =
        after == ends.begin() ? 0 : static_cast<std::size_t>(after - ends.begin()) - 1;
    ASSERT_EQ(records, expected) << cut;
    const bool at_an_end = after != ends.begin() && *(after - 1) == cut;
    ASSERT_EQ(reader.torn(), !at_an_end) << cut;
  }
  for (int i = 0; i < 1000; ++i) {
    std::string flipped = whole;
    const std::size_t at = dice() % whole.size();
    flipped[at] = static_cast<char>(flipped[at] ^ (1 << (dice() % 8)));
    write_bytes(damaged, flipped);
    EXPECT_THROW(
        {
          LogReader reader(damaged);
          LogEntry entry;
          while (reader.next(entry)) {
          }
        },
        LogError)
        << at;
  }
}

TEST(Recording, AFullDiskIsReportedAndTheSimulationContinues) {
  const auto model = service_model();
  std::string reported;
  RecorderOptions full = options(1);
  full.replace = true;
  full.on_failure = [&](const std::string& sentence) { reported = sentence; };
  LogRecorder recorder("/dev/full", full);
  EXPECT_EQ(random_run(model, &recorder, 2, 20), random_run(model, nullptr, 2, 20));
  recorder.flush();
  EXPECT_TRUE(recorder.failed());
  EXPECT_NE(reported.find("/dev/full"), std::string::npos);
  EXPECT_NE(reported.find("No space left"), std::string::npos) << reported;
}

TEST(Recording, ARingThatOverflowsEndsTheLogWithAMark) {
  const TemporaryDirectory directory;
  const auto model = service_model();
  RecorderOptions small = options(1);
  small.ring = 150;  // a scenario fits, a command does not
  std::string reported;
  small.on_failure = [&](const std::string& sentence) { reported = sentence; };
  {
    LogRecorder recorder(directory / "run", small);
    Simulation simulation(model);
    ASSERT_EQ(recorder.begin_scenario({}, simulation, true), "");
    const std::vector<Command> batch{swing(0, 0.0), swing(1, 0.0)};
    for (int i = 0; i < 10; ++i) {
      recorder.commands(simulation, batch);
      ASSERT_TRUE(simulation.step(batch));
      recorder.stepped(simulation);
    }
    recorder.flush();
    EXPECT_TRUE(recorder.failed());
  }
  EXPECT_NE(reported.find("lost"), std::string::npos);
  const ReplayResult result = replay_of(directory / "run", model);
  EXPECT_EQ(result.difference, "");
  EXPECT_FALSE(result.complete);
  EXPECT_NE(result.early_end, "");
}

}  // namespace
}  // namespace takt::test
