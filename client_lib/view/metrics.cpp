#include "client_lib/view/metrics.h"

#include <prometheus/gauge.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>

#include <chrono>
#include <map>
#include <span>
#include <stdexcept>
#include <utility>

#include "idl/common/cdr.h"
#include "takt_msgs.h"

namespace takt::view {
namespace {

constexpr double kSilence_s = 5.0;

/// Meaning of a field; of an enumeration also the names of its numbers.
std::string help_of(const FieldInfo& field) {
  std::string help(field.doc);
  if (field.enumeration != nullptr)
    for (const EnumeratorInfo& one : field.enumeration->enumerators)
      help += (help.empty() ? "" : ", ") + std::to_string(one.value) + " " + std::string(one.name);
  return help;
}

std::span<const std::uint8_t> bytes_of(const std::string& sample) {
  return {reinterpret_cast<const std::uint8_t*>(sample.data()), sample.size()};
}

double wall_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

/// The metrics of one answer: what has no value leaves none behind.
class Gauges {
 public:
  explicit Gauges(std::string cell) : cell_(std::move(cell)) {}

  void set(const std::string& name, const std::string& help, double value,
           const prometheus::Labels& more = {}) {
    auto& family = families_[name];
    if (family == nullptr)
      family = &prometheus::BuildGauge().Name(name).Help(help).Labels({{"cell", cell_}}).Register(registry_);
    family->Add(more).Set(value);
  }
  /// Each number of a message.
  template <typename Message>
  void set_numbers(const std::string& prefix, const Message& message, const prometheus::Labels& more = {}) {
    for_each_field(message, [&](const FieldInfo& field, const auto& value) {
      using Value = std::decay_t<decltype(value)>;
      if constexpr (std::is_arithmetic_v<Value> || std::is_enum_v<Value>)
        set(prefix + std::string(field.name) + (field.unit == "s" ? "_seconds" : ""), help_of(field),
            static_cast<double>(value), more);
    });
  }
  std::string text() const { return prometheus::TextSerializer().Serialize(registry_.Collect()); }

 private:
  const std::string cell_;
  prometheus::Registry registry_;
  std::map<std::string, prometheus::Family<prometheus::Gauge>*> families_;
};

}  // namespace

Metrics::Metrics(Stream& stream, std::string cell) : stream_(stream), cell_(std::move(cell)) {}

std::string Metrics::text() {
  if (channel_ == 0)
    for (const Channel& channel : stream_.channels_from(0))
      if (channel.type == message_info<takt_msgs::msg::Status>().name) channel_ = channel.id;
  const Sample sample = channel_ == 0 ? Sample{} : stream_.newest(channel_);
  const bool up = sample.bytes && wall_s() - 1e-9 * static_cast<double>(sample.time_ns) < kSilence_s;
  Gauges gauges(cell_);
  gauges.set("takt_up", "1 while the server sends its status.", up ? 1.0 : 0.0);
  if (up) {
    takt_msgs::msg::Status status;
    if (!cdr::read(bytes_of(*sample.bytes), status))
      throw std::runtime_error("A sample of the status ends before its last member.");
    gauges.set_numbers("takt_", status);
    gauges.set("takt_fault", "1 when a fault has stopped the simulation.", status.fault.empty() ? 0.0 : 1.0);
    for (const auto& process : status.processes)
      gauges.set("takt_level_of_detail", "Of a process, 1 to 3.", process.level_of_detail,
                 {{"process", process.name}});
    for (const auto& gateway : status.gateways)
      gauges.set_numbers("takt_gateway_", gateway,
                         {{"gateway", gateway.name}, {"protocol", gateway.protocol}});
  }
  return gauges.text();
}

}  // namespace takt::view
