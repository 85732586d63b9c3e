// Periodic snapshots of a cell: failures and recoveries of writing are reported, and a restarted server
// resumes from the newest readable one.
#include <gtest/gtest.h>

#include <fstream>

#include "server/runtime/host/cell_host.h"
#include "server/runtime/recording/command_log.h"
#include "tests/support/host_reader.h"

namespace takt::test {
namespace {

class PeriodicSnapshots : public testing::Test {
 protected:
  PeriodicSnapshots() {
    options_.snapshots = directory_ / "snapshots";
    options_.loop.save_every_s = 1e-4;
  }
  void block() const {
    std::filesystem::rename(periodic_, periodic_.string() + "_away");
    directory_.write("snapshots/cell/periodic", "");
  }
  void unblock() const {
    std::filesystem::remove(periodic_);
    std::filesystem::rename(periodic_.string() + "_away", periodic_);
  }
  std::vector<std::filesystem::path> newest_first() const {
    return SessionStore(options_.snapshots, "cell").periodic();
  }
  static void damage(const std::filesystem::path& file) { std::ofstream(file, std::ios::trunc) << "TAKT"; }

  /// A server that has played the cubes with another one, X, and without B, until three snapshots were there.
  void play_and_crash() {
    HostOptions options = options_;
    options.loop.state = SimulationState::paused;  // so that steps beyond the first are of the changed cell
    CellHost host(options);
    HostReader reader(host);
    host.open(ScenarioSource{file_, {}});
    ASSERT_EQ(reader.request("set_state", {{"state", "0"}}).result, ControlResult::ok);
    ASSERT_EQ(reader.request("spawn_entity", {{"name", "X"}, {"copy_of", "A"}, {"position", "9 9 9"}}).result,
              ControlResult::ok);
    ASSERT_EQ(reader.request("delete_entity", {{"entity", "B"}}).result, ControlResult::ok);
    ASSERT_EQ(reader.request("set_state", {{"state", "1"}}).result, ControlResult::ok);
    const SessionStore store(options_.snapshots, "cell");
    ASSERT_TRUE(reader.wait_until([&] {
      SnapshotFile newest;
      const auto files = store.periodic();
      return files.size() == 3 && read_snapshot_file(files[2], newest).good() && newest.identity.step > 0;
    }));
  }
  /// Announcement of the restarted server.
  std::string resumed(const std::optional<ScenarioSource>& otherwise = std::nullopt) {
    host_.reset();
    host_.emplace(options_);
    reader_.emplace(*host_);
    host_->resume("was killed by signal 11", otherwise);
    EXPECT_TRUE(host_->announces());
    const DiagnosticEvent reported = host_->outbound().announcement.value_or(DiagnosticEvent{});
    EXPECT_EQ(reported.code, "restarted");
    EXPECT_EQ(reported.message.find("The server was killed by signal 11 and was started again: "), 0U);
    return reported.message;
  }

