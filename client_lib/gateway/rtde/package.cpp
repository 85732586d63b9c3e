#include "client_lib/gateway/rtde/package.h"

#include "client_lib/gateway/rtde/big_endian.h"

namespace takt::rtde {

std::string package(PackageType type, std::string_view payload) {
  std::string bytes;
  append(bytes, static_cast<std::uint16_t>(3 + payload.size()));
  append(bytes, static_cast<std::uint8_t>(type));
  bytes.append(payload);
  return bytes;
}

std::optional<Package> Splitter::next() {
  if (broken_) return std::nullopt;
  Reader head(std::string_view(buffer_).substr(begin_));
  const std::size_t size = head.u16();
  const std::uint8_t type = head.u8();
  if (head.failed()) return std::nullopt;
  if (size < 3 || std::string_view("VvMUOISP").find(static_cast<char>(type)) == std::string_view::npos) {
    broken_ = true;
    return std::nullopt;
  }
  if (buffer_.size() - begin_ < size) return std::nullopt;
  Package found{static_cast<PackageType>(type), buffer_.substr(begin_ + 3, size - 3)};
  begin_ += size;
  if (begin_ == buffer_.size() || begin_ > 65536) {
    buffer_.erase(0, begin_);
    begin_ = 0;
  }
  return found;
}

std::string text_message(int protocol, MessageLevel level, std::string_view text, std::string_view source) {
  std::string payload;
  text = text.substr(0, 255);
  source = source.substr(0, 255);
  if (protocol == 1) {
    append(payload, static_cast<std::uint8_t>(level));
    payload.append(text);
  } else {
    append(payload, static_cast<std::uint8_t>(text.size()));
    payload.append(text);
    append(payload, static_cast<std::uint8_t>(source.size()));
    payload.append(source);
    append(payload, static_cast<std::uint8_t>(level));
  }
  return package(PackageType::text_message, payload);
}

std::vector<std::string> split_names(std::string_view list) {
  std::vector<std::string> names;
  while (!list.empty()) {
    const std::size_t end = list.find(',');
    names.emplace_back(list.substr(0, end));
    if (end == std::string_view::npos) break;
    list.remove_prefix(end + 1);
  }
  return names;
}

std::string join_names(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ",") + name;
  return list;
}

}  // namespace takt::rtde
