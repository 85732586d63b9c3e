#include "client_lib/tools/takt_modbus/modbus_mapping.h"

#include <algorithm>
#include <cmath>

#include "idl/common/parse.h"

namespace takt::tool {
namespace {

using namespace gateway;
using modbus::Area;
using modbus::NumberType;
using modbus::WordOrder;

constexpr double kModulo = 4294967296.0;  // of counters in two registers

const Choice<ModbusRole> kRoles{{{"server", ModbusRole::server}, {"client", ModbusRole::client}}};
const Choice<NumberType> kTypes{{{"int16", NumberType::int16},
                                 {"uint16", NumberType::uint16},
                                 {"int32", NumberType::int32},
                                 {"uint32", NumberType::uint32},
                                 {"float32", NumberType::float32}}};
const Choice<WordOrder> kOrders{{{"high_first", WordOrder::high_first}, {"low_first", WordOrder::low_first}}};
const Choice<bool> kDirections{{{"to_plc", false}, {"to_cell", true}}};
const Choice<ModbusSpecial> kCellValues{{{"step", ModbusSpecial::step},
                                         {"time_ms", ModbusSpecial::time_ms},
                                         {"playing", ModbusSpecial::playing}}};
const Choice<ModbusSpecial> kCellCoils{{{"allow_step", ModbusSpecial::allow_step}}};

struct AreaKeys {
  Area area;
  const char* key;
  const char* doc;
};
constexpr AreaKeys kAreaKeys[] = {
    {Area::coils, "coils", "Bits that the PLC writes, by address."},
    {Area::discrete_inputs, "discrete_inputs", "Bits that the PLC reads, by address."},
    {Area::holding_registers, "holding_registers", "Numbers that the PLC writes, by address."},
    {Area::input_registers, "input_registers", "Numbers that the PLC reads, by address."},
};

/// Limits of a commanded number, in the units of the element.
void limit(ModbusElement& e, const CellInfo& cell) {
  double lower = 0.0, upper = 0.0;
  if (!e.output.gripper.empty()) {
    if (!e.output.sets_width) return;
    upper = cell.grippers[static_cast<std::size_t>(cell.find_gripper(e.output.gripper))].max_width;
  } else {
    const auto& device = cell.devices[static_cast<std::size_t>(cell.find_device(e.output.device))];
    const auto signal = std::find_if(device.signals.begin(), device.signals.end(),
                                     [&](const auto& one) { return one.name == e.output.signal; });
    lower = signal->lower;
    upper = signal->upper;
  }
  if (modbus::is_bits(e.place.area) || e.output.inverted) return;
  const double a = (lower - e.output.offset) / e.output.scale, b = (upper - e.output.offset) / e.output.scale;
  // A float32 that stands for a limit may lie beyond it by its own rounding.
  const double slack = e.place.type == NumberType::float32 ? 1e-7 * std::max(std::abs(a), std::abs(b)) : 0.0;
  e.place.lower = std::min(a, b) - slack;
  e.place.upper = std::max(a, b) + slack;
}

void describe_joint(Fields& f, ModbusElement& e, const CellInfo& cell) {
  std::vector<std::string> robots, joints;
  for (const auto& robot : cell.robots) robots.push_back(robot.name);
  f.field("robot", e.robot, NameOf{robots, "a robot of the cell"}, "The robot, with its joint.");
  f.together("robot", "joint");
  const int robot = e.robot.empty() ? -1 : cell.find_robot(e.robot);
  if (robot >= 0)
    for (const auto& joint : cell.robots[static_cast<std::size_t>(robot)].joints)
      joints.push_back(joint.name);
  f.field("joint", e.joint, NameOf{joints, "a joint of the robot"},
          "The joint; the number is its position, rad or m.");
  if (robot < 0) return;
  e.special = ModbusSpecial::joint;
  e.joint_index = static_cast<std::size_t>(std::find(joints.begin(), joints.end(), e.joint) - joints.begin());
}

void describe_element(Fields& f, ModbusElement& e, Area area, const ModbusMapping& m, const CellInfo& cell) {
  e.place.area = area;
  const auto address = finite_number(e.name);
  const bool whole =
      address && *address >= 0.0 && *address < modbus::kAddresses && std::floor(*address) == *address;
  f.check(whole, "", "'" + e.name + "'",
          "an address, 0 to 65535 (the first holding register, '40001', is 0)");
  if (whole) e.place.address = static_cast<std::size_t>(*address);
  const bool written_area = area == Area::coils || area == Area::holding_registers;
  if (m.role == ModbusRole::server) {
    e.to_cell = written_area;
  } else {
    e.to_cell = !written_area;
    if (written_area)
      f.field("direction", e.to_cell, kDirections,
              "to_plc: takt writes it; to_cell: takt reads it. (role: client)");
  }
  if (!modbus::is_bits(area)) {
    e.place.order = m.word_order;
    f.field("type", e.place.type, kTypes, "The number: int16 and uint16 take one register, the others two.",
            kRequired);
    f.field("word_order", e.place.order, kOrders,
            "Of two registers, where it differs from that of the file.");
  }
  f.check(e.place.address + e.place.count() <= modbus::kAddresses, "", "address 65535 for two registers",
          "0 to 65534");
  std::vector<std::string> others;
  if (!e.to_cell) {
    others = {"robot", "cell"};
    describe_joint(f, e, cell);
    f.field("cell", e.special, kCellValues,
            "A value of the cell: step (counted since the last reset), time_ms (simulated time), both modulo "
            "2^32, "
            "or playing.");
    describe_input(f, e.input, cell, others);
  } else {
    if (area == Area::coils && m.role == ModbusRole::server) {
      others = {"cell"};
      f.field("cell", e.special, kCellCoils,
              "allow_step (with --lockstep): the PLC writes 1, takt passes one period and writes 0.");
    }
    describe_output(f, e.output, cell, others);
    std::optional<double> substitute;
    f.field("substitute", substitute, NumberRange{},
            "The number, in the units of this element, that the cell gets when the PLC is silent. Without it "
            "the last "
            "value stays.");
    e.substitute = substitute;
    if (f.reading() && e.special == ModbusSpecial::none) {
      f.check(e.output.scale != 0.0, "scale", "0", "another number");
      limit(e, cell);
      if (e.substitute)
        f.check(*e.substitute >= e.place.lower && *e.substitute <= e.place.upper, "substitute",
                std::to_string(*e.substitute), "a number within the limits of the signal");
    }
  }
  if (f.reading() && !e.to_cell) f.check(e.input.scale != 0.0, "scale", "0", "another number");
}

void check_overlap(Fields& f, const std::vector<ModbusElement>& elements, const AreaKeys& area) {
  for (std::size_t i = 0; i < elements.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const modbus::Element &a = elements[j].place, &b = elements[i].place;
      if (a.address < b.address + b.count() && b.address < a.address + a.count())
        f.fail(area.key,
               "addresses " + elements[j].name + " and " + elements[i].name + " with a common register",
               "32-bit values take two addresses");
    }
}

}  // namespace

std::vector<modbus::Element> ModbusMapping::places() const {
  std::vector<modbus::Element> result;
  for (const ModbusElement& element : elements) result.push_back(element.place);
  return result;
}

std::vector<std::string> ModbusMapping::targets() const {
  std::vector<OutputMapping> outputs;
  for (const ModbusElement& element : elements)
    if (element.to_cell && element.special == ModbusSpecial::none) outputs.push_back(element.output);
  return targets_of("", outputs);
}

double ModbusMapping::number_of(const ModbusElement& e, const State& state, bool playing) {
  const auto scaled = [&](double number) { return (number - e.input.offset) / e.input.scale; };
  switch (e.special) {
    case ModbusSpecial::step:
      return std::fmod(static_cast<double>(state.step), kModulo);
    case ModbusSpecial::time_ms:
      return std::fmod(std::round(1e3 * state.time), kModulo);
    case ModbusSpecial::playing:
      return playing ? 1.0 : 0.0;
    case ModbusSpecial::joint:
      return scaled(state.robot(e.robot).position.at(e.joint_index));
    default:
      return modbus::is_bits(e.place.area) ? (digital(e.input, state) ? 1.0 : 0.0)
                                           : gateway::number_of(e.input, state);
  }
}

double ModbusMapping::present_of(const ModbusElement& e, const State& state) {
  if (e.special != ModbusSpecial::none) return 0.0;
  double number = 0.0;
  if (!e.output.gripper.empty() && !e.output.sets_width) {
    const bool closed = state.gripper(e.output.gripper).closed;
    return closed != e.output.inverted ? 1.0 : 0.0;
  }
  if (!e.output.gripper.empty())
    number = state.gripper(e.output.gripper).width;
  else
    number = state.signals(e.output.device).at(e.output.signal);
  number = (number - e.output.offset) / e.output.scale;
  return e.output.inverted ? (number != 0.0 ? 0.0 : 1.0) : number;
}

ModbusMapping read_modbus_mapping(const std::filesystem::path& file, const CellInfo& cell) {
  ModbusMapping m;
  const YamlSource source{file, {}};
  Fields f(source, load_yaml(file));
  int version = 1;
  f.field("takt_modbus", version, WholeRange{1, 1}, "Version of the format.", kRequired);
  f.field("role", m.role, kRoles, "What takt is: server (the PLC polls takt) or client (takt polls the PLC).",
          kRequired);
  if (m.role == ModbusRole::client) m.port = 502;
  if (m.role == ModbusRole::client) m.unit = 1;
  f.field("address", m.address, Text{},
          "server: IP address where takt listens (0.0.0.0: every network of this machine); client: the PLC's "
          "host.");
  f.field("port", m.port, WholeRange{0, 65535},
          "TCP port; 5020 of the server, 502 of the client without it.");
  f.field("unit", m.unit, WholeRange{0, 255}, "Unit id. Of a server: the only one that it answers; 0: any.");
  f.when("role", kRoles, m.role, {ModbusRole::server}, [&] {
    f.field("most_clients", m.most_clients, WholeRange{1, 1000},
            "Connections at once; a further one is closed.");
    f.field("period_s", m.period_s, positive("s"),
            "With --lockstep: simulated time of one step that the PLC allows.");
  });
  f.when("role", kRoles, m.role, {ModbusRole::client}, [&] {
    f.field("poll_ms", m.poll_ms, WholeRange{1, 60000}, "Time between the beginnings of two cycles.");
    f.field("function_23", m.function_23, Flag{},
            "Registers are written and read by one request (function 23).");
  });
  f.field("word_order", m.word_order, kOrders, "Which register of a 32-bit value comes first.");
  f.section("silence", "What happens when the PLC is silent.", [&] {
    f.field("deadline_s", m.deadline_s, positive("s"),
            "server: time without a request of a client that has written; client: time without a complete "
            "cycle. Then the "
            "elements with 'substitute' get that value.");
  });
  for (const AreaKeys& area : kAreaKeys) {
    std::vector<ModbusElement> elements;
    f.entries(
        area.key, elements, area.doc, "An element, by its address.", 0, [] { return ModbusElement{}; },
        [&](ModbusElement& element) { describe_element(f, element, area.area, m, cell); });
    if (f.reading()) check_overlap(f, elements, area);
    m.elements.insert(m.elements.end(), elements.begin(), elements.end());
  }
  f.check(!m.elements.empty(), "", "no element",
          "coils, discrete_inputs, holding_registers or input_registers with an element");
  f.finish();
  return m;
}

}  // namespace takt::tool
