// takt completion bash: words for the shell, from the same tree that reads the command line.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>

#include "client_lib/tools/takt/commands.h"

namespace takt::tool {
namespace {

std::string options_of(const CLI::App& app) {
  std::string words;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) words += " --" + name;
    for (const std::string& name : option->get_snames()) words += " -" + name;
  }
  return words;
}

bool takes_file(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options())
    if (option->get_positional() &&
        (option->get_name(true) == "FILE" || option->get_name(true) == "SCENARIO"))
      return true;
  return false;
}

std::string bash_script(const CLI::App& app) {
  std::string names, cases, with_files;
  for (const CLI::App* command : app.get_subcommands({})) {
    names += " " + command->get_name();
    cases += "    " + command->get_name() + ") words+='" + options_of(*command) + "' ;;\n";
    if (takes_file(*command)) with_files += (with_files.empty() ? "" : "|") + command->get_name();
  }
  return "# bash completion of takt, made by: takt completion bash\n"
         "_takt() {\n"
         "  local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD-1]} command='' word\n"
         "  local commands='" +
         names + "' words='" + options_of(app) +
         "'\n"
         "  for word in \"${COMP_WORDS[@]:1:COMP_CWORD-1}\"; do\n"
         "    [[ \" $commands \" == *\" $word \"* ]] && { command=$word; break; }\n"
         "  done\n"
         "  case $prev in\n"
         "    --profiles|--secure|--mesh) compopt -o filenames; mapfile -t COMPREPLY < <(compgen -f -- "
         "\"$cur\"); "
         "return ;;\n"
         "  esac\n"
         "  case $command in\n"
         "    '') words+=\" $commands\" ;;\n" +
         cases +
         "  esac\n"
         "  mapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$cur\")\n"
         "  case $command in\n"
         "    " +
         with_files +
         ") [[ $cur == -* ]] || { compopt -o filenames; "
         "mapfile -t COMPREPLY < <(compgen -f -- \"$cur\"); } ;;\n"
         "  esac\n"
         "}\n"
         "complete -F _takt takt\n";
}

}  // namespace

void declare_completion(CLI::App& app, int& result) {
  auto* command = app.add_subcommand("completion", "words for the shell to complete: takt completion bash");
  command->add_option("SHELL", "the shell; there is bash")->required()->check(CLI::IsMember({"bash"}));
  command->callback([&app, &result] {
    std::fputs(bash_script(app).c_str(), stdout);
    result = kOk;
  });
}

}  // namespace takt::tool
