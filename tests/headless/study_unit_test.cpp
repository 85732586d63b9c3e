// Tables, plots and the order of runs of a study.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "server/headless/html_page.h"
#include "server/headless/study.h"
#include "server/headless/study_page.h"
#include "server/scenario/scenario_reader.h"

namespace takt {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(Study, KeysAreParsedOrRefused) {
  const VariedKey key = parse_varied_key("contact.defaults.friction=0.2:0.6:5");
  EXPECT_EQ(key.key, "contact.defaults.friction");
  EXPECT_EQ(key.count, 5);
  EXPECT_DOUBLE_EQ(key.value(0), 0.2);
  EXPECT_DOUBLE_EQ(key.value(3), 0.5);
  EXPECT_DOUBLE_EQ(key.value(4), 0.6);
  EXPECT_DOUBLE_EQ(parse_varied_key("a=2:9:1").value(0), 2.0);
  for (const char* wrong : {"", "a", "=1:2:3", "a=1:2", "a=1:2:0", "a=1:2:3:4", "a=1:x:3", "a=1:inf:3"})
    EXPECT_THROW(parse_varied_key(wrong), ScenarioError) << wrong;
}

TEST(Study, EveryCombinationIsARunAndTheLastKeyVariesFirst) {
  StudyOptions options;
  options.keys = {parse_varied_key("a=0:1:2"), parse_varied_key("b=10:30:3")};
  EXPECT_EQ(study_runs(options), 6);
  EXPECT_THAT(study_values(options, 0), ElementsAre(0.0, 10.0));
  EXPECT_THAT(study_values(options, 2), ElementsAre(0.0, 30.0));
  EXPECT_THAT(study_values(options, 3), ElementsAre(1.0, 10.0));
  options.keys.push_back(parse_varied_key("c=0:1:1000000"));
  EXPECT_THROW(study_runs(options), ScenarioError);
}

TEST(Table, ColumnsAppearInOrderAndCellsAreQuoted) {
  Table table;
  table.begin_row();
  table.set("a", 1.5);
  table.set("said", "no, \"never\"");
  table.begin_row();
  table.set("b", 2.0);
  table.set("a", 0.1);
  std::ostringstream csv;
  table.write_csv(csv);
  EXPECT_EQ(csv.str(), "a,said,b\n1.5,\"no, \"\"never\"\"\",\n0.1,,2\n");
}

TEST(Table, ColumnsForATerminalNeverTouchAndNumbersStandToTheRight) {
  Table table;
  for (const auto& [name, value] :
       {std::pair<const char*, const char*>{"a name longer than its head", "-1.5 mm"},
        {"b", "1234567.25"},
        {"c", "-"}}) {
    table.begin_row();
    table.set("name", name);
    table.set("value", value);
    table.set("", "x");
  }
  std::ostringstream text;
  table.write_aligned(text);
  EXPECT_EQ(text.str(),
            "name                              value\n"
            "a name longer than its head     -1.5 mm  x\n"
            "b                            1234567.25  x\n"
            "c                                     -  x\n");
}

TEST(Table, APlotHasALineForEachSeriesAndLeavesOutTexts) {
  Table table;
  for (int i = 0; i < 6; ++i) {
    table.begin_row();
    table.set("x", static_cast<double>(i % 3));
    table.set("friction", i < 3 ? "0.1" : "0.2");
    table.set("force", i == 4 ? std::string("failed") : std::to_string(100 * i));
  }
  std::ostringstream svg;
  table.write_plot(svg, "press < fit", "x", "force", "friction");
  const std::string text = svg.str();
  const auto count = [&](const std::string& what) {
    int n = 0;
    for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++n;
    return n;
  };
  EXPECT_EQ(count("<polyline"), 2);
  EXPECT_EQ(count("<circle"), 5);
  EXPECT_THAT(text, HasSubstr("press &lt; fit"));
  EXPECT_EQ(count("<svg"), count("</svg>"));
}

TEST(HtmlPage, QuantitiesHaveThePrefixThatLeavesOneToAThousand) {
  EXPECT_EQ(quantity(1234567.0, "Pa"), "1.235 MPa");
  EXPECT_EQ(quantity(999.99, "N"), "1 kN");
  EXPECT_EQ(quantity(-0.0003, "m"), "-300 µm");
  EXPECT_EQ(quantity(4200.0, "m"), "4200 m");
  EXPECT_EQ(quantity(0.0, "J"), "0 J");
  EXPECT_EQ(quantity(0.0125, "s"), "0.0125 s");
  EXPECT_EQ(quantity(0.5, ""), "0.5");
}

/// The force that a block of 2 kg needs on a slope, N, over friction and angle; it slides where the slope is steeper
/// than friction holds.
Table slope_study() {
  Table table;
  for (int run = 0; run < 6; ++run) {
    const double friction = 0.1 + 0.1 * (run / 3), angle_rad = 0.05 + 0.1 * (run % 3);
    const bool slides = std::tan(angle_rad) > friction;
    table.begin_row();
    table.set("run", std::to_string(run));
    table.set("friction", friction);
    table.set("angle", angle_rad);
    table.set("verdict", slides ? "failed" : "passed");
    table.set("fault", "");
    table.set("computation_ratio", 0.1 * run);
    table.set("Slope|Block.normal_force", 2.0 * 9.81 * std::cos(angle_rad));
    table.set("Slope|Block.time", 0.1 * run);
    table.set("Drive.electrical_energy", 2.0 * 9.81 * std::sin(angle_rad));
    table.set("constant", 3.0);
    table.set("stays", slides ? "failed" : "passed");
  }
  return table;
}

TEST(StudyPage, ResultsThatChangeMostComeFirst) {
  const Table table = slope_study();
  // sin changes from 0.05 to 0.25, cos by 3 %; times, ratios, keys and constants are no results that change.
  EXPECT_THAT(changing_columns(table, {"friction", "angle"}),
              ElementsAre("Drive.electrical_energy", "Slope|Block.normal_force"));
}

TEST(StudyPage, TheVerdictIsFirstAndAPlaceOfTheMapIsARun) {
  std::ostringstream out;
  write_study_page(out, "slope", slope_study(), {"friction", "angle"}, 6, "", "");
  const std::string page = out.str();
  const auto count = [&](const std::string& what) {
    int n = 0;
    for (std::size_t at = page.find(what); at != std::string::npos; at = page.find(what, at + 1)) ++n;
    return n;
  };
  // tan 0.15 and tan 0.25 exceed 0.1, tan 0.25 exceeds 0.2.
  EXPECT_THAT(
      page,
      HasSubstr(
          "</h1>\n<div class=\"verdict failed\"><strong>failed</strong><span>3 of 6 runs passed. stays: "
          "not met in 3 runs.</span>"));
  EXPECT_EQ(count("<svg"), 3);  // verdicts and two results
  EXPECT_EQ(count(", not passed</title>"), 9);
  EXPECT_EQ(count(", passed</title>"), 9);
  EXPECT_EQ(count("fill=\"#b3142b\""), 3);
  EXPECT_THAT(page, HasSubstr("<title>friction 0.2, angle 0.25: 4.854 J, not passed</title>"));
  EXPECT_EQ(count("<tr>"), 7);
}

TEST(StudyPage, OneKeyHasCurvesAndMissingRunsAreCounted) {
  std::ostringstream out;
  write_study_page(out, "slope", slope_study(), {"angle"}, 8, "Slope|Block.normal_force", "");
  EXPECT_THAT(out.str(), HasSubstr("2 runs are missing."));
  const std::size_t asked = out.str().find("Slope|Block.normal_force (N)"),
                    other = out.str().find("Drive.electrical_energy (J)");
  ASSERT_NE(other, std::string::npos);
  EXPECT_LT(asked, other) << "the column that was asked for is first";
}

}  // namespace
}  // namespace takt
