// Refusals of the host of a cell: without a scenario, with a cell without a file, after the end of the
// simulation, without directories to write to, or with read-only ones.
#include "server/runtime/host/cell_host.h"

#include <gtest/gtest.h>

#include <atomic>

#include "server/runtime/host/replay.h"
#include "server/scenario/scenario_builder.h"
#include "tests/support/host_reader.h"

namespace takt::test {
namespace {

using Result = ControlResult;

/// A host of its own for each test, made when its options are known.
class Hosted : public testing::Test {
 protected:
  void begin() {
    host_.emplace(options_);
    reader_.emplace(*host_);
    host_->set_on_quit([this] { quits_.fetch_add(1); });
  }
  void open() {
    begin();
    host_->open(ScenarioSource{file_, source_options_});
  }
  ControlReply request(const std::string& name, const TextArguments& arguments = {}) {
    return reader_->request(name, arguments);
  }

  const TemporaryDirectory directory_;
  const std::filesystem::path file_ = write_two_cubes(directory_);
  HostOptions options_ = free_running();
  ScenarioOptions source_options_;
  std::atomic<int> quits_{0};
  std::optional<CellHost> host_;
  std::optional<HostReader> reader_;
};

TEST_F(Hosted, AHostWithoutAScenarioAnswersGeneralRequests) {
  begin();
  expect_reply(request("spawn_entity", {{"name", "X"}, {"copy_of", "A"}, {"position", "9 9 9"}}),
               Result::incorrect_state, "The server is loading its first scenario");
  expect_reply(request("reset"), Result::incorrect_state, "A scenario is being loaded; ask again");
  EXPECT_EQ(value_of(request("get_state"), "state"), to_string(SimulationState::loading_scenario));
  host_->open_empty();
  EXPECT_EQ(value_of(request("get_state"), "state"), to_string(SimulationState::no_scenario));
  ASSERT_TRUE(host_->idle_status().has_value());
  EXPECT_EQ(host_->idle_status()->pace, Pace::free);
  EXPECT_EQ(host_->loop(), nullptr);
  EXPECT_EQ(host_->simulation(), nullptr);
  EXPECT_EQ(request("get_features").result, Result::ok);
  expect_reply(request("dance"), Result::unsupported, "dance");
  const char* nothing_loaded = "No scenario is loaded; load_scenario loads one.";
  for (const char* name : {"reset", "get_entities"})
    expect_reply(request(name), Result::incorrect_state, nothing_loaded);
  expect_reply(request("spawn_entity", {{"name", "X"}, {"copy_of", "A"}, {"position", "9 9 9"}}),
               Result::incorrect_state, nothing_loaded);
  expect_reply(request("delete_entity", {{"entity", "A"}}), Result::incorrect_state, nothing_loaded);
  expect_reply(request("watch_pressures", {{"pairs", "*"}}), Result::incorrect_state, nothing_loaded);
  expect_reply(request("unload_scenario"), Result::no_scenario_loaded, "No scenario is loaded.");
  expect_reply(request("reload_scenario"), Result::no_scenario_loaded, "there is no file to load again");
  expect_reply(request("set_state", {{"state", "3"}}), Result::ok, "The server ends.");
  EXPECT_EQ(quits_.load(), 1);
}

/// Asks for a step as soon as a scenario is published.
class AsksAtOnce final : public CellLifecycleListener {
 public:
  explicit AsksAtOnce(CellHost& host) : host_(host) {}
  void check(const CellDescription&) override {}
  void opened(RunLoop&) override { host_.submit(text_request(1000, "step", {{"steps", "3"}})); }
  void closed(RunLoop&) override {}
  void idle(const CellDescription&) override {}

