// takt completion bash, zsh or fish: words for the shell, from the same tree that reads the command line. The
// other programs have no commands: their options are asked of their --help when they are wanted.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

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

std::string replaced(const std::string& text, char what, const std::string& by) {
  std::string out;
  for (const char c : text) out += c == what ? by : std::string(1, c);
  return out;
}

/// In single quotes of a shell.
std::string quoted(const std::string& text) {
  return "'" + replaced(text, '\'', "'\\''") + "'";
}

std::string names_of(const CLI::App& app) {
  std::string names;
  for (const CLI::App* command : app.get_subcommands({})) names += " " + command->get_name();
  return names;
}

struct Words {
  std::string names;       ///< of all commands
  std::string cases;       ///< "NAME) VARIABLE+=' --option' ;;", one a line
  std::string nested;      ///< "NAME) compadd WORDS ;;" of those that have commands of their own, one a line
  std::string with_files;  ///< names of commands that take one, separated by |
};

/// `variable`: of the script, which takes up the options of the command that was given.
Words words_of(const CLI::App& app, const std::string& variable) {
  Words words;
  words.names = names_of(app);
  for (const CLI::App* command : app.get_subcommands({})) {
    const std::string inner = names_of(*command);
    words.cases +=
        "    " + command->get_name() + ") " + variable + "+='" + options_of(*command) + inner + "' ;;\n";
    if (!inner.empty()) words.nested += "    " + command->get_name() + ") compadd --" + inner + " ;;\n";
    if (takes_file(*command)) words.with_files += (words.with_files.empty() ? "" : "|") + command->get_name();
  }
  return words;
}

std::string bash_script(const CLI::App& app) {
  const Words words = words_of(app, "words");
  return "# bash completion of takt, made by: takt completion bash\n"
         "_takt() {\n"
         "  local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD-1]} command='' word\n"
         "  local commands='" +
         words.names + "' words='" + options_of(app) +
         "'\n"
         "  for word in \"${COMP_WORDS[@]:1:COMP_CWORD-1}\"; do\n"
         "    [[ \" $commands \" == *\" $word \"* ]] && { command=$word; break; }\n"
         "  done\n"
         "  case $prev in\n"
         "    --profiles|--secure|--mesh|--page|--files|--csv|-o|--output) compopt -o filenames; mapfile -t "
         "COMPREPLY < <(compgen -f -- \"$cur\"); return ;;\n"
         "  esac\n"
         "  case $command in\n"
         "    '') words+=\" $commands\" ;;\n" +
         words.cases +
         "  esac\n"
         "  mapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$cur\")\n"
         "  case $command in\n"
         "    " +
         words.with_files +
         ") [[ $cur == -* ]] || { compopt -o filenames; "
         "mapfile -t COMPREPLY < <(compgen -f -- \"$cur\"); } ;;\n"
         "  esac\n"
         "}\n"
         "complete -F _takt takt\n"
         "_takt_program() {\n"
         "  if [[ $2 == -* ]]; then\n"
         "    mapfile -t COMPREPLY < <(compgen -W \"$(\"$1\" --help 2>&1 | grep -oE -e '--[a-z][a-z-]+')\" "
         "-- "
         "\"$2\")\n"
         "  else\n"
         "    compopt -o filenames; mapfile -t COMPREPLY < <(compgen -f -- \"$2\")\n"
         "  fi\n"
         "}\n"
         "complete -F _takt_program takt-server takt-controller takt-run\n";
}

std::string zsh_script(const CLI::App& app) {
  const Words words = words_of(app, "options");
  std::string described;
  for (const CLI::App* command : app.get_subcommands({}))
    described +=
        "    " + quoted(command->get_name() + ":" + replaced(command->get_description(), ':', "\\:")) + "\n";
  return "#compdef takt takt-server takt-controller takt-run\n"
         "# zsh completion of takt, made by: takt completion zsh\n"
         "_takt() {\n"
         "  if [[ $service != takt ]]; then _gnu_generic; return; fi\n"
         "  local -a commands\n"
         "  commands=(\n" +
         described +
         "  )\n"
         "  local command='' word options='" +
         options_of(app) +
         "'\n"
         "  local -a names\n"
         "  names=(" +
         words.names +
         " )\n"
         "  for word in ${words[2,CURRENT-1]}; do\n"
         "    if (( ${names[(Ie)$word]} )); then command=$word; break; fi\n"
         "  done\n"
         "  case $command in\n" +
         words.cases +
         "  esac\n"
         "  if [[ $PREFIX == -* ]]; then compadd -- ${=options}; return; fi\n"
         "  case $command in\n"
         "    '') _describe 'command' commands ;;\n"
         "    completion) compadd bash zsh fish ;;\n"
         "    pace) compadd realtime free lockstep ;;\n" +
         words.nested + "    " + words.with_files +
         ") _files ;;\n"
         "  esac\n"
         "}\n"
         "if [[ $funcstack[1] == _takt ]]; then _takt \"$@\"; else compdef _takt takt takt-server "
         "takt-controller "
         "takt-run; fi\n";
}

std::string fish_script(const CLI::App& app) {
  const std::string names = names_of(app);
  std::string lines;
  const auto options = [&](const CLI::App& of, const std::string& when) {
    for (const CLI::Option* option : of.get_options()) {
      std::string words;
      for (const std::string& name : option->get_lnames()) words += " -l " + name;
      for (const std::string& name : option->get_snames()) words += " -s " + name;
      if (words.empty()) continue;
      lines += "complete -c takt" + when + words + (option->get_expected_min() > 0 ? " -r" : "") + " -d " +
               quoted(option->get_description()) + "\n";
    }
  };
  options(app, "");
  for (const CLI::App* command : app.get_subcommands({})) {
    lines += "complete -c takt -f -n 'not __fish_seen_subcommand_from" + names + "' -a " +
             command->get_name() + " -d " + quoted(command->get_description()) + "\n";
    const std::string seen = " -n '__fish_seen_subcommand_from " + command->get_name() + "'";
    if (takes_file(*command)) lines += "complete -c takt -F" + seen + "\n";
    options(*command, seen);
    for (const CLI::App* inner : command->get_subcommands({}))
      lines += "complete -c takt -f" + seen + " -a " + inner->get_name() + " -d " +
               quoted(inner->get_description()) + "\n";
  }
  return "# fish completion of takt, made by: takt completion fish\ncomplete -c takt -f\n" + lines +
         "for program in takt-server takt-controller takt-run\n"
         "  complete -c $program -a \"($program --help 2>&1 | string match -ra -- '--[a-z][a-z-]+')\"\n"
         "end\n";
}

}  // namespace

void declare_completion(CLI::App& app, int& result) {
  const auto shell = std::make_shared<std::string>();  // lives as long as the command
  auto* command = app.add_subcommand("completion", "words for the shell to complete, for bash, zsh or fish");
  command->add_option("SHELL", *shell, "the shell: bash, zsh or fish")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));
  command->callback([&app, &result, shell] {
    const std::string script = *shell == "zsh"    ? zsh_script(app)
                               : *shell == "fish" ? fish_script(app)
                                                  : bash_script(app);
    std::fputs(script.c_str(), stdout);
    result = kOk;
  });
}

}  // namespace takt::tool
