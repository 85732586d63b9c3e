// takt-run run --json: the standard output consists of the report alone.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/child_process.h"

namespace takt::test {
namespace {

TEST(RunJson, TheReportIsAllThatIsPrinted) {
  const std::string scenario = TAKT_CONFIG_DIR "/scenarios/contact/sliding_block.yaml";
  ChildProcess run({TAKT_BIN_DIR "/takt-run", "run", scenario, "--duration", "0.05", "--json"});
  EXPECT_EQ(run.wait(), 0) << run.text;
  const nlohmann::json report = nlohmann::json::parse(run.text, nullptr, false);
  ASSERT_TRUE(report.is_object()) << run.text;
  EXPECT_NEAR(report.at("time").get<double>(), 0.05, 1e-3);
  EXPECT_FALSE(report.at("scenario").get<std::string>().empty());
}

}  // namespace
}  // namespace takt::test
