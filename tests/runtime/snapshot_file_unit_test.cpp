// Snapshot files: written whole or not at all, and every torn, altered or foreign one is refused with a
// sentence that names the file.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "server/runtime/recording/snapshot_file.h"
#include "server/simulation/model/cell_model.h"
#include "server/simulation/step/simulation.h"
#include "tests/support/random_assembly.h"
#include "tests/support/temporary_directory.h"

namespace takt::test {
namespace {

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}
void write(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

struct SnapshotFiles : testing::Test {
  SnapshotFiles() {
    RandomCellOptions options;
    options.parts = 3;
    RandomCell cell(options);
    auto named = std::make_shared<CellModel>(*cell.model());
    named->description.scenario = "three_parts";
    model = named;
    simulation = std::make_unique<Simulation>(model);
    for (int i = 0; i < 20; ++i) EXPECT_TRUE(simulation->step({}));
  }
  TemporaryDirectory directory;
  std::filesystem::path file = directory / "cell.snapshot";
  std::shared_ptr<const CellModel> model;
  std::unique_ptr<Simulation> simulation;
};

TEST_F(SnapshotFiles, AStateIsReadBack) {
  ASSERT_EQ(save_snapshot_file(file, *simulation).message, "");
  const std::uint64_t hash = simulation->state_hash();
  SnapshotFile content;
  ASSERT_EQ(read_snapshot_file(file, content).message, "");
  EXPECT_EQ(content.identity.scenario, "three_parts");
  EXPECT_EQ(content.identity.step, 20U);
  EXPECT_EQ(content.identity.time_s, simulation->time_s());
  Simulation other(model);
  ASSERT_EQ(restore_snapshot_file(file, other).message, "");
  EXPECT_EQ(other.state_hash(), hash);
  EXPECT_EQ(other.step_index(), 20U);
}

TEST_F(SnapshotFiles, FilesAreReplacedAtOnceAndLeaveNothingBehind) {
  ASSERT_TRUE(save_snapshot_file(file, *simulation).good());
  const std::string first = bytes_of(file);
  ASSERT_TRUE(simulation->step({}));
  ASSERT_TRUE(save_snapshot_file(file, *simulation).good());
  EXPECT_NE(bytes_of(file), first);
  const auto entries = std::filesystem::directory_iterator(file.parent_path());
  EXPECT_EQ(std::distance(begin(entries), end(entries)), 1);
}

TEST_F(SnapshotFiles, FilesCutAnywhereAreRefused) {
  ASSERT_TRUE(save_snapshot_file(file, *simulation).good());
  const std::string whole = bytes_of(file);
  Simulation target(model);
  const std::uint64_t before = target.state_hash();
  for (std::size_t length = 0; length < whole.size(); length += length < 80 ? 1 : 37) {
    write(file, whole.substr(0, length));
    const SnapshotResult result = restore_snapshot_file(file, target);
    EXPECT_EQ(result.error, length == 0 ? SnapshotError::not_a_snapshot : SnapshotError::damaged) << length;
    EXPECT_NE(result.message.find(file.string()), std::string::npos) << result.message;
  }
  write(file, whole + "x");
  EXPECT_EQ(restore_snapshot_file(file, target).error, SnapshotError::damaged);
  EXPECT_EQ(target.state_hash(), before);
  EXPECT_EQ(target.epoch(), 0U);
}

TEST_F(SnapshotFiles, AnyFlippedBitIsFound) {
  ASSERT_TRUE(save_snapshot_file(file, *simulation).good());
  const std::string whole = bytes_of(file);
  SnapshotFile content;
  for (std::size_t at = 0; at < whole.size(); at += at < 80 ? 1 : 101) {
    for (const int bit : {1, 16, 64}) {
      std::string flipped = whole;
      flipped[at] = static_cast<char>(flipped[at] ^ bit);
      write(file, flipped);
      const SnapshotError expected = at < 8    ? SnapshotError::not_a_snapshot
                                     : at < 12 ? SnapshotError::other_version
                                               : SnapshotError::damaged;
      EXPECT_EQ(read_snapshot_file(file, content).error, expected) << at;
    }
  }
  EXPECT_TRUE(content.state.empty()) << "it must stay untouched";
}

TEST_F(SnapshotFiles, FilesOfAnotherScenarioOrModelAreRefused) {
  ASSERT_TRUE(save_snapshot_file(file, *simulation).good());
  auto renamed = std::make_shared<CellModel>(*model);
  renamed->description.scenario = "four_parts";
  Simulation other(renamed);
  SnapshotResult result = restore_snapshot_file(file, other);
  EXPECT_EQ(result.error, SnapshotError::other_scenario);
  EXPECT_NE(result.message.find("'three_parts', but 'four_parts' is loaded"), std::string::npos)
      << result.message;
  auto heavier = std::make_shared<CellModel>(*model);
  heavier->parts.front().mass_kg += 1e-9;
  Simulation changed(heavier);
  result = restore_snapshot_file(file, changed);
  EXPECT_EQ(result.error, SnapshotError::other_scenario);
  EXPECT_NE(result.message.find("another model"), std::string::npos) << result.message;
}

TEST_F(SnapshotFiles, ARunawayIsNotWrittenAndTheOldFileIsKept) {
  ASSERT_TRUE(save_snapshot_file(file, *simulation).good());
  const std::string good = bytes_of(file);
  auto spinning = std::make_shared<CellModel>(*model);
  spinning->parts.front().V_WB_initial.w.z() = 1e4;  // too fast for the step: the quaternion grows
  Simulation runaway(spinning);
  ASSERT_TRUE(runaway.step({}));
  const SnapshotResult result = save_snapshot_file(directory / "other.snapshot", runaway);
  EXPECT_EQ(result.error, SnapshotError::refused);
  EXPECT_NE(result.message.find("could not be restored"), std::string::npos) << result.message;
  EXPECT_FALSE(std::filesystem::exists(directory / "other.snapshot"));
  EXPECT_EQ(save_snapshot_file(file, runaway).error, SnapshotError::refused);
  EXPECT_EQ(bytes_of(file), good);
}

TEST_F(SnapshotFiles, MissingUnreadableAndUnwritableFilesAreNamed) {
  SnapshotResult result = restore_snapshot_file(directory / "nowhere.snapshot", *simulation);
  EXPECT_EQ(result.error, SnapshotError::not_found);
  EXPECT_NE(result.message.find("nowhere.snapshot"), std::string::npos) << result.message;
  result = restore_snapshot_file(file.parent_path(), *simulation);
  EXPECT_EQ(result.error, SnapshotError::not_readable);
  result = save_snapshot_file(directory / "no/such/directory/cell.snapshot", *simulation);
  EXPECT_EQ(result.error, SnapshotError::not_readable);
  EXPECT_NE(result.message.find("cannot be written"), std::string::npos) << result.message;
  write(file, "takt_scenario: 1\n");
  EXPECT_EQ(restore_snapshot_file(file, *simulation).error, SnapshotError::not_a_snapshot);
}

}  // namespace
}  // namespace takt::test
