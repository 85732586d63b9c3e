// takt request NAME KEY=VALUE ..., made of the table of requests, and the words that are such a request.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cstdio>
#include <initializer_list>
#include <memory>

#include "client_lib/tools/takt/commands.h"
#include "idl/vocabulary/arguments.h"

namespace takt::tool {
namespace {

using Texts = std::vector<std::pair<std::string, std::string>>;

/// A request that contradicts the table is wrong usage and is not sent to the cell.
int send(const Common& common, const std::string& name, const Texts& texts, bool with_values) {
  const Arguments arguments = arguments_of_text(name, texts);
  requests::Any checked;
  if (find_request(name) != nullptr)
    if (const auto fault = read_request(name, arguments, checked))
      throw CLI::ValidationError(fault->sentence);
  const Reply reply = Session(common)->request(name, arguments);
  const int result = report(common, reply);
  if (with_values && !common.json)
    for (const auto& [key, value] : reply.values)
      std::printf("  %-20s %s\n", key.c_str(), text_of(value).c_str());
  return result;
}

std::string first_sentence(std::string_view doc) {
  std::string sentence(doc.substr(0, doc.find(". ")));
  if (!sentence.empty() && sentence.back() == '.') sentence.pop_back();
  if (!sentence.empty())
    sentence[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(sentence[0])));
  return sentence;
}

bool is_required(const FieldInfo& field) {
  return !has_annotation(field.annotations, "optional") && !has_annotation(field.annotations, "default");
}

std::string help_of(const FieldInfo& field) {
  std::string text = allowed_of(field);
  if (!field.doc.empty()) text += ": " + std::string(field.doc);
  const std::string otherwise(annotation(field.annotations, "default"));
  if (!is_required(field)) text += otherwise.empty() ? " (optional)" : " (" + otherwise + ")";
  return text;
}

std::string upper(std::string_view text) {
  std::string result;
  for (const char c : text) result += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return result;
}

CLI::Option* add_arguments(CLI::App& command, std::vector<std::string>& into) {
  return command.add_option("ARGUMENTS", into, "KEY=VALUE ...")->check([](const std::string& text) {
    return text.find('=') == std::string::npos ? "'" + text + "' is not KEY=VALUE" : std::string();
  });
}

Texts split(const std::vector<std::string>& arguments) {
  Texts texts;
  for (const std::string& text : arguments)
    texts.emplace_back(text.substr(0, text.find('=')), text.substr(text.find('=') + 1));
  return texts;
}

void declare_request(CLI::App& app, const Common& common, int& result) {
  struct Any {
    std::string name;
    std::vector<std::string> arguments;
  };
  const auto any = std::make_shared<Any>();
  auto* request = app.add_subcommand("request", "any request of the control vocabulary, by name");
  request->require_subcommand(0, 1);
  // One that a newer server has.
  request->add_option("NAME", any->name, "of a request that this program does not know");
  add_arguments(*request, any->arguments);
  request->callback([&common, &result, any, request] {
    if (!request->get_subcommands().empty()) return;
    if (any->name.empty()) throw CLI::RequiredError("NAME");
    result = send(common, any->name, split(any->arguments), true);
  });
  for (const RequestInfo* info : requests::kAll) {
    const std::string name(info->name);
    auto* one = request->add_subcommand(name, first_sentence(info->request->doc));
    const auto arguments = std::make_shared<std::vector<std::string>>();
    std::string help;
    for (const FieldInfo& field : info->request->fields)
      help += "\n  " + std::string(field.name) + "=: " + help_of(field);
    if (!help.empty()) one->footer("Arguments:" + help);
    add_arguments(*one, *arguments);
    one->callback(
        [&common, &result, name, arguments] { result = send(common, name, split(*arguments), true); });
  }
}

/// A request under a shorter name: `positions` are its arguments in the order of the command line, `fixed` are given.
template <Request Type>
void declare_word(CLI::App& app, const Common& common, int& result, const char* word,
                  std::initializer_list<const char*> positions, const Texts& fixed = {},
                  const char* description = nullptr) {
  const MessageInfo& info = message_info<Type>();
  auto* command = app.add_subcommand(word, description != nullptr ? description : first_sentence(info.doc));
  const auto values = std::make_shared<std::vector<std::string>>(positions.size());
  std::vector<std::string> names;
  for (const char* name : positions) {
    const FieldInfo& field = *std::ranges::find(info.fields, std::string_view(name), &FieldInfo::name);
    command->add_option(upper(name), (*values)[names.size()], help_of(field))->required(is_required(field));
    names.emplace_back(name);
  }
  command->callback([&common, &result, values, names, fixed] {
    Texts texts = fixed;
    for (std::size_t i = 0; i < names.size(); ++i)
      if (!(*values)[i].empty()) texts.emplace_back(names[i], (*values)[i]);
    result = send(common, std::string(request_info<Type>().name), texts, false);
  });
}

}  // namespace

void declare_requests(CLI::App& app, const Common& common, int& result) {
  const auto state = [](SimulationState wanted) { return Texts{{"state", std::string(to_string(wanted))}}; };
  const auto word = [&]<Request Type>(const char* name, std::initializer_list<const char*> positions,
                                      const Texts& fixed = {}, const char* description = nullptr) {
    declare_word<Type>(app, common, result, name, positions, fixed, description);
  };
  word.operator()<requests::SetState>("play", {}, state(SimulationState::playing), "let the cell run");
  word.operator()<requests::SetState>("pause", {}, state(SimulationState::paused),
                                      "stop the cell where it is");
  word.operator()<requests::SetState>("quit", {}, state(SimulationState::quitting), "end the server");
  word.operator()<requests::Reset>("reset", {});
  word.operator()<requests::SetLevelOfDetail>("lod", {"level_of_detail", "process"});
  word.operator()<requests::UnloadScenario>("unload", {});
  word.operator()<requests::DeleteEntity>("delete", {"entity"});
  word.operator()<requests::Attach>("attach", {"part", "to"});
  word.operator()<requests::Detach>("detach", {"part"});
  word.operator()<requests::SaveSnapshot>("snapshot", {"name"});
  word.operator()<requests::RestoreSnapshot>("restore", {"name"});
  declare_request(app, common, result);
}

}  // namespace takt::tool