 private:
  CellHost& host_;
};

TEST_F(Hosted, RequestsAreServedFromThePublicationOfAScenarioOn) {
  begin();
  AsksAtOnce asks(*host_);
  host_->set_listener(&asks);
  host_->open(ScenarioSource{file_, source_options_});
  for (const char* exchange : {"open", "reload_scenario"}) {
    SCOPED_TRACE(exchange);
    if (exchange != std::string("open")) request(exchange);
    const ControlReply* stepped = nullptr;
    ASSERT_TRUE(reader_->wait_until([&] {
      for (const ControlReply& reply : reader_->replies)
        if (reply.id == 1000) stepped = &reply;
      return stepped != nullptr;
    }));
    EXPECT_EQ(stepped->result, Result::ok) << stepped->message;
    reader_->replies.clear();
  }
  host_->stop();
}

TEST_F(Hosted, TheHostLoadsUnloadsAndEnds) {
  options_.threads = 2;  // with a pool for the collision checks
  open();
  EXPECT_FALSE(host_->idle_status().has_value());
  EXPECT_EQ(host_->loop()->cell().scenario_generation, 1U);
  const ControlReply loaded = request("reload_scenario");
  expect_reply(loaded, Result::ok, "Scenario cubes is loaded: 2 components, 0 robots");
  EXPECT_EQ(value_of(loaded, "scenario_generation"), "2");
  EXPECT_EQ(reader_->event("scenario_loaded").message, loaded.message);
  expect_reply(request("unload_scenario"), Result::ok, "Scenario cubes was unloaded; no scenario is loaded.");
  EXPECT_EQ(host_->loop(), nullptr);
  host_->stop();
  expect_reply(request("reload_scenario"), Result::incorrect_state, "The server is ending");
}

TEST_F(Hosted, RefusedFilesHaveTheKindOfMistake) {
  begin();
  host_->open_empty();
  const auto load = [&](const std::string& name) {
    return request("load_scenario", {{"uri", (directory_ / name).string()}});
  };
  const auto part = [](const std::string& mesh) {
    return "takt_scenario: 1\nname: x\nparts:\n  A: {mesh: " + mesh + ", mass_kg: 1, hierarchy: 1}\n";
  };
  directory_.write("wrong.yaml", "takt_scenario: 1\nname: x\nduration: 1\n");
  directory_.write("lacking.yaml", part("gone.obj"));
  directory_.write("bad.yaml", part("bad.obj"));
  directory_.write("bad.obj", "v 0 0 0\nv 1 0 0\nf 1 2\n");
  directory_.write("robot.yaml",
                   "takt_scenario: 1\nname: x\nrobots:\n  R: {urdf: r.urdf, initial_joints_rad: []}\n");
  directory_.write("r.urdf", "<robot name='r'><link name='base_link'/></robot>");
  expect_reply(load("none.yaml"), Result::not_found, "none.yaml, seen from the working directory");
  expect_reply(load("wrong.yaml"), Result::resource_parse_error, "wrong.yaml:3:1: duration");
  expect_reply(load("lacking.yaml"), Result::missing_assets, "lacking.yaml:4:");
  expect_reply(load("bad.yaml"), Result::unsupported_assets, "bad.obj");
  expect_reply(load("robot.yaml"), Result::unsupported_assets, "r.urdf");
  EXPECT_EQ(reader_->event("scenario_refused").severity, Severity::warning);
  EXPECT_EQ(host_->loop(), nullptr);
}

TEST_F(Hosted, NotesOfImportsAreReported) {
  // The cube with one face turned: repaired and reported.
  directory_.write(
      "cube.obj",
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
      "f 1 3 4\nf 1 3 2\nf 5 6 7\nf 5 7 8\nf 1 2 6\nf 1 6 5\nf 2 3 7\nf 2 7 6\nf 3 4 8\nf 3 8 7\n"
      "f 4 1 5\nf 4 5 8\n");
  std::vector<std::string> notes;
  options_.on_note = [&notes](const std::string& sentence) { notes.push_back(sentence); };
  open();
  const DiagnosticEvent note = reader_->event("import_note");
  EXPECT_EQ(note.subject, "A");
  ASSERT_FALSE(notes.empty());
  EXPECT_EQ(notes.front(),
            note.message + " So it is with B.");  // one sentence for both components of this mesh
}

TEST_F(Hosted, ACellWithoutAFileIsNeitherChangedNorReloaded) {
  options_.recordings = directory_ / "recordings";
  begin();
  host_->open(load_cell(file_));
  const char* no_file = "The loaded cell came from no scenario file; nothing can be spawned or deleted.";
  expect_reply(request("spawn_entity", {{"name", "X"}, {"copy_of", "A"}, {"position", "9 9 9"}}),
               Result::incorrect_state, no_file);
  expect_reply(request("delete_entity", {{"entity", "A"}}), Result::incorrect_state, no_file);
  expect_reply(request("reload_scenario"), Result::no_scenario_loaded, "loaded from a file");
  // The recording notes it, and its replay needs the scenario as an argument.
  ASSERT_EQ(request("start_recording", {{"name", "r"}}).result, Result::ok);
  ASSERT_EQ(request("stop_recording").result, Result::ok);
  ReplayOptions options;
  options.load = [](const LogScenario& logged) { return load_logged_scenario(logged, {}); };
  try {
    static_cast<void>(replay(options_.recordings / "r.taktlog", options));
    ADD_FAILURE() << "it was replayed";
  } catch (const LogError& error) {
    EXPECT_NE(std::string(error.what()).find("'cubes' came from no scenario file"), std::string::npos)
        << error.what();
  }
}

TEST_F(Hosted, PartsComeAndGoOnlyInAStoppedCell) {
  open();
  expect_reply(request("spawn_entity", {{"name", "X"}, {"copy_of", "A"}, {"position", "9 9 9"}}),
               Result::incorrect_state,
               "only while the simulation is stopped (set_state stopped, which resets it); it is paused.");
  ASSERT_EQ(request("set_state", {{"state", "0"}}).result, Result::ok);
  directory_.write("bad.obj", "v 0 0 0\nv 1 0 0\nf 1 2\n");
  expect_reply(
      request(
          "spawn_entity",
          {{"name", "X"}, {"uri", (directory_ / "bad.obj").string()}, {"mass", "1"}, {"position", "9 9 9"}}),
      Result::spawn_parse_error, "bad.obj");
  const ControlReply spawned =
      request("spawn_entity", {{"name", "X"}, {"copy_of", "A"}, {"position", "9 9 9"}});
  expect_reply(spawned, Result::ok, "X is there now.");
  EXPECT_EQ(value_of(spawned, "scenario_generation"), "2");
  expect_reply(request("delete_entity", {{"entity", "B"}}), Result::ok, "B is gone.");
  ASSERT_EQ(request("set_state", {{"state", "1"}}).result, Result::ok);
  expect_reply(request("reset", {{"scope", "4"}}), Result::incorrect_state, "it is playing");
  ASSERT_EQ(request("set_state", {{"state", "0"}}).result, Result::ok);
  const ControlReply reset = request("reset", {{"scope", "4"}});
  expect_reply(reset, Result::ok, "Spawned Parts are removed, and deleted Parts are back.");
  EXPECT_EQ(reader_->event("reset").message, reset.message);
  EXPECT_EQ(host_->loop()->cell().find_component("X"), -1);
  EXPECT_GE(host_->loop()->cell().find_component("B"), 0);
}

TEST_F(Hosted, AResetOfAllRestoresTheScenarioAndContinuesPlaying) {
  open();
  ASSERT_EQ(request("set_state", {{"state", "0"}}).result, Result::ok);
  ASSERT_EQ(request("delete_entity", {{"entity", "B"}}).result, Result::ok);
  ASSERT_EQ(request("set_state", {{"state", "1"}}).result, Result::ok);
  expect_reply(request("reset"), Result::ok, "with the Parts of its scenario");
  EXPECT_EQ(value_of(request("get_state"), "state"), "playing");
  EXPECT_GE(host_->loop()->cell().find_component("B"), 0);
}

TEST_F(Hosted, RequestsAfterTheEndOfTheSimulationAreRefused) {
  options_.snapshots = directory_ / "snapshots";
  options_.recordings = directory_ / "recordings";
  open();
  ASSERT_EQ(request("save_snapshot", {{"name", "s"}}).result, Result::ok);
  ASSERT_EQ(request("set_state", {{"state", "3"}}).result, Result::ok);
  ASSERT_TRUE(reader_->wait_until([&] { return quits_.load() == 1; }));
  expect_reply(request("save_snapshot", {{"name", "t"}}), Result::incorrect_state,
               "The simulation has ended; nothing was saved.");
  EXPECT_FALSE(std::filesystem::exists(directory_ / "snapshots/cell/t.snapshot"));
  expect_reply(request("restore_snapshot", {{"name", "s"}}), Result::failed,
               "The simulation has ended; nothing was restored.");
  expect_reply(request("start_recording", {{"name", "r"}}), Result::incorrect_state,
               "The simulation has ended; nothing is recorded.");
  expect_reply(request("stop_recording"), Result::incorrect_state, "Nothing is being recorded.");
  expect_reply(request("delete_entity", {{"entity", "B"}}), Result::incorrect_state, "it is ending.");
}

TEST_F(Hosted, AHostWithoutDirectoriesRefusesSnapshotsAndRecordings) {
  open();
  for (const char* name : {"save_snapshot", "restore_snapshot"})
    expect_reply(request(name, {{"name", "s"}}), Result::unsupported, "--snapshots DIR says where to");
  expect_reply(request("start_recording", {{"name", "r"}}), Result::unsupported,
               "--recordings DIR says where to");
}

TEST_F(Hosted, RefusedSnapshotsHaveAReason) {
  options_.snapshots = directory_ / "snapshots";
  begin();
  host_->open_empty();
  expect_reply(request("save_snapshot", {{"name", "s"}}), Result::incorrect_state, "No scenario is loaded");
  ASSERT_EQ(request("load_scenario", {{"uri", file_.string()}}).result, Result::ok);
  expect_reply(request("save_snapshot", {{"name", "../s"}}), Result::failed,
               "A snapshot cannot be called '../s'");
  expect_reply(request("restore_snapshot"), Result::not_found, "There is no periodic snapshot yet.");
  expect_reply(request("restore_snapshot", {{"name", "s"}}), Result::not_found, "s.snapshot");
  ASSERT_EQ(request("save_snapshot", {{"name", "s"}}).result, Result::ok);
  EXPECT_NE(reader_->event("snapshot_saved").message.find("Snapshot s holds the state at 0.000 s (step 0)"),
            std::string::npos);
  // A directory of the same name: the temporary file cannot take its place, and is removed.
  const auto taken = directory_ / "snapshots/cell/t.snapshot";
  std::filesystem::create_directories(taken / "inside");
  expect_reply(request("save_snapshot", {{"name", "t"}}), Result::failed, "t.snapshot' cannot be written");
  expect_reply(request("restore_snapshot", {{"name", "t"}}), Result::failed, "it is no regular file");
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(directory_ / "snapshots/cell"))
    files += entry.is_regular_file() ? 1U : 0U;
  EXPECT_EQ(files, 1U) << "s.snapshot alone";
}

TEST_F(Hosted, ARestoredEndOfAScenarioIsTheEnd) {
  options_.snapshots = directory_ / "snapshots";
  options_.end_at_duration = true;
  open();
  ASSERT_EQ(request("save_snapshot", {{"name", "start"}}).result, Result::ok);
  const auto at_end = [&] { return value_of(request("get_state"), "step") == "50"; };
  const auto is_paused = [&] { return value_of(request("get_state"), "state") == "paused"; };
  ASSERT_EQ(request("set_state", {{"state", "1"}}).result, Result::ok);
  ASSERT_TRUE(reader_->wait_until([&] { return at_end() && is_paused(); })) << "0.05 s of 1 ms each";
  ASSERT_EQ(request("save_snapshot", {{"name", "end"}}).result, Result::ok);
  // Back at its start it pauses at its end once more.
  ASSERT_EQ(request("restore_snapshot", {{"name", "start"}}).result, Result::ok);
  ASSERT_EQ(request("set_state", {{"state", "1"}}).result, Result::ok);
  ASSERT_TRUE(reader_->wait_until([&] { return at_end() && is_paused(); }));
  // Restored at its end, it has been there: it plays on, from a stopped simulation too.
  ASSERT_EQ(request("set_state", {{"state", "0"}}).result, Result::ok);
  ASSERT_EQ(request("restore_snapshot", {{"name", "end"}}).result, Result::ok);
  EXPECT_TRUE(is_paused() && at_end());
  ASSERT_EQ(request("set_state", {{"state", "1"}}).result, Result::ok);
  EXPECT_TRUE(reader_->wait_until([&] { return std::stoi(value_of(request("get_state"), "step")) > 60; }));
}

TEST_F(Hosted, RefusedRecordingsHaveAReason) {
  options_.recordings = directory_ / "recordings";
  open();
  expect_reply(request("stop_recording"), Result::incorrect_state, "Nothing is being recorded.");
  expect_reply(request("start_recording", {{"name", "../r"}}), Result::failed,
               "A recording cannot be called '../r'");
  directory_.write("recordings", "");  // where the directory would have to be
  expect_reply(request("start_recording", {{"name", "r"}}), Result::failed, "Nothing is recorded: ");
  std::filesystem::remove(options_.recordings);
  const std::string log = (options_.recordings / "r.taktlog").string();
  const ControlReply started = request("start_recording", {{"name", "r"}});
  expect_reply(started, Result::ok, "It is being recorded to " + log);
  EXPECT_EQ(value_of(started, "uri"), log);
  EXPECT_EQ(reader_->event("recording_started").message, started.message);
  expect_reply(request("start_recording", {{"name", "q"}}), Result::incorrect_state,
               "It is being recorded already, to " + log + "; stop_recording ends that.");
  ASSERT_EQ(request("unload_scenario").result, Result::ok);
  expect_reply(request("stop_recording"), Result::ok, log + " holds ");
  expect_reply(request("start_recording", {{"name", "r"}}), Result::failed, "Nothing is recorded: ");
  // Without a scenario: a scenario loaded later is recorded from its start.
  ASSERT_EQ(request("start_recording", {{"name", "later"}}).result, Result::ok);
  ASSERT_EQ(request("load_scenario", {{"uri", file_.string()}}).result, Result::ok);
  ASSERT_EQ(request("set_state", {{"state", "3"}}).result, Result::ok);
  ASSERT_TRUE(reader_->wait_until([&] { return quits_.load() == 1; }));
  ASSERT_EQ(request("stop_recording").result, Result::ok);
  ReplayOptions replay_options;
  replay_options.load = [](const LogScenario& logged) { return load_logged_scenario(logged, {}); };
  const ReplayResult result = replay(options_.recordings / "later.taktlog", replay_options);
  EXPECT_EQ(result.difference, "");
  EXPECT_EQ(result.scenarios, 1U);
  EXPECT_TRUE(result.complete);
}

TEST_F(Hosted, TheLogOfTheServerHoldsSpawnedAndDeletedParts) {
  options_.log = directory_ / "run.taktlog";
  options_.recordings = directory_ / "recordings";
  source_options_.level_of_detail = 1;
  open();
  expect_reply(request("start_recording", {{"name", "r"}}), Result::incorrect_state,
               "the log of the server.");
  expect_reply(request("stop_recording"), Result::incorrect_state, "which ends with the server.");
  ASSERT_EQ(request("set_state", {{"state", "0"}}).result, Result::ok);
  ASSERT_EQ(request("spawn_entity", {{"name", "X"}, {"copy_of", "A"}, {"position", "9 9 9"}}).result,
            Result::ok);
  ASSERT_EQ(request("delete_entity", {{"entity", "B"}}).result, Result::ok);
  ASSERT_EQ(request("step", {{"steps", "5"}}).result, Result::ok);
  host_->stop();
  std::vector<LogScenario> loaded;
  ReplayOptions options;
  options.load = [&loaded](const LogScenario& logged) {
    loaded.push_back(logged);
    return load_logged_scenario(logged, {});
  };
  const ReplayResult result = replay(options_.log, options);
  EXPECT_EQ(result.difference, "");
  EXPECT_EQ(result.steps, 5U);
  ASSERT_EQ(loaded.size(), 3U);
  EXPECT_EQ(loaded[0].source.options.level_of_detail, 1);
  ASSERT_EQ(loaded[2].changes.size(), 2U);
  EXPECT_EQ(std::get<requests::SpawnEntity>(loaded[2].changes[0]).copy_of, "A");
  EXPECT_EQ(std::get<requests::DeleteEntity>(loaded[2].changes[1]).entity, "B");
  // The existence of a log must not be guessed from the reply.
  const auto refusal = [](const std::filesystem::path& file) -> std::string {
    try {
      LogReader reader(file);
    } catch (const LogError& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_NE(refusal(directory_.path()).find("it is not a readable file"), std::string::npos);
  EXPECT_NE(refusal(directory_ / "none").find("none' cannot be opened: it does not exist"),
            std::string::npos);
  EXPECT_NE(refusal(file_).find("cubes.yaml' is no log of takt: it begins otherwise"), std::string::npos);
}

TEST_F(Hosted, ALogThatCannotBeWrittenEndsTheStart) {
  options_.log = directory_ / "no/such/directory/run.taktlog";
  begin();
  EXPECT_THROW(host_->open(ScenarioSource{file_, {}}), LogError);
}

}  // namespace
}  // namespace takt::test
