#include "client_lib/view/metrics.h"

#include <prometheus/gauge.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>

#include <chrono>
#include <map>
#include <span>
#include <stdexcept>

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

}  // namespace

struct Metrics::Impl {
  Impl(Stream& s, const std::string& c) : stream(s), cell(c) {}
  Stream& stream;
  const std::string cell;
  prometheus::Registry registry;
  std::map<std::string, prometheus::Family<prometheus::Gauge>*> families;
  std::uint32_t channel = 0;

  void set(const std::string& name, const std::string& help, double value,
           const prometheus::Labels& more = {}) {
    auto& family = families[name];
    if (family == nullptr)
      family = &prometheus::BuildGauge().Name(name).Help(help).Labels({{"cell", cell}}).Register(registry);
    family->Add(more).Set(value);
  }
};

Metrics::Metrics(Stream& stream, const std::string& cell) : impl_(std::make_unique<Impl>(stream, cell)) {}
Metrics::~Metrics() = default;

std::string Metrics::text() {
  Impl& impl = *impl_;
  if (impl.channel == 0)
    for (const Channel& channel : impl.stream.channels_from(0))
      if (channel.type == message_info<takt_msgs::msg::Status>().name) impl.channel = channel.id;
  const Sample sample = impl.channel == 0 ? Sample{} : impl.stream.newest(impl.channel);
  const bool up = sample.bytes && wall_s() - 1e-9 * static_cast<double>(sample.time_ns) < kSilence_s;
  impl.set("takt_up", "1 while the server sends its status.", up ? 1.0 : 0.0);
  if (up) {
    takt_msgs::msg::Status status;
    if (!cdr::read(bytes_of(*sample.bytes), status))
      throw std::runtime_error("A sample of the status ends before its last member.");
    for_each_field(status, [&](const FieldInfo& field, const auto& value) {
      using Value = std::decay_t<decltype(value)>;
      if constexpr (std::is_arithmetic_v<Value> || std::is_enum_v<Value>)
        impl.set("takt_" + std::string(field.name) + (field.unit == "s" ? "_seconds" : ""), help_of(field),
                 static_cast<double>(value));
    });
    impl.set("takt_fault", "1 when a fault has stopped the simulation.", status.fault.empty() ? 0.0 : 1.0);
    for (const auto& process : status.processes)
      impl.set("takt_level_of_detail", "Of a process, 1 to 3.", process.level_of_detail,
               {{"process", process.name}});
  }
  return prometheus::TextSerializer().Serialize(impl.registry.Collect());
}

}  // namespace takt::view
