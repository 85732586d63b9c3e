// Tables, plots and the order of runs of a study.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "server/headless/study.h"
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

}  // namespace
}  // namespace takt
