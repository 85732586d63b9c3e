#include "server/runtime/recording/command_log.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "plant_models/state_bytes.h"

namespace takt {
namespace {

constexpr std::array<char, 8> kLogMagic{'T', 'A', 'K', 'T', 'L', 'O', 'G', '\n'};
constexpr std::uint32_t kFormat = 3;
constexpr std::size_t kFileHeadSize = kLogMagic.size() + sizeof(kFormat);
constexpr std::size_t kLeastContent = 1 + sizeof(std::uint64_t);
constexpr std::size_t kMaxText = 1U << 20U;
constexpr std::size_t kMaxItems = 100000;

struct RecordHead {
  std::uint32_t size;      ///< of the content
  std::uint32_t checksum;  ///< of the content
  std::uint32_t check;     ///< of the two above
};
static_assert(sizeof(RecordHead) == LogFraming::kHeadSize);

std::uint32_t crc(std::uint32_t before, const void* from, std::size_t size) {
  return static_cast<std::uint32_t>(crc32_z(before, static_cast<const Bytef*>(from), size));
}

}  // namespace

std::vector<std::byte> LogFraming::file_head() {
  std::vector<std::byte> head(kFileHeadSize);
  std::memcpy(head.data(), kLogMagic.data(), kLogMagic.size());
  std::memcpy(head.data() + kLogMagic.size(), &kFormat, sizeof(kFormat));
  return head;
}

void LogFraming::append(std::vector<std::byte>& out, std::span<const std::byte> content) {
  RecordHead head{};
  head.size = static_cast<std::uint32_t>(content.size());
  head.checksum = crc(checksum_, content.data(), content.size());
  head.check = crc(checksum_, &head, offsetof(RecordHead, check));
  checksum_ = head.checksum;
  const auto* bytes = reinterpret_cast<const std::byte*>(&head);
  out.insert(out.end(), bytes, bytes + sizeof(head));
  out.insert(out.end(), content.begin(), content.end());
}

void encode(std::vector<std::byte>& out, const LogScenario& logged) {
  StateWriter writer(out);
  const auto& options = logged.source.options;
  writer.put(std::string_view(logged.source.file.native()));
  writer.put_size(options.overrides.size());
  for (const std::string& text : options.overrides) writer.put(std::string_view(text));
  writer.put(static_cast<std::int32_t>(options.level_of_detail.value_or(0)));
  writer.put_size(logged.changes.size());
  for (const ControlRequest& request : logged.changes) {
    writer.put(std::string_view(request.request));
    writer.put_size(request.arguments.size());
    for (const auto& [name, value] : request.arguments) {
      writer.put(std::string_view(name));
      writer.put(std::string_view(value));
    }
  }
  writer.put(std::string_view(logged.scenario));
  writer.put(logged.model);
  writer.put(logged.state);
}

LogScenario decode_scenario(std::span<const std::byte> content) {
  StateReader reader(content, "the record of what was loaded");
  LogScenario logged;
  auto& options = logged.source.options;
  logged.source.file = reader.text(kMaxText, "letters of the file's name");
  options.overrides.resize(reader.size(kMaxItems, "overrides"));
  for (std::string& text : options.overrides) text = reader.text(kMaxText, "letters of an override");
  if (const int level = reader.integer<std::int32_t>(0, 3, "the level of detail"); level != 0)
    options.level_of_detail = level;
  logged.changes.resize(reader.size(kMaxItems, "changes"));
  for (ControlRequest& request : logged.changes) {
    request.request = reader.text(kMaxText, "letters of a request");
    request.arguments.resize(reader.size(kMaxItems, "arguments"));
    for (auto& [name, value] : request.arguments) {
      name = reader.text(kMaxText, "letters of an argument");
      value = reader.text(kMaxText, "letters of an argument");
    }
  }
  logged.scenario = reader.text(kMaxText, "letters of the scenario's name");
  logged.model = reader.get<std::uint64_t>();
  logged.state = reader.get<std::uint64_t>();
  reader.expect_end();
  return logged;
}

LogReader::LogReader(const std::filesystem::path& file)
    : name_("the log '" + file.string() + "'"), in_(file, std::ios::binary) {
  std::error_code unreadable;
  if (!in_ || !std::filesystem::is_regular_file(file, unreadable))
    throw LogError(name_ + " cannot be opened: " +
                   (std::filesystem::exists(file, unreadable) ? "it is no readable file" : "there is none"));
  length_ = std::filesystem::file_size(file);
  std::array<char, kFileHeadSize> head{};
  in_.read(head.data(), head.size());
  const auto found = static_cast<std::size_t>(in_.gcount());
  const std::size_t compared = std::min(found, kLogMagic.size());
  if (std::memcmp(head.data(), kLogMagic.data(), compared) != 0)
    throw LogError(name_ + " is no log of takt: it begins otherwise");
  torn_ = found < kFileHeadSize;
  if (torn_) return;
  std::uint32_t format = 0;
  std::memcpy(&format, head.data() + kLogMagic.size(), sizeof(format));
  if (format != kFormat)
    throw LogError(name_ + " has format " + std::to_string(format) + "; this program reads format " +
                   std::to_string(kFormat));
  at_ = kFileHeadSize;
}

void LogReader::damaged(const std::string& what) const {
  throw LogError(name_ + " is damaged at byte " + std::to_string(at_) + ": " + what);
}

bool LogReader::next(LogEntry& entry) {
  if (torn_ || at_ == length_) return false;
  RecordHead head{};
  if (length_ - at_ < sizeof(head)) {
    torn_ = true;
    return false;
  }
  in_.read(reinterpret_cast<char*>(&head), sizeof(head));
  if (!in_) damaged("it cannot be read");
  if (head.check != crc(framing_.checksum_, &head, offsetof(RecordHead, check)))
    damaged("the head of a record is not what was written");
  if (head.size < kLeastContent) damaged("a record is too short");
  if (length_ - at_ - sizeof(head) < head.size) {
    torn_ = true;
    return false;
  }
  entry.content.resize(head.size);
  in_.read(reinterpret_cast<char*>(entry.content.data()), static_cast<std::streamsize>(head.size));
  if (!in_) damaged("it cannot be read");
  if (head.checksum != crc(framing_.checksum_, entry.content.data(), entry.content.size()))
    damaged("the checksum of a record is not that of its content");
  framing_.checksum_ = head.checksum;
  at_ += sizeof(head) + head.size;
  entry.kind = static_cast<LogKind>(entry.content[0]);
  std::memcpy(&entry.step, entry.content.data() + 1, sizeof(entry.step));
  entry.content.erase(entry.content.begin(), entry.content.begin() + kLeastContent);
  return true;
}

}  // namespace takt
