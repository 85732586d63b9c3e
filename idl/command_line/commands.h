#pragma once
// Commands of programs that have several of them.
#include <optional>
#include <string>

namespace CLI {
class App;
class Error;
}  // namespace CLI

namespace takt::command_line {

/// Sentences of options in the help of this program, and of commands that are added after this call, have lines of at most
/// 100 characters.
void wrap_help(CLI::App& app);
/// Of a command line that could not be read: the word in place of a command, if that is what is wrong.
std::optional<std::string> unknown_command(const CLI::App& app);
/// "There is no command 'WORD'. Did you mean 'NAME'? Commands: ...".
std::string no_such_command(const CLI::App& app, const std::string& word);
/// For CLI::App::failure_message(): program, command, what is wrong, and where the options are listed.
std::string failure(const CLI::App* app, const CLI::Error& error);

}  // namespace takt::command_line
