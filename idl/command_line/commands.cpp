#include "idl/command_line/commands.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <vector>

#include "idl/common/near_miss.h"
#include "idl/common/text.h"

namespace takt::command_line {

namespace {

constexpr std::size_t kHelpWidth = 100;

class WrappedHelp : public CLI::Formatter {
 public:
  std::string make_option_desc(const CLI::Option* option) const override {
    const std::string text = CLI::Formatter::make_option_desc(option);
    const std::size_t width = kHelpWidth - column_width_;
    std::string lines;
    std::size_t used = 0;
    for (std::size_t from = 0; from < text.size();) {
      const std::size_t to = std::min(text.find(' ', from), text.size());
      if (used > 0) {
        const bool fits = used + 1 + (to - from) <= width;
        lines += fits ? ' ' : '\n';
        used = fits ? used + 1 : 0;
      }
      lines.append(text, from, to - from);
      used += to - from;
      from = to + 1;
    }
    return lines;
  }
};

}  // namespace

void wrap_help(CLI::App& app) {
  app.formatter(std::make_shared<WrappedHelp>());
}

std::optional<std::string> unknown_command(const CLI::App& app) {
  if (!app.get_subcommands().empty()) return std::nullopt;
  for (const std::string& word : app.remaining())
    if (!word.starts_with('-')) return word;
  return std::nullopt;
}

std::string no_such_command(const CLI::App& app, const std::string& word) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
  return "There is no command '" + word + "'." + did_you_mean(word, names) +
         " Commands: " + list_names(names) + ".";
}

std::string failure(const CLI::App* app, const CLI::Error& error) {
  std::string name = app->get_name();
  if (const auto commands = app->get_subcommands(); !commands.empty())
    name += " " + commands.front()->get_name();
  return name + ": " + error.what() + "\n'" + name + " --help' lists what is allowed.\n";
}

}  // namespace takt::command_line