  const TemporaryDirectory directory_;
  const std::filesystem::path file_ = write_two_cubes(directory_);
  const std::filesystem::path periodic_ = directory_ / "snapshots/cell/periodic";
  HostOptions options_ = free_running(false);
  std::optional<CellHost> host_;
  std::optional<HostReader> reader_;
};

bool says(const std::string& text, const std::string& words) {
  return text.find(words) != std::string::npos;
}

TEST_F(PeriodicSnapshots, FailedSnapshotsAreReportedOnceAndTheirRecoveryToo) {
  CellHost host(options_);
  HostReader reader(host);
  host.open(ScenarioSource{file_, {}});
  ASSERT_TRUE(reader.wait_until([&] { return !newest_first().empty(); }));
  block();
  const DiagnosticEvent failed = reader.event("snapshot_failed");
  EXPECT_EQ(failed.severity, Severity::error);
  EXPECT_TRUE(says(failed.message, "The periodic snapshot could not be written: ")) << failed.message;
  EXPECT_TRUE(says(failed.message, "periodic/")) << failed.message;
  EXPECT_FALSE(reader.has("snapshot_written"));
  unblock();
  const DiagnosticEvent written = reader.event("snapshot_written");
  EXPECT_EQ(written.severity, Severity::information);
  EXPECT_EQ(written.message, "Periodic snapshots are written again.");
  const auto before = newest_first();
  ASSERT_TRUE(reader.wait_until([&] { return newest_first() != before; })) << "they go on";
  host.stop();
  std::size_t failures = 0;
  for (const DiagnosticEvent& event : reader.events) failures += event.code == "snapshot_failed" ? 1U : 0U;
  EXPECT_EQ(failures, 1U);
}

TEST_F(PeriodicSnapshots, ASessionThatCannotBeWrittenIsReported) {
  CellHost host(options_);
  HostReader reader(host);
  block();
  host.open(ScenarioSource{file_, {}});
  EXPECT_TRUE(says(reader.event("snapshot_failed").message, "session.json cannot be written: "));
  // The unloaded state cannot be stored either.
  reader.events.clear();
  ASSERT_EQ(reader.request("unload_scenario").result, ControlResult::ok);
  EXPECT_TRUE(says(reader.event("snapshot_failed").message, "session.json cannot be written: "));
}

TEST_F(PeriodicSnapshots, ARestartedServerContinuesFromItsSnapshot) {
  ASSERT_NO_FATAL_FAILURE(play_and_crash());
  SnapshotFile newest;
  const auto files = newest_first();
  ASSERT_EQ(files.size(), 3U);
  ASSERT_TRUE(read_snapshot_file(files[0], newest).good());
  options_.loop.save_every_s = 0.0;  // the files stay as they are
  EXPECT_TRUE(says(resumed(), ", from a periodic snapshot, playing."));
  EXPECT_GE(host_->loop()->cell().find_component("X"), 0);
  EXPECT_EQ(host_->loop()->cell().find_component("B"), -1);
  // A reset undoes changes, as in the crashed run.
  EXPECT_TRUE(says(reader_->request("reset").message, "with the Parts of its scenario"));
  EXPECT_GE(host_->loop()->cell().find_component("B"), 0);
  host_->stop();

  damage(files[0]);
  SnapshotFile older;
  ASSERT_TRUE(read_snapshot_file(files[1], older).good());
  EXPECT_TRUE(says(resumed(), "(step " + std::to_string(older.identity.step) + ")"));
  host_->stop();
  // Of the right form, but of another state than this cell can have.
  ASSERT_TRUE(write_snapshot_file(files[1], older.identity, {}).good());
  EXPECT_FALSE(says(resumed(), "(step " + std::to_string(older.identity.step) + ")"));
  host_->stop();
  older.identity.model += 1;
  ASSERT_TRUE(write_snapshot_file(files[2], older.identity, older.state).good());
  EXPECT_TRUE(says(resumed(),
                   "the scenario starts from its beginning, as no periodic snapshot can be used, playing."));
  // A client cannot restore any of them either; the reply describes the fault of the last one.
  EXPECT_TRUE(says(reader_->request("restore_snapshot").message, "is of another model"));
  host_->stop();
  std::filesystem::remove(file_);
  const std::string gone = resumed();
  EXPECT_TRUE(says(gone, "what was loaded could not be loaded again, so nothing is loaded: ")) << gone;
  EXPECT_TRUE(says(gone, "cubes.yaml")) << gone;
  EXPECT_EQ(host_->loop(), nullptr);
}

TEST_F(PeriodicSnapshots, AServerWithoutASessionStartsFromTheScenario) {
  {
    CellHost host(options_);
    host.open_empty();
  }
  EXPECT_TRUE(says(resumed(ScenarioSource{file_, {}}), "no scenario is loaded, as before."));
  EXPECT_EQ(host_->loop(), nullptr);
  std::filesystem::remove(periodic_ / "session.json");
  EXPECT_TRUE(says(resumed(), "no scenario is loaded."));
  std::filesystem::remove(periodic_ / "session.json");
  EXPECT_TRUE(says(resumed(ScenarioSource{file_, {}}),
                   "the scenario starts from its beginning, as there is no periodic snapshot."));
  EXPECT_NE(host_->loop(), nullptr);
  options_.snapshots.clear();
  EXPECT_TRUE(says(resumed(), "no scenario is loaded."));
}

TEST_F(PeriodicSnapshots, ASessionWithADamagedFieldIsNotResumed) {
  ASSERT_NO_FATAL_FAILURE(play_and_crash());
  const auto session = periodic_ / "session.json";
  std::ifstream in(session);
  const std::string good{std::istreambuf_iterator<char>(in), {}};
  options_.loop.save_every_s = 0.0;
  const auto with = [&](const std::string& old_text, const std::string& new_text) {
    std::string text = good;
    const auto at = text.find(old_text);
    EXPECT_NE(at, std::string::npos) << old_text << " is not in " << good;
    if (at != std::string::npos) text.replace(at, old_text.size(), new_text);
    std::ofstream(session, std::ios::trunc) << text;
    return resumed();
  };
  for (const auto& [old_text, new_text] :
       std::vector<std::pair<std::string, std::string>>{{"\"state\": 1", "\"state\": -1"},
                                                        {"\"state\": 1", "\"state\": 9"},
                                                        {"\"factor\": 1.0", "\"factor\": 0.0"},
                                                        {"\"factor\": 1.0", "\"factor\": 1e300"},
                                                        {"\"state\": 1", "\"state\": \"playing\""},
                                                        {"\"changes\"", "\"chances\""},
                                                        {"{", "[{"}}) {
    EXPECT_TRUE(says(with(old_text, new_text), "no scenario is loaded.")) << new_text;
    EXPECT_EQ(host_->loop(), nullptr);
  }
  // A spawned Part cannot be spawned again: no scenario is loaded, rather than another one.
  const std::string refused = with("\"copy_of\": \"A\"", "\"copy_of\": \"Q\"");
  EXPECT_TRUE(says(refused, "There is no Part 'Q' to copy.")) << refused;
  // A server that was to end does not play again.
  std::ofstream(session, std::ios::trunc) << good;
  EXPECT_TRUE(says(with("\"state\": 1", "\"state\": 3"), "from a periodic snapshot, paused."));
}

TEST_F(PeriodicSnapshots, TheSnapshotsAndTheLogOfACrashedRunAreKept) {
  options_.log = directory_ / "run.taktlog";
  ASSERT_NO_FATAL_FAILURE(play_and_crash());
  const auto size = std::filesystem::file_size(options_.log);
  directory_.write("run.taktlog.2", "of the crash before");
  static_cast<void>(resumed());
  host_->stop();
  EXPECT_EQ(std::filesystem::file_size(options_.log), size);
  EXPECT_EQ(std::filesystem::file_size(directory_ / "run.taktlog.2"), 19U);
  LogReader reader(directory_ / "run.taktlog.3");
  LogEntry entry;
  while (reader.next(entry) && entry.kind != LogKind::scenario) continue;
  ASSERT_EQ(entry.kind, LogKind::scenario);
  StateReader content(entry.content);
  const auto record = decode(entry.kind, content, CellDescription{});
  EXPECT_EQ(std::get<LogScenario>(*record).changes.size(), 2U) << "what came and what went before the crash";
  // It continues without a log if none can be written, and reports that.
  options_.log = directory_ / "no/such/directory/run.taktlog";
  static_cast<void>(resumed());
  const DiagnosticEvent reported = reader_->event("recording_failed");
  EXPECT_TRUE(says(reported.message, "Nothing is recorded: ")) << reported.message;
  EXPECT_TRUE(says(reported.message, "no/such/directory/run.taktlog.2")) << reported.message;
  EXPECT_NE(host_->loop(), nullptr);
}

}  // namespace
}  // namespace takt::test
