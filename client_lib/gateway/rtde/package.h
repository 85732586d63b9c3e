#pragma once
// Packages of RTDE (TCP 30004): uint16 size with its head of three bytes, uint8 type, payload.
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace takt::rtde {

enum class PackageType : std::uint8_t {
  request_protocol_version = 'V',
  get_urcontrol_version = 'v',
  text_message = 'M',
  data_package = 'U',
  setup_outputs = 'O',
  setup_inputs = 'I',
  start = 'S',
  pause = 'P',
};

struct Package {
  PackageType type = PackageType::text_message;
  std::string payload;
};

std::string package(PackageType type, std::string_view payload);

/// Splits a stream into packages. A size below three or an unknown type breaks the stream: no package follows.
class Splitter {
 public:
  void add(std::string_view bytes) { buffer_.append(bytes); }
  /// The next whole package.
  std::optional<Package> next();
  bool broken() const { return broken_; }

 private:
  std::string buffer_;
  std::size_t begin_ = 0;
  bool broken_ = false;
};

enum class MessageLevel : std::uint8_t { exception, error, warning, info };
/// Of a server.
std::string text_message(int protocol, MessageLevel level, std::string_view text, std::string_view source);

std::vector<std::string> split_names(std::string_view list);
std::string join_names(const std::vector<std::string>& names);

}  // namespace takt::rtde
