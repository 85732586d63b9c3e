#include "client_lib/view/foxglove.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "client_lib/recording/json_text.h"

namespace takt::view::foxglove {
namespace {

using nlohmann::json;
using recording::json_text;
using recording::read_json;

template <typename Integer>
void append(std::string& bytes, Integer value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

Value value_of(const json& from) {
  constexpr std::uint64_t kLargest = std::numeric_limits<std::int64_t>::max();
  Value value;
  const auto all = [&](auto is) { return std::ranges::all_of(from, is); };
  if (from.is_boolean()) {
    value.kind = ValueKind::boolean;
    value.flag = from.get<bool>();
  } else if (from.is_number_integer() &&
             !(from.is_number_unsigned() && from.get<std::uint64_t>() > kLargest)) {
    value.kind = ValueKind::integer;
    value.integer = from.get<std::int64_t>();
  } else if (from.is_number()) {
    value.kind = ValueKind::number;
    value.number = from.get<double>();
  } else if (from.is_string()) {
    value.kind = ValueKind::text;
    value.text = from.get<std::string>();
  } else if (from.is_array() && all([](const json& one) { return one.is_string(); })) {
    value.kind = ValueKind::texts;
    value.texts = from.get<std::vector<std::string>>();
  } else if (from.is_array() && all([](const json& one) { return one.is_number(); })) {
    value.kind = ValueKind::numbers;
    value.numbers = from.get<std::vector<double>>();
  } else {
    value.kind = ValueKind::document;
    value.text = json_text(from);
  }
  return value;
}

constexpr char kSampleOpcode = 1, kServiceResponseOpcode = 3, kServiceRequestOpcode = 2;

}  // namespace

std::string server_info(const std::string& name, const std::string& session, const Texts& metadata) {
  json message{{"op", "serverInfo"},           {"name", name},
               {"capabilities", {"services"}}, {"supportedEncodings", {"json"}},
               {"sessionId", session},         {"metadata", json::object()}};
  for (const auto& [key, value] : metadata) message["metadata"][key] = value;
  return json_text(message);
}

std::string advertise(std::span<const Channel> channels) {
  json message{{"op", "advertise"}, {"channels", json::array()}};
  for (const Channel& channel : channels)
    message["channels"].push_back({{"id", channel.id},
                                   {"topic", channel.topic},
                                   {"encoding", channel.encoding},
                                   {"schemaName", channel.type},
                                   {"schemaEncoding", channel.schema_encoding},
                                   {"schema", channel.schema}});
  return json_text(message);
}

std::string advertise_control() {
  const json schema{{"type", "object"},
                    {"properties", {{"request", {{"type", "string"}}}, {"arguments", {{"type", "object"}}}}}};
  const json reply{{"type", "object"},
                   {"properties",
                    {{"result", {{"type", "integer"}}},
                     {"message", {{"type", "string"}}},
                     {"values", {{"type", "object"}}}}}};
  const auto part = [](const char* name, const json& what) {
    return json{{"encoding", "json"},
                {"schemaName", name},
                {"schemaEncoding", "jsonschema"},
                {"schema", json_text(what)}};
  };
  return json_text(json{{"op", "advertiseServices"},
                        {"services",
                         {{{"id", kControlService},
                           {"name", "/control"},
                           {"type", "takt.Control"},
                           {"request", part("takt.ControlRequest", schema)},
                           {"response", part("takt.ControlReply", reply)},
                           {"requestSchema", json_text(schema)},
                           {"responseSchema", json_text(reply)}}}}});
}

std::string status(int level, const std::string& message) {
  return json_text(json{{"op", "status"}, {"level", level}, {"message", message}});
}

std::string service_failure(std::uint32_t service, std::uint32_t call, const std::string& message) {
  return json_text(
      json{{"op", "serviceCallFailure"}, {"serviceId", service}, {"callId", call}, {"message", message}});
}

std::array<char, kSampleHead_bytes> sample_head(std::uint32_t subscription, std::uint64_t time_ns) {
  std::array<char, kSampleHead_bytes> head{kSampleOpcode};
  std::memcpy(head.data() + 1, &subscription, sizeof(subscription));
  std::memcpy(head.data() + 5, &time_ns, sizeof(time_ns));
  return head;
}

std::string service_response(std::uint32_t service, std::uint32_t call, const Answer& answer) {
  const json reply{{"result", static_cast<int>(answer.result)},
                   {"message", answer.message},
                   {"values", recording::values_json(answer.values)}};
  constexpr std::string_view encoding = "json";
  std::string bytes(1, kServiceResponseOpcode);
  append(bytes, service);
  append(bytes, call);
  append(bytes, static_cast<std::uint32_t>(encoding.size()));
  bytes += encoding;
  bytes += json_text(reply);
  return bytes;
}

std::optional<ClientMessage> read_text(std::string_view text) {
  const std::optional<json> parsed = read_json(text);
  if (!parsed || !parsed->is_object()) return std::nullopt;
  const json& message = *parsed;
  ClientMessage read;
  try {
    const std::string op = message.value("op", "");
    if (op == "subscribe")
      for (const json& wanted : message.at("subscriptions"))
        read.subscribe.push_back(
            {wanted.at("id").get<std::uint32_t>(), wanted.at("channelId").get<std::uint32_t>()});
    else if (op == "unsubscribe")
      for (const json& id : message.at("subscriptionIds"))
        read.unsubscribe.push_back(id.get<std::uint32_t>());
  } catch (const json::exception&) {
    return std::nullopt;
  }
  return read;
}

std::optional<ServiceCall> read_binary(std::string_view message, bool may_control) {
  if (message.empty() || message[0] != kServiceRequestOpcode) return std::nullopt;
  message.remove_prefix(1);
  const auto take = [&](std::uint32_t& value) {
    if (message.size() < sizeof(value)) return false;
    std::memcpy(&value, message.data(), sizeof(value));
    message.remove_prefix(sizeof(value));
    return true;
  };
  ServiceCall call;
  std::uint32_t length = 0;
  if (!take(call.service) || !take(call.call) || !take(length) || message.size() < length)
    return std::nullopt;
  const std::string_view encoding = message.substr(0, length);
  message.remove_prefix(length);
  if (!may_control) {
    call.problem = "Observers may look, not touch.";
    return call;
  }
  if (call.service != kControlService) {
    call.problem = "There is no such service.";
    return call;
  }
  const std::optional<json> parsed = encoding == "json" ? read_json(message) : std::nullopt;
  if (!parsed || !parsed->is_object() || !parsed->contains("request") || !parsed->at("request").is_string()) {
    call.problem = "A request in JSON is wanted: {\"request\": \"step\", \"arguments\": {\"steps\": 1}}.";
    return call;
  }
  const json& body = *parsed;
  call.request = body.at("request").get<std::string>();
  if (const auto arguments = body.find("arguments"); arguments != body.end() && arguments->is_object())
    for (const auto& [key, value] : arguments->items()) call.arguments.push_back({key, value_of(value)});
  return call;
}

}  // namespace takt::view::foxglove
