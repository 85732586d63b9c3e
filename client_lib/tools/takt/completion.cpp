// takt completion bash, zsh or fish: a script that completes the words of all programs. It reads commands, options and
// the words that an argument accepts from their --help.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>
#include <memory>
#include <string>

#include "client_lib/tools/takt/commands.h"

namespace takt::tool {
namespace {

/// For sed: "WORD<tab>DESCRIPTION" of what a help text lists.
constexpr const char* kWords = R"(s/^  (-.,)?(--[a-z-]+).*  ([^ ].*)/\2\t\3/p;t
s/^  (-.,)?(--[a-z-]+).*/\2\t/p;t
/^Subcommands:/,/^$/s/^  ([a-z][a-z_-]*) *(.*)/\1\t\2/p;t
/^  [A-Z]+ .*:\{/s/.*:\{([a-z0-9,]+)\}.*/\1\t/;T;s/,/\t\n/gp)";

/// `@` stands for kWords.
const std::map<std::string, std::string> kScripts{
    {"bash", R"script(# bash completion of takt, made by: takt completion bash
_takt_words() { "$@" --help 2>&1 | sed -nE '@'; }
_takt() {
  local word chain=("$1") words options
  words=$(_takt_words "$1") options=$words
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    [[ $word != -* && $'\n'$words == *$'\n'$word$'\t'* ]] || continue
    chain+=("$word") words=$(_takt_words "${chain[@]}") options+=$'\n'$words
  done
  words=$(grep -v '^-' <<<"$words" | cut -f1)
  [[ $2 != -* ]] || words=$(grep '^-' <<<"$options" | cut -f1)
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$2")
  [[ -n $words ]] || { compopt -o filenames; mapfile -t COMPREPLY < <(compgen -f -- "$2"); }
}
complete -F _takt takt takt-server takt-controller takt-run takt-ur
)script"},
    {"zsh", R"script(#compdef takt takt-server takt-controller takt-run takt-ur
# zsh completion of takt, made by: takt completion zsh
_takt() {
  local word; local -a chain words_there options
  _takt_words() { words_there=(${(f)"$($chain --help 2>&1 | sed -nE '@' | sed -E 's/:/\\:/g;s/\t/:/')"}); options+=(${(M)words_there:#-*}); words_there=(${words_there:#-*}); }
  chain=($words[1]); _takt_words
  for word in ${words[2,CURRENT-1]}; do
    if (( ${words_there[(I)$word:*]} )); then chain+=($word); _takt_words; fi
  done
  if [[ $PREFIX == -* ]]; then _describe -o option options
  elif (( $#words_there )); then _describe word words_there
  else _files; fi
}
if [[ $funcstack[1] == _takt ]]; then _takt "$@"; else compdef _takt takt takt-server takt-controller takt-run takt-ur; fi
)script"},
    {"fish", R"script(# fish completion of takt, made by: takt completion fish
function __takt_words
  set -l tokens (commandline -opc)
  set -l chain $tokens[1]
  set -l words ($chain --help 2>&1 | sed -nE '@')
  set -l options (string match -r '^-.*' -- $words)
  for word in $tokens[2..]
    string match -qr '^[a-z]' -- $word; and string match -q -- $word\t'*' $words; or continue
    set -a chain $word
    set words ($chain --help 2>&1 | sed -nE '@')
    set -a options (string match -r '^-.*' -- $words)
  end
  if string match -q -- '-*' (commandline -ct)
    string join \n -- $options
  else
    set words (string match -rv '^-' -- $words)
    and string join \n -- $words
    or __fish_complete_path (commandline -ct)
  end
end
for program in takt takt-server takt-controller takt-run takt-ur
  complete -c $program -f -a '(__takt_words)'
end
)script"}};

}  // namespace

void declare_completion(CLI::App& app, int& result) {
  const auto shell = std::make_shared<std::string>();  // lives as long as the command
  auto* command = app.add_subcommand("completion", "words for the shell to complete, for bash, zsh or fish");
  command->add_option("SHELL", *shell, "the shell: bash, zsh or fish")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));
  command->callback([&result, shell] {
    std::string script = kScripts.at(*shell);
    for (std::size_t at; (at = script.find("'@'")) != std::string::npos;) script.replace(at + 1, 1, kWords);
    std::fputs(script.c_str(), stdout);
    result = kOk;
  });
}

}  // namespace takt::tool
