#include "server/runtime/recording/log_records.h"

#include "idl/common/cdr.h"
#include "server/runtime/requests/control.h"

namespace takt {
namespace {

template <typename Record>
bool decode_as(LogKind kind, LogFields& fields, std::optional<LogRecord>& result) {
  if (LogCodec<Record>::kind != kind) return false;
  Record record;
  LogCodec<Record>::fields(fields, record);
  result = std::move(record);
  return true;
}

template <typename... Records>
void decode_one_of(LogKind kind, LogFields& fields, std::optional<LogRecord>& result,
                   const std::variant<Records...>*) {
  static_cast<void>((decode_as<Records>(kind, fields, result) || ...));
}

}  // namespace

std::string encoded(const requests::Any& request) {
  ControlRequest named = control_request(request);
  takt_msgs::msg::ControlRequest message;
  message.request = std::move(named.request);
  message.arguments = std::move(named.arguments);
  std::string bytes;
  cdr::write(message, bytes);
  return bytes;
}

std::string decode_request(std::string_view bytes, const CellDescription* cell, requests::Any& request) {
  takt_msgs::msg::ControlRequest message;
  if (!cdr::read(std::span(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()), message))
    return "a request cannot be read";
  auto parsed = parse({0, std::move(message.request), std::move(message.arguments)}, cell);
  if (auto* refusal = std::get_if<Refusal>(&parsed)) return refusal->message;
  request = std::get<requests::Any>(std::move(parsed));
  return {};
}

std::optional<LogRecord> decode(LogKind kind, StateReader& in, const CellDescription& cell) {
  LogFields fields(in, cell);
  std::optional<LogRecord> record;
  decode_one_of(kind, fields, record, static_cast<const LogRecord*>(nullptr));
  if (record) in.expect_end();
  return record;
}

}  // namespace takt
