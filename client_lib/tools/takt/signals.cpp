// takt signals: every signal of the cell by its name, as wires and requests use it.
#include <algorithm>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "client_lib/tools/takt/commands.h"
#include "client_lib/tools/takt/sample_json.h"
#include "idl/common/enumeration.h"
#include "takt_enumerations.h"

namespace takt::tool {
namespace {

struct Row {
  std::string name;
  std::optional<double> value;  ///< unset: the state does not have it
  std::string unit;
  bool input = false, forced = false;
  std::string wire;
};

bool is_set(std::uint32_t bits, std::size_t signal) {
  return (bits >> signal & 1U) != 0;
}

/// What a state has of this signal of a gripper.
std::optional<double> value_of(const GripperState& gripper, GripperSignal signal) {
  switch (signal) {
    case GripperSignal::close:
    case GripperSignal::set_width:
      return std::nullopt;
    case GripperSignal::closed:
      return gripper.closed ? 1.0 : 0.0;
    case GripperSignal::width:
      return gripper.width;
    case GripperSignal::force:
      return gripper.force;
    case GripperSignal::moving:
      return gripper.moving ? 1.0 : 0.0;
    case GripperSignal::in_position:
      return gripper.in_position ? 1.0 : 0.0;
    case GripperSignal::part_present:
      return gripper.part >= 0 ? 1.0 : 0.0;
    case GripperSignal::part:
      return gripper.part;
  }
  return std::nullopt;
}

const char* unit_of(GripperSignal signal) {
  if (signal == GripperSignal::force) return "N";
  return signal == GripperSignal::width || signal == GripperSignal::set_width ? "m" : "";
}

std::vector<Row> rows_of(const State& state) {
  const CellInfo& info = *state.cell;
  std::vector<Row> rows;
  for (std::size_t d = 0; d < info.devices.size(); ++d)
    for (std::size_t i = 0; i < info.devices[d].signals.size(); ++i) {
      const auto& signal = info.devices[d].signals[i];
      rows.push_back({info.devices[d].name + "." + signal.name, state.devices[d].signals[i], signal.unit,
                      signal.commanded, is_set(state.devices[d].forced, i), signal.wire});
    }
  for (std::size_t g = 0; g < info.grippers.size(); ++g)
    for (const EnumeratorInfo& one : kEnumeration<GripperSignal>.enumerators) {
      const auto signal = static_cast<GripperSignal>(one.value);
      const bool input = signal == GripperSignal::close || signal == GripperSignal::set_width;
      rows.push_back({info.grippers[g].name + "." + std::string(one.name),
                      value_of(state.grippers[g], signal), unit_of(signal), input,
                      is_set(state.grippers[g].forced, static_cast<std::size_t>(one.value)), ""});
    }
  for (std::size_t r = 0; r < info.robots.size(); ++r)
    for (std::size_t j = 0; j < info.robots[r].joints.size(); ++j) {
      const auto& joint = info.robots[r].joints[j];
      rows.push_back({info.robots[r].name + "." + joint.name, state.robots[r].position[j],
                      joint.type == JointType::revolute ? "rad" : "m", false, false, ""});
    }
  return rows;
}

}  // namespace

int signals(const Common& common) {
  const State state = (*Session(common)).state();
  const std::vector<Row> rows = rows_of(state);
  if (common.json) {
    nlohmann::json document = nlohmann::json::array();
    for (const Row& row : rows) {
      nlohmann::json one{{"name", row.name}};
      one["value"] = row.value ? nlohmann::json(*row.value) : nlohmann::json();
      one["unit"] = row.unit;
      one["direction"] = row.input ? "in" : "out";
      one["forced"] = row.forced;
      one["wire"] = row.wire;
      document.push_back(std::move(one));
    }
    print_json(document, 2);
    return kOk;
  }
  int width = 6;
  for (const Row& row : rows) width = std::max(width, static_cast<int>(row.name.size()));
  std::printf("%-*s %14s %-8s %-4s\n", width, "signal", "value", "unit", "");
  for (const Row& row : rows) {
    std::printf("%-*s ", width, row.name.c_str());
    row.value ? std::printf("%14.7g", *row.value) : std::printf("%14s", "-");
    std::printf(" %-8s %-4s%s%s%s\n", row.unit.c_str(), row.input ? "in" : "out", row.forced ? " forced" : "",
                row.wire.empty() ? "" : " = ", row.wire.c_str());
  }
  return kOk;
}

}  // namespace takt::tool
