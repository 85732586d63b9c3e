#include <algorithm>

#include "idl/common/text.h"
#include "server/devices/device_type.h"
#include "server/headless/reference_pages.h"
#include "server/simulation/model/signals.h"

namespace takt {

namespace {

constexpr char kHead[] =
    "| signal | direction | type | unit | limits | meaning |\n|---|---|---|---|---|---|\n";

std::string row(const SignalDescription& signal, const std::string& limits, std::string_view doc) {
  return "| `" + signal.name + "` | " + (signal.commanded ? "input" : "output") + " | " +
         std::string(to_string(signal.type)) + " | " + signal.unit + " | " + limits + " | " +
         std::string(doc) + " |\n";
}

std::string limits_of(const SignalDescription& signal) {
  if (!signal.commanded) return "";
  return rounded_number(signal.lower) + " to " + rounded_number(signal.upper);
}

void section(std::string& page, const DeviceType& type) {
  const bool of_part = type.owner == DeviceType::Owner::part;
  page += std::string("\n## ") + type.key + "\n\n" + (of_part ? type.doc : type.item_doc) +
          " [Keys](scenario_reference.md#" +
          (of_part ? std::string("partsname") + type.key : std::string(type.key) + "name") + ").\n\n";
  if (!type.signals.empty()) {
    page += kHead;
    for (const KindSignal& signal : type.signals) {
      const SignalDescription described{signal.name,  signal.unit,  signal.commanded,
                                        signal.lower, signal.upper, signal.type};
      page += row(described, signal.has_own_limits() ? signal.limits : limits_of(described), signal.doc);
    }
  }
  if (*type.further_signals != '\0')
    page += std::string(type.signals.empty() ? "" : "\n") + type.further_signals + "\n";
}

}  // namespace

std::string signals_reference() {
  std::string page =
      "# Signals\n\n"
      "This page is made of the tables that devices are built from (`takt-run reference signals`). `takt "
      "signals` "
      "lists those of a running cell, with their values. Wires, forced values and sensors: "
      "[signals and sensors](signals_and_sensors.md).\n\n"
      "The name of a signal is that of its owner, a dot, and its own: `Barrier.blocked`. The owner is a "
      "device, a "
      "gripper or a robot; the device that a key of a Part makes is named `PART_KEY`. Clients, wires and "
      "PLCs set "
      "inputs within their limits. A boolean is 0 or 1.\n\n"
      "## Grippers\n\n";
  CellDescription cell;
  cell.grippers.emplace_back();
  page += kHead;
  for (const SignalDescription& signal : signals_of(cell, 0)) {
    const auto& all = kEnumeration<GripperSignal>.enumerators;
    const auto found = std::find_if(all.begin(), all.end(),
                                    [&](const EnumeratorInfo& one) { return one.name == signal.name; });
    page += row(signal, signal.unit == "m" && signal.commanded ? "0 to the largest width" : limits_of(signal),
                found->doc);
  }
  page +=
      "\n## Robots\n\nEach joint is an output under its own name: its position, in rad, of prismatic joints "
      "in "
      "m.\n";
  for (const DeviceType& type : device_types()) section(page, type);
  return page;
}

}  // namespace takt
