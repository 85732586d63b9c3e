#pragma once
// The signals of a device as JSON: {"temperature": 300.0, ...}, each in the unit that its SignalInfo names.
#include <cstddef>
#include <nlohmann/json.hpp>
#include <vector>

#include "client_lib/cell.h"

namespace takt::tool {

/// `values`: of one instant, in the order of the device's signals (State::devices).
inline nlohmann::json signals_json(const client::DeviceInfo& device, const std::vector<double>& values) {
  auto document = nlohmann::json::object();
  for (std::size_t i = 0; i < device.signals.size(); ++i) document[device.signals[i].name] = values[i];
  return document;
}

}  // namespace takt::tool
