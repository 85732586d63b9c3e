// The help of programs fits into a terminal.
#include <gmock/gmock.h>

#include <CLI/CLI.hpp>
#include <sstream>

#include "idl/command_line/commands.h"

namespace takt {
namespace {

TEST(Help, SentencesOfOptionsAreWrappedBetweenWords) {
  CLI::App app{"A program."};
  command_line::wrap_help(app);
  std::string value, sentence;
  for (int n = 0; n < 40; ++n) sentence += "word" + std::to_string(n) + (n < 39 ? " " : "");
  CLI::App* command = app.add_subcommand("run", "runs");
  command->add_option("--option", value, sentence);
  command->add_option("--plain", value, "a short one");
  std::istringstream help(command->help());
  std::string line, words;
  while (std::getline(help, line)) {
    EXPECT_LE(line.size(), 100U) << line;
    if (const auto at = line.find("word"); at != std::string::npos) {
      EXPECT_EQ(at, 30U) << line;
      words += (words.empty() ? "" : " ") + line.substr(at);
    }
  }
  EXPECT_EQ(words, sentence);
  EXPECT_THAT(command->help(), testing::ContainsRegex("--plain TEXT +a short one\n"));
}

}  // namespace
}  // namespace takt
