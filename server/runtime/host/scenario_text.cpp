#include "server/runtime/host/scenario_text.h"

#include "idl/common/atomic_file.h"
#include "idl/common/bounded_file.h"
#include "server/runtime/host/allowed_files.h"
#include "server/scenario/scenario_reader.h"

namespace takt {
namespace {

constexpr std::size_t kLargest_MB = 1;

Refusal no_file() {
  return {ControlResult::no_scenario_loaded, "No scenario from a file is loaded; load_scenario loads one."};
}

}  // namespace

Outcome<requests::GetScenarioText> ScenarioText::get() const {
  const auto loaded = slot_.loaded();
  if (!loaded || !loaded->source) return no_file();
  const std::filesystem::path& file = loaded->source->file;
  FileText read = read_bounded_file(file, kLargest_MB);
  if (!read.problem.empty())
    return Refusal{ControlResult::not_found, file.string() + " cannot be read: " + read.problem};
  return {file.string(), {file.string(), std::move(read.text), options_.edit}};
}

Outcome<requests::SaveScenarioText> ScenarioText::save(const requests::SaveScenarioText& request) const {
  if (!options_.edit && !request.only_check)
    return Refusal{ControlResult::unsupported,
                   "The files of this server are read-only; takt-server --edit lets clients replace them."};
  const auto loaded = slot_.loaded();
  if (!loaded || !loaded->source) return no_file();
  const std::filesystem::path& file = loaded->source->file;
  if (std::string refused = confine_text(request.text, options_.scenarios, file); !refused.empty())
    return Refusal{ControlResult::resource_parse_error, std::move(refused)};
  ScenarioOptions options = loaded->source->options;
  options.text = request.text;
  try {
    (void)read_scenario(file, options);
  } catch (const MissingFileError& error) {
    return Refusal{ControlResult::missing_assets, error.what()};
  } catch (const std::exception& error) {
    return Refusal{ControlResult::resource_parse_error, error.what()};
  }
  if (request.only_check) return {"The scenario can be read.", {file.string()}};
  if (const std::error_code error = replace_file(file, {request.text}))
    return Refusal{ControlResult::failed, file.string() + " cannot be written: " + error.message() + "."};
  return {file.string() + " is written; reload_scenario loads it.", {file.string()}};
}

}  // namespace takt
