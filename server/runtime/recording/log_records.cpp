#include "server/runtime/recording/log_records.h"

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

std::optional<LogRecord> decode(LogKind kind, StateReader& in, const CellDescription& cell) {
  LogFields fields(in, cell);
  std::optional<LogRecord> record;
  decode_one_of(kind, fields, record, static_cast<const LogRecord*>(nullptr));
  if (record) in.expect_end();
  return record;
}

}  // namespace takt
