#include "server/runtime/recording/session_store.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <tuple>

#include "idl/common/atomic_file.h"

namespace takt {
namespace {

using nlohmann::json;

constexpr const char* kSuffix = ".snapshot";
constexpr const char* kSession = "session.json";
constexpr int kSessionVersion = 1;

/// 0: not the name of a periodic one.
std::uint64_t number_of(const std::filesystem::path& file) {
  if (file.extension() != kSuffix) return 0;
  const std::string stem = file.stem().string();
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(stem.data(), stem.data() + stem.size(), number);
  return error == std::errc() && end == stem.data() + stem.size() ? number : 0;
}

std::string document_of(const Session& session) {
  json document{{"version", kSessionVersion},
                {"state", static_cast<int>(session.state)},
                {"pace", to_string(session.pace)},
                {"factor", session.factor},
                {"scenario", nullptr},
                {"changes", json::array()}};
  if (session.source) {
    const auto& options = session.source->options;
    document["scenario"] = session.source->file.string();
    document["overrides"] = options.overrides;
    document["level_of_detail"] = options.level_of_detail ? json(*options.level_of_detail) : json();
  }
  for (const requests::Any& change : session.changes) {
    const ControlRequest request = control_request(change);
    json arguments = json::object();
    for (const auto& [name, value] : request.arguments) arguments[name] = text_of(value);
    document["changes"].push_back({{"request", request.request}, {"arguments", arguments}});
  }
  return document.dump(1, ' ', false, json::error_handler_t::replace) + "\n";
}

Session session_of(const json& document) {
  if (document.at("version") != kSessionVersion) throw std::runtime_error("other version");
  Session session;
  const int state = document.at("state").get<int>();
  if (state < 0 || state > static_cast<int>(SimulationState::quitting))
    throw std::runtime_error("unknown state");
  session.state = static_cast<SimulationState>(state);
  requests::SetPace pace;
  const std::string_view set_pace = request_info<requests::SetPace>().name;
  const Arguments paced = arguments_of_text(
      set_pace, {{"pace", document.at("pace").get<std::string>()}, {"factor", document.at("factor").dump()}});
  if (read_arguments(set_pace, paced, pace)) throw std::runtime_error("impossible pace");
  session.pace = pace.pace;
  session.factor = pace.factor;
  if (!document.at("scenario").is_null()) {
    ScenarioSource source;
    source.file = document.at("scenario").get<std::string>();
    source.options.overrides = document.at("overrides").get<std::vector<std::string>>();
    const json& level = document.at("level_of_detail");
    if (!level.is_null()) source.options.level_of_detail = level.get<int>();
    session.source = source;
  }
  for (const json& change : document.at("changes")) {
    const std::string name = change.at("request").get<std::string>();
    std::vector<std::pair<std::string, std::string>> texts;
    for (const auto& [argument, text] : change.at("arguments").items())
      texts.emplace_back(argument, text.get<std::string>());
    if (read_request(name, arguments_of_text(name, texts), session.changes.emplace_back()))
      throw std::runtime_error("unknown change");
  }
  return session;
}

}  // namespace

SessionStore::SessionStore(const std::filesystem::path& directory, const std::string& cell)
    : directory_(std::filesystem::absolute(directory) / cell), periodic_directory_(directory_ / "periodic") {
  std::error_code error;
  std::filesystem::create_directories(periodic_directory_, error);
  if (error) {
    throw std::runtime_error("The directory of snapshots " + periodic_directory_.string() +
                             " cannot be made: " + error.message() + ".");
  }
  const auto known = periodic();
  if (!known.empty()) next_number_ = number_of(known.front()) + 1;
}

std::string SessionStore::refused_name(const std::string& name, const std::string& what) {
  constexpr std::size_t kLongest = 100;
  const auto fits = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '.';
  };
  if (!name.empty() && name.size() <= kLongest && name.front() != '.' &&
      std::all_of(name.begin(), name.end(), fits))
    return {};
  return "A " + what + " cannot be called '" + name.substr(0, kLongest) +
         "'; allowed are letters, digits, _, - and ., at most 100, no . first: it is a name, not a path.";
}

std::filesystem::path SessionStore::file_of(const std::string& name) const {
  return directory_ / (name + kSuffix);
}

std::vector<requests::SnapshotInfo> SessionStore::named() const {
  std::vector<requests::SnapshotInfo> found;
  const auto now = std::filesystem::file_time_type::clock::now();
  std::error_code error, gone;
  for (std::filesystem::directory_iterator entry(directory_, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().stem().string();
    if (entry->path().extension() != kSuffix || !refused_name(name).empty()) continue;
    const auto bytes = entry->file_size(gone);
    if (gone) continue;
    const std::chrono::duration<double> age = now - entry->last_write_time(gone);
    if (!gone) found.push_back({name, bytes, age.count()});
  }
  std::ranges::sort(found, {}, [](const auto& one) { return std::tie(one.age, one.name); });
  if (found.size() > kMostListed) found.resize(kMostListed);
  return found;
}

std::vector<std::filesystem::path> SessionStore::periodic() const {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(periodic_directory_, error), end; !error && entry != end;
       entry.increment(error)) {
    if (number_of(entry->path()) > 0) files.push_back(entry->path());
  }
  std::sort(files.begin(), files.end(),
            [](const auto& a, const auto& b) { return number_of(a) > number_of(b); });
  return files;
}

SnapshotResult SessionStore::write_periodic(const SnapshotIdentity& identity,
                                            std::span<const std::byte> state) {
  std::uint64_t number = 0;
  {
    const std::lock_guard lock(mutex_);
    number = next_number_++;
  }
  SnapshotResult result =
      write_snapshot_file(periodic_directory_ / (std::to_string(number) + kSuffix), identity, state);
  const auto files = periodic();
  for (std::size_t i = kKeptPeriodic; i < files.size(); ++i) {
    std::error_code gone_already;
    std::filesystem::remove(files[i], gone_already);
  }
  return result;
}

std::string SessionStore::write(const Session& session) {
  const std::string text = document_of(session);
  const std::lock_guard lock(mutex_);
  if (text == written_) return {};
  const std::filesystem::path file = periodic_directory_ / kSession;
  if (const std::error_code error = replace_file(file, {text}))
    return file.string() + " cannot be written: " + error.message() + ".";
  written_ = text;
  return {};
}

std::optional<Session> SessionStore::read() const {
  std::stringstream text;
  text << std::ifstream(periodic_directory_ / kSession).rdbuf();
  try {
    return session_of(json::parse(text.str()));
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

void SessionStore::begin() {
  std::error_code error;
  const auto files = periodic();
  if (!files.empty()) {
    for (std::size_t i = kKeptEarlier; i > 1; --i)
      std::filesystem::rename(file_of(previous_run_name(i - 1)), file_of(previous_run_name(i)), error);
    std::filesystem::rename(files.front(), file_of(previous_run_name(1)), error);
  }
  for (const auto& file : periodic()) std::filesystem::remove(file, error);
  std::filesystem::remove(periodic_directory_ / kSession, error);
}

std::string SessionStore::previous_run_name(std::size_t i) {
  return i == 1 ? "previous-run" : "previous-run-" + std::to_string(i);
}

}  // namespace takt
