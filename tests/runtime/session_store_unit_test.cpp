#include "server/runtime/recording/session_store.h"

#include <gtest/gtest.h>

#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

TEST(SessionStore, NamesAreNoPaths) {
  for (const char* good : {"a", "before_2", "A-1.b", "x..y"})
    EXPECT_EQ(SessionStore::refused_name(good), "") << good;
  for (const std::string& bad : {std::string(), std::string("."), std::string(".."), std::string("../a"),
                                 std::string("a/b"), std::string("/a"), std::string(".a"), std::string("a b"),
                                 std::string("a\0b", 3), std::string("\xc3\xa4"), std::string(101, 'a')})
    EXPECT_NE(SessionStore::refused_name(bad), "") << bad;
}

TEST(SessionStore, ASessionIsReadBackUnchanged) {
  const test::TemporaryDirectory directory;
  Session session;
  session.source = ScenarioSource{"/a/b.yaml", {{"solver.step_s=0.002", "x=[1, 2]"}, 2}};
  session.changes = {
      requests::DeleteEntity{"P"},
      requests::SpawnEntity{.name = "Q, R", .copy_of = "C", .mass = 0.1, .position = {0, 1.0 / 3, 1}}};
  session.state = SimulationState::paused;
  session.pace = Pace::lockstep;
  session.factor = 0.1;
  {
    SessionStore store(directory.path(), "cell");
    EXPECT_FALSE(store.read().has_value());
    EXPECT_EQ(store.write(session), "");
  }
  SessionStore store(directory.path(), "cell");
  const auto back = store.read();
  ASSERT_TRUE(back.has_value());
  ASSERT_TRUE(back->source.has_value());
  EXPECT_EQ(back->source->file, session.source->file);
  EXPECT_EQ(back->source->options.overrides, session.source->options.overrides);
  EXPECT_EQ(back->source->options.level_of_detail, 2);
  EXPECT_EQ(back->changes, session.changes) << "to the bit";
  EXPECT_EQ(back->state, SimulationState::paused);
  EXPECT_EQ(back->pace, Pace::lockstep);
  EXPECT_EQ(back->factor, 0.1);
  // Another cell in the same directory has a session of its own.
  EXPECT_FALSE(SessionStore(directory.path(), "other").read().has_value());
  EXPECT_EQ(store.write(Session{}), "");
  EXPECT_FALSE(store.read()->source.has_value());
}

TEST(SessionStore, TornAndForeignFilesAreNoSession) {
  const test::TemporaryDirectory directory;
  SessionStore store(directory.path(), "cell");
  ASSERT_EQ(store.write(Session{}), "");
  const auto file = directory / "cell" / "periodic" / "session.json";
  std::string text;
  std::getline(std::ifstream(file), text, '\0');
  for (std::size_t length = 0; length + 2 < text.size(); ++length) {
    std::ofstream(file) << text.substr(0, length);
    EXPECT_FALSE(store.read().has_value()) << length;
  }
  for (const char* foreign : {"[]", "null", "{\"version\": 2}", "{\"version\": 1, \"state\": \"playing\"}"}) {
    std::ofstream(file) << foreign;
    EXPECT_FALSE(store.read().has_value()) << foreign;
  }
}

TEST(SessionStore, TheNewestThreePeriodicSnapshotsAreKeptAcrossRuns) {
  const test::TemporaryDirectory directory;
  const std::vector<std::byte> state(100, std::byte{7});
  for (int run = 0; run < 2; ++run) {
    SessionStore store(directory.path(), "cell");
    for (std::uint64_t step = 0; step < 4; ++step)
      ASSERT_TRUE(store.write_periodic({"scenario", 1, 10 * step, 0.0}, state).good());
  }
  SessionStore store(directory.path(), "cell");
  const auto files = store.periodic();
  ASSERT_EQ(files.size(), 3U);
  EXPECT_EQ(files[0].filename(), "8.snapshot");
  EXPECT_EQ(files[2].filename(), "6.snapshot");
  SnapshotFile newest;
  ASSERT_TRUE(read_snapshot_file(files[0], newest).good());
  EXPECT_EQ(newest.identity.step, 30U);
  EXPECT_EQ(newest.state, state);
}

TEST(SessionStore, ANewSessionKeepsTheNewestSnapshotOfTheEarlierOne) {
  const test::TemporaryDirectory directory;
  SessionStore store(directory.path(), "cell");
  const auto step_of = [&](const char* name) {
    SnapshotFile content;
    return read_snapshot_file(store.file_of(name), content).good() ? static_cast<int>(content.identity.step)
                                                                   : -1;
  };
  store.begin();
  EXPECT_EQ(step_of("previous-run"), -1);
  const std::vector<std::byte> state(100, std::byte{7});
  for (std::uint64_t run = 1; run <= 5; ++run) {
    for (std::uint64_t step = 0; step < 3; ++step)
      ASSERT_TRUE(store.write_periodic({"scenario", 1, 10 * run + step, 0.0}, state).good());
    ASSERT_EQ(store.write({}), "");
    store.begin();
    EXPECT_TRUE(store.periodic().empty());
    EXPECT_FALSE(store.read().has_value());
  }
  // A server that ended without a save has no effect.
  store.begin();
  EXPECT_EQ(step_of("previous-run"), 52);
  EXPECT_EQ(step_of("previous-run-2"), 42);
  EXPECT_EQ(step_of("previous-run-3"), 32);
  EXPECT_EQ(step_of("previous-run-4"), -1);
}

TEST(SessionStore, ADirectoryThatCannotBeMadeIsReported) {
  const test::TemporaryDirectory directory;
  directory.write("file", "");
  try {
    const SessionStore store(directory / "file", "cell");
    FAIL() << "made below a file";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("file/cell"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace takt
