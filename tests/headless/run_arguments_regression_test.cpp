// The command line of takt-run: which options each command takes, and the errors of all others.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/support/child_process.h"

namespace takt::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

const std::string kSlidingBlock = TAKT_CONFIG_DIR "/scenarios/contact/sliding_block.yaml";

std::string output_of(std::vector<std::string> arguments, int code) {
  arguments.insert(arguments.begin(), TAKT_BIN_DIR "/takt-run");
  ChildProcess program(arguments);
  EXPECT_EQ(program.wait(), code) << program.text;
  return program.text;
}

TEST(RunArguments, ACommandRefusesTheOptionsOfOthers) {
  struct Command {
    std::vector<std::string> words;
    std::vector<std::string> options;  ///< with a value each
  };
  const std::vector<Command> commands{
      {{"run", "x.yaml"},
       {"--report",
        "--html",
        "--junit",
        "--csv",
        "--csv-period",
        "--mcap",
        "--mcap-period",
        "--mcap-compression",
        "--mcap-pressures",
        "--picture",
        "--picture-view",
        "--set",
        "--lod",
        "--solver",
        "--step",
        "--tolerance",
        "--duration",
        "--pace",
        "--factor",
        "--program",
        "--threads"}},
      {{"study", "x.yaml", "--vary", "a=0:1:2"},
       {"--table", "--plot", "--jobs", "--slurm", "--task", "--set", "--lod", "--solver", "--step",
        "--tolerance", "--duration", "--program"}},
      {{"compare", "a.json", "b.json"}, {"--limit", "--report"}},
      {{"check-mesh", "x.obj"}, {"--scale", "--element-edge"}},
      {{"replay", "x.taktlog"}, {"--threads"}},
      {{"write-scenario", "x.yaml", "y.yaml"}, {"--set", "--lod", "--solver", "--step", "--tolerance"}},
      {{"schema"}, {}},
      {{"reference"}, {}}};
  std::vector<std::string> all;
  for (const Command& command : commands)
    all.insert(all.end(), command.options.begin(), command.options.end());
  for (const Command& command : commands) {
    const std::string help = output_of({command.words[0], "--help"}, 0);
    for (const std::string& option : all) {
      if (std::find(command.options.begin(), command.options.end(), option) != command.options.end()) {
        EXPECT_THAT(help, HasSubstr(option + " ")) << command.words[0];
        continue;
      }
      EXPECT_THAT(help, Not(HasSubstr(option + " "))) << command.words[0];
    }
    std::vector<std::string> words = command.words;
    const std::string wrong = command.words[0] == "check-mesh" ? "--lod" : "--scale";
    words.insert(words.end(), {wrong, "1"});
    EXPECT_THAT(output_of(words, 2), AllOf(HasSubstr("not expected: "), HasSubstr(wrong)))
        << command.words[0];
  }
}

TEST(RunArguments, FlagsBelongToTheCommandsThatUseThem) {
  const std::string vary = "contact.defaults.friction=0.1:0.2:2";
  EXPECT_THAT(output_of({"study", kSlidingBlock, "--vary", vary, "--json"}, 2),
              HasSubstr("not expected: --json"));
  EXPECT_THAT(output_of({"compare", "a.json", "b.json", "--quiet"}, 2), HasSubstr("not expected: --quiet"));
  EXPECT_THAT(output_of({"replay", "x.taktlog", "--stage-times"}, 2),
              HasSubstr("not expected: --stage-times"));
  EXPECT_THAT(output_of({"run", kSlidingBlock, "--vary", vary}, 2),
              AllOf(HasSubstr("not expected: "), HasSubstr("--vary")));
  EXPECT_THAT(output_of({"study", kSlidingBlock}, 2), HasSubstr("--vary is required"));
  EXPECT_THAT(output_of({"study", kSlidingBlock, "--vary", vary, "--slurm", "d", "--task", "0/2"}, 2),
              HasSubstr("excludes"));
}

TEST(RunArguments, AnUnknownCommandListsThoseThereAre) {
  EXPECT_THAT(
      output_of({"nosuch"}, 2),
      AllOf(HasSubstr("There is no command 'nosuch'. Commands: run, study, replay, compare, check-mesh, "
                      "write-scenario, schema, reference."),
            Not(HasSubstr("takt-run run"))));
  EXPECT_THAT(output_of({"replai", "x.taktlog"}, 2), HasSubstr("Did you mean 'replay'?"));
  EXPECT_THAT(output_of({"x.yaml", "--quiet"}, 2),
              AllOf(HasSubstr("There is no command 'x.yaml'."), HasSubstr("use 'takt-run run x.yaml'.")));
  EXPECT_THAT(output_of({}, 2), HasSubstr("A subcommand is required"));
}

}  // namespace
}  // namespace takt::test
