#include "idl/command_line/commands.h"

#include <CLI/CLI.hpp>
#include <vector>

#include "idl/common/near_miss.h"
#include "idl/common/text.h"

namespace takt::command_line {

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
