#include "server/runtime/recording/command_log.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstring>

namespace takt {
namespace {

constexpr std::array<char, 8> kLogMagic{'T', 'A', 'K', 'T', 'L', 'O', 'G', '\n'};
constexpr std::uint32_t kFormat = 4;
constexpr std::size_t kFileHeadSize = kLogMagic.size() + sizeof(kFormat);
constexpr std::size_t kLeastContent = 1 + sizeof(std::uint64_t);

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

LogReader::LogReader(const std::filesystem::path& file)
    : name_("the log '" + file.string() + "'"), in_(file, std::ios::binary) {
  std::error_code unreadable;
  if (!in_ || !std::filesystem::is_regular_file(file, unreadable))
    throw LogError(
        name_ + " cannot be opened: " +
        (std::filesystem::exists(file, unreadable) ? "it is not a readable file" : "it does not exist"));
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
