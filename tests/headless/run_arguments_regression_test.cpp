// The command line of takt-run: which options each command takes, and the errors of all others.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tests/support/child_process.h"
#include "tests/support/temporary_directory.h"

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
      {{"verify", "x.yaml"}, {"--output", "--scene"}},
      {{"compare", "a.json", "b.json"}, {"--limit", "--report"}},
      {{"from-sdf", "x.sdf", "-o", "d"}, {"--output", "--leave-out-missing"}},
      {{"check-mesh", "x.obj"}, {"--scale", "--element-edge"}},
      {{"replay", "x.taktlog"}, {"--threads"}},
      {{"write-scenario", "x.yaml", "y.yaml"}, {"--set", "--lod", "--solver", "--step", "--tolerance"}},
      {{"schema"}, {}},
      {{"reference", "lua"}, {}}};
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
  EXPECT_THAT(output_of({"nosuch"}, 2),
              AllOf(HasSubstr("There is no command 'nosuch'. Commands: run, study, "
                              "verify, replay, export-fmu, from-sdf, compare, check-mesh, "
                              "write-scenario, schema, reference."),
                    Not(HasSubstr("takt-run run"))));
  EXPECT_THAT(output_of({"replai", "x.taktlog"}, 2), HasSubstr("Did you mean 'replay'?"));
  EXPECT_THAT(output_of({"x.yaml", "--quiet"}, 2),
              AllOf(HasSubstr("There is no command 'x.yaml'."), HasSubstr("use 'takt-run run x.yaml'.")));
  EXPECT_THAT(output_of({}, 2), HasSubstr("A subcommand is required"));
}

TEST(RunArguments, OptionsWithoutEffectAreRefused) {
  const auto refused = [](std::vector<std::string> options) {
    options.insert(options.begin(), {"run", kSlidingBlock, "--duration", "0.01"});
    return output_of(options, 2);
  };
  EXPECT_THAT(
      refused({"--picture", "x.png@1"}),
      HasSubstr(
          "--picture: found 'x.png@1'; allowed: FILE.png@T with T from 0 s to the end of the run, 0.01 s"));
  EXPECT_THAT(refused({"--picture", "x.jpg@0"}), HasSubstr("found 'x.jpg@0'; allowed: FILE.png@T"));
  EXPECT_THAT(refused({"--factor", "2"}), HasSubstr("--factor: found in pace free"));
  EXPECT_THAT(refused({"--csv-period", "1"}), HasSubstr("--csv-period requires --csv"));
  EXPECT_THAT(refused({"--mcap-period", "1"}), HasSubstr("--mcap-period requires --mcap"));
  EXPECT_THAT(refused({"--picture-view", "0,0,0:1,1,1"}), HasSubstr("--picture-view requires --picture"));
}

TEST(RunArguments, ErrorsNameTheOptionThatWasGiven) {
  EXPECT_THAT(output_of({"run", kSlidingBlock, "--solver", "euler"}, 2),
              HasSubstr("takt-run: --solver: found 'euler'; allowed: "));
  EXPECT_THAT(output_of({"run", kSlidingBlock, "--lod", "3", "--solver", "rk4"}, 2),
              HasSubstr("takt-run: --solver: found 'rk4'; allowed at level of detail 3: "));
  EXPECT_THAT(output_of({"run", kSlidingBlock, "--set", "solver.method=euler"}, 2),
              HasSubstr("--set: solver.method: found 'euler'; allowed: "));
  EXPECT_THAT(
      output_of({"run", kSlidingBlock, "--set", "parts.Nope.mass_kg=1"}, 2),
      AllOf(
          HasSubstr("--set parts.Nope.mass_kg=1: found 'Nope'; allowed: an entry of parts in the scenario: "),
          HasSubstr("Slab"), HasSubstr("--set 'parts.Nope={...}'")));
  EXPECT_THAT(output_of({"run", kSlidingBlock, "--duration", "x"}, 2),
              AllOf(HasSubstr("takt-run run: --duration: found 'x'; allowed: "),
                    HasSubstr("'takt-run run --help' lists what is allowed.")));
  EXPECT_THAT(output_of({"compare", "no/such.json", "b.json"}, 2),
              HasSubstr("no/such.json: cannot be read: No such file or directory"));
}

TEST(RunArguments, WritingAScenarioReplacesNoFileUnasked) {
  const TemporaryDirectory directory;
  const std::string file = directory.path() / "new.yaml";
  output_of({"write-scenario", kSlidingBlock, file}, 0);
  const auto text = [&] {
    std::ifstream in(file);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  const std::string written = text();
  const auto schema =
      std::filesystem::path(TAKT_CONFIG_DIR "/scenarios/scenario.schema.json").lexically_normal();
  EXPECT_TRUE(written.starts_with("# yaml-language-server: $schema=" +
                                  schema.lexically_relative(directory.path()).string() + "\ntakt_scenario: "))
      << written;
  EXPECT_THAT(
      output_of({"write-scenario", file, file, "--step", "0.002"}, 2),
      HasSubstr("new.yaml: the file exists; allowed: the name of a new file, or --force to replace it"));
  EXPECT_EQ(text(), written);
  output_of({"write-scenario", file, file, "--step", "0.002", "--force"}, 0);
  EXPECT_NE(text(), written);
}

}  // namespace
}  // namespace takt::test
