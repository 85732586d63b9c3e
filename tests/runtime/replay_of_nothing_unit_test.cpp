// A log without checkpoints is refused: the same bits at no checkpoint are no result.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>

#include "server/runtime/host/replay.h"
#include "server/runtime/recording/log_recorder.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

std::string refusal_of_log(const std::filesystem::path& file) {
  ReplayOptions options;
  options.load = [](const LogScenario&) -> std::shared_ptr<const CellModel> {
    throw std::logic_error("there is no scenario to load");
  };
  try {
    static_cast<void>(replay(file, options));
  } catch (const LogError& error) {
    return error.what();
  }
  return "it was replayed";
}

TEST(ReplayOfNothing, ALogWithoutCheckpointsIsRefused) {
  const test::TemporaryDirectory directory;
  const auto whole = directory / "whole", cut = directory / "cut";
  RecorderOptions recorder_options;
  recorder_options.version = "takt-server of a test";
  recorder_options.cell = "cell";
  { const LogRecorder recorder(whole, recorder_options); }
  EXPECT_THAT(refusal_of_log(whole), testing::HasSubstr("has no checkpoint"));
  const std::size_t head_bytes = LogFraming::file_head().size();
  ASSERT_GT(std::filesystem::file_size(whole), head_bytes);
  for (std::size_t size = 0; size < std::filesystem::file_size(whole); ++size) {
    std::filesystem::copy_file(whole, cut, std::filesystem::copy_options::overwrite_existing);
    std::filesystem::resize_file(cut, size);
    const std::string refusal = refusal_of_log(cut);
    EXPECT_THAT(refusal, testing::HasSubstr(cut.string())) << size;
    if (size == head_bytes) {
      EXPECT_THAT(refusal, testing::HasSubstr("is empty"));
    } else if (size > head_bytes) {
      EXPECT_THAT(refusal, testing::AnyOf(testing::HasSubstr("within its first record"),
                                          testing::HasSubstr("has no checkpoint")))
          << size;
    }
  }
}

}  // namespace
}  // namespace takt
