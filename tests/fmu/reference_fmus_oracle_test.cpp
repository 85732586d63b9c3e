// The Reference FMUs of the Modelica Association against the results that they bring. They are fetched and built by hand
// (docs/fmi.md); TAKT_REFERENCE_FMUS is their folder. Without it the test is skipped.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "idl/common/parse.h"
#include "tests/support/fmu_cell.h"

namespace takt {
namespace {

/// Columns of numbers; cells of an array are separated by spaces.
struct Table {
  std::vector<std::string> names;
  std::vector<std::vector<std::vector<double>>> rows;
};

double number_in(const std::string& word) {
  if (word == "true" || word == "false") return word == "true" ? 1.0 : 0.0;
  return finite_number(word).value_or(std::nan(""));
}

Table read_table(const std::filesystem::path& file) {
  std::ifstream in(file);
  Table table;
  std::string line, cell, word;
  std::getline(in, line);
  for (std::istringstream cells(line); std::getline(cells, cell, ',');) table.names.push_back(cell);
  while (std::getline(in, line)) {
    auto& row = table.rows.emplace_back();
    for (std::istringstream cells(line); std::getline(cells, cell, ',');) {
      auto& values = row.emplace_back();
      for (std::istringstream words(cell); words >> word;) values.push_back(number_in(word));
    }
  }
  return table;
}

struct ReferenceCase {
  const char* name;
  int version;
  std::vector<std::string> without{};  ///< columns that are no numbers
};

class ReferenceFmus : public testing::TestWithParam<ReferenceCase> {};
const std::vector<std::string> kTexts{"String_output", "Binary_output"};
INSTANTIATE_TEST_SUITE_P(
    All, ReferenceFmus,
    testing::Values(ReferenceCase{"BouncingBall", 2}, ReferenceCase{"BouncingBall", 3},
                    ReferenceCase{"Dahlquist", 2}, ReferenceCase{"Dahlquist", 3}, ReferenceCase{"Stair", 2},
                    ReferenceCase{"Stair", 3}, ReferenceCase{"VanDerPol", 2}, ReferenceCase{"VanDerPol", 3},
                    ReferenceCase{"Resource", 2}, ReferenceCase{"Resource", 3},
                    ReferenceCase{"Feedthrough", 2, kTexts}, ReferenceCase{"Feedthrough", 3, kTexts},
                    ReferenceCase{"StateSpace", 3}),
    [](const auto& one) { return std::string(one.param.name) + std::to_string(one.param.version); });

TEST_P(ReferenceFmus, GiveTheResultsThatTheyBring) {
  const char* folder = std::getenv("TAKT_REFERENCE_FMUS");
  if (folder == nullptr) GTEST_SKIP() << "TAKT_REFERENCE_FMUS names no folder with the Reference FMUs";
  const ReferenceCase& c = GetParam();
  const std::filesystem::path root = folder;
  const Table expected = read_table(root / c.name / (std::string(c.name) + "_out.csv"));
  ASSERT_GE(expected.rows.size(), 2U);
  const double step_s = expected.rows[1][0][0] - expected.rows[0][0][0];
  test::FmuCell cell(root / ("b" + std::to_string(c.version)) / "fmus" / (std::string(c.name) + ".fmu"), "",
                     step_s);
  const auto has = [&](const std::string& signal) {
    for (const SignalDescription& s : cell.device().signals)
      if (s.name == signal) return true;
    return false;
  };
  std::size_t compared = 0;
  for (std::size_t row = 0; row < expected.rows.size(); ++row) {
    const double t = expected.rows[row][0][0];
    if (row > 0) {
      ASSERT_TRUE(cell.step()) << cell.simulation().fault();
    }
    if (std::string_view(c.name) == "Stair" && t > 8.9) {
      // This FMU ends its simulation at its last event. The device then holds the outputs.
      EXPECT_EQ(cell.value("counter"), 10.0);
      ASSERT_TRUE(cell.step());
      EXPECT_EQ(cell.value("counter"), 10.0);
      EXPECT_EQ(cell.value("failed"), 1.0);
      EXPECT_THAT(cell.notices(), testing::HasSubstr("the FMU ended its simulation at 9"));
      return;
    }
    for (std::size_t i = 1; i < expected.names.size(); ++i) {
      const std::string& name = expected.names[i];
      if (std::find(c.without.begin(), c.without.end(), name) != c.without.end()) continue;
      for (std::size_t k = 0; k < expected.rows[row][i].size(); ++k) {
        const std::string signal =
            expected.rows[row][i].size() > 1 ? name + "_" + std::to_string(k + 1) : name;
        if (!has(signal)) continue;
        const double wanted = expected.rows[row][i][k];
        ASSERT_NEAR(cell.value(signal), wanted, 1e-5 * std::max(1.0, std::abs(wanted)))
            << signal << " at " << t << " s";
        ++compared;
      }
    }
  }
  EXPECT_GE(compared, expected.rows.size()) << cell.notices();
  EXPECT_EQ(cell.value("failed"), 0.0) << cell.notices();
}

TEST(ReferenceFmuClocks, IsRefusedAsItHasScheduledExecutionAlone) {
  const char* folder = std::getenv("TAKT_REFERENCE_FMUS");
  if (folder == nullptr) GTEST_SKIP() << "TAKT_REFERENCE_FMUS names no folder with the Reference FMUs";
  EXPECT_THAT(
      [&] { test::FmuCell(std::filesystem::path(folder) / "b3/fmus/Clocks.fmu"); },
      testing::ThrowsMessage<ScenarioError>(testing::HasSubstr("scheduled execution and no co-simulation")));
}

/// Every type of variable there and back, up to its limits (as far as a double has them).
TEST(ReferenceFmuFeedthrough, PassesEveryTypeOfInputOn) {
  const char* folder = std::getenv("TAKT_REFERENCE_FMUS");
  if (folder == nullptr) GTEST_SKIP() << "TAKT_REFERENCE_FMUS names no folder with the Reference FMUs";
  for (const int version : {2, 3}) {
    test::FmuCell cell(
        std::filesystem::path(folder) / ("b" + std::to_string(version)) / "fmus/Feedthrough.fmu",
        version == 2 ? ""
                     : "inputs: [Float32_continuous_input, Float64_continuous_input, Float64_discrete_input, "
                       "Int8_input, UInt8_input, Int16_input, UInt16_input, Int32_input, UInt32_input, "
                       "Int64_input, UInt64_input, Boolean_input, Enumeration_input]",
        0.1);
    int passed = 0;
    for (const SignalDescription& input : cell.device().signals) {
      if (!input.commanded) continue;
      const std::string output = input.name.substr(0, input.name.rfind("input")) + "output";
      for (const double value : {input.type == SignalType::real ? 0.75 : input.lower,
                                 input.type == SignalType::real ? -2.5 : input.upper}) {
        cell.command(input.name, value);
        ASSERT_TRUE(cell.step());
        EXPECT_EQ(cell.value(output), value) << version << " " << output;
        EXPECT_EQ(cell.value("failed"), 0.0) << cell.notices();
        ++passed;
      }
    }
    EXPECT_GE(passed, version == 2 ? 8 : 26);
  }
}

}  // namespace
}  // namespace takt
