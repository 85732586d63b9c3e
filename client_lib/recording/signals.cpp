#include "client_lib/recording/signals.h"

#include <algorithm>
#include <set>

#include "idl/common/glob.h"
#include "takt_msgs.h"

namespace takt::recording {
namespace {

bool fits_one(const std::string& name, const std::vector<std::string>& patterns) {
  return std::any_of(patterns.begin(), patterns.end(),
                     [&](const std::string& pattern) { return glob_match(pattern, name); });
}

/// Whether a signal of the topic can fit one of the patterns: only then its samples are looked at.
bool can_fit(const std::string& topic, const std::vector<std::string>& patterns) {
  return std::any_of(patterns.begin(), patterns.end(), [&](const std::string& pattern) {
    const std::string head = pattern.substr(0, pattern.find('*'));
    const std::string begin = topic + ".";
    return head.size() < begin.size() ? begin.starts_with(head) : head.starts_with(begin);
  });
}

}  // namespace

std::string short_topic(const std::string& topic) {
  const std::size_t second = topic.find('/', 1);
  return second == std::string::npos ? topic.substr(topic.starts_with('/') ? 1 : 0)
                                     : topic.substr(second + 1);
}

std::optional<double> sample_time_s(const Json& sample) {
  if (!sample.is_object()) return std::nullopt;
  if (const auto time = sample.find("time"); time != sample.end() && time->is_number())
    return time->get<double>();
  const Json* holder = &sample;
  if (const auto header = sample.find("header"); header != sample.end()) holder = &*header;
  const auto stamp = holder->find("stamp");
  if (stamp == holder->end() || !stamp->is_object()) return std::nullopt;
  double time_ns = 0.0;
  for (const auto& [key, unit_ns] : {std::pair{"sec", 1e9}, {"nanosec", 1.0}}) {
    const auto part = stamp->find(key);
    if (part == stamp->end()) continue;
    if (!part->is_number()) return std::nullopt;  // another's member of that name
    time_ns += part->get<double>() * unit_ns;
  }
  return time_ns / 1e9;
}

void with_first_description(McapReader& recording, const std::function<void(const McapMessage&)>& function) {
  const auto describes = [&](const McapChannel& channel) {
    return channel.encoding == "cdr" &&
           channel.type == message_info<takt_msgs::msg::CellDescription>().name &&
           recording.types().find(channel.type) != nullptr;
  };
  const auto& channels = recording.channels();
  if (std::none_of(channels.begin(), channels.end(),
                   [&](const auto& entry) { return describes(entry.second); }))
    return;
  recording.read([&](const McapMessage& message) {
    if (!describes(*message.channel)) return true;
    function(message);
    return false;
  });
}

void read_signals(McapReader& recording, const std::vector<std::string>& patterns,
                  const std::function<void(const SignalSample&)>& function) {
  SignalNames names;
  const auto json_of = [&](const McapMessage& message) {
    return to_json(recording.types(), message.channel->type, message.sample);
  };
  with_first_description(recording, [&](const McapMessage& message) { names.describe(json_of(message)); });
  recording.read([&](const McapMessage& message) {
    const McapChannel& channel = *message.channel;
    if (channel.encoding != "cdr" || recording.types().find(channel.type) == nullptr) return true;
    const bool description = channel.type == message_info<takt_msgs::msg::CellDescription>().name;
    SignalSample sample;
    sample.topic = short_topic(channel.topic);
    if (!description && !can_fit(sample.topic, patterns)) return true;
    const Json json = json_of(message);
    if (description) {
      names.describe(json);
      return true;
    }
    sample.time_s = sample_time_s(json).value_or(static_cast<double>(message.log_time_ns) * 1e-9);
    if (const auto epoch = json.find("epoch"); epoch != json.end() && epoch->is_number_unsigned())
      sample.epoch = epoch->get<std::uint32_t>();
    names.visit(json, [&](const std::string& name, double value) {
      std::string full = sample.topic + "." + name;
      if (fits_one(full, patterns)) sample.values.push_back({std::move(full), value});
    });
    if (!sample.values.empty()) function(sample);
    return true;
  });
}

std::vector<std::string> signal_names(McapReader& recording, const std::vector<std::string>& patterns) {
  std::vector<std::string> names;
  std::set<std::string> known;
  read_signals(recording, patterns, [&](const SignalSample& sample) {
    for (const SignalValue& value : sample.values)
      if (known.insert(value.name).second) names.push_back(value.name);
  });
  return names;
}

}  // namespace takt::recording
