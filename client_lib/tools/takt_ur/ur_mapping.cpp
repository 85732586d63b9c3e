#include "client_lib/tools/takt_ur/ur_mapping.h"

#include <algorithm>
#include <charconv>

#include "client_lib/gateway/force_sensor.h"
#include "client_lib/gateway/rtde/variables.h"

namespace takt::ur {
namespace {

const Choice<bool> kPositions{{{"actual_q", false}, {"target_q", true}}};
constexpr const char* kOutputNames =
    "standard_digital_output_0..7, configurable_digital_output_0..7, tool_digital_output_0..1, "
    "standard_analog_output_0..1, input_bit_register_64..127, input_int_register_0..47, "
    "input_double_register_0..47; in "
    "the role of a follower output_bit_register_N, output_int_register_N, output_double_register_N besides";
constexpr const char* kInputNames =
    "standard_digital_input_0..7, configurable_digital_input_0..7, tool_digital_input_0..1, "
    "standard_analog_input0..1, "
    "tool_analog_input0..1, output_bit_register_64..127, output_int_register_0..47, "
    "output_double_register_0..47; in the "
    "role of a follower input_bit_register_N, input_int_register_N, input_double_register_N besides";

/// `stem` and a number from first to last.
bool is_numbered(const std::string& name, std::string_view stem, int first, int last) {
  if (name.substr(0, stem.size()) != stem) return false;
  int number = -1;
  const char* end = name.data() + name.size();
  const auto [stopped, problem] = std::from_chars(name.data() + stem.size(), end, number);
  return problem == std::errc{} && stopped == end && number >= first && number <= last;
}

bool is_register(const std::string& name) {
  for (const char* direction : {"input", "output"})
    if (is_numbered(name, std::string(direction) + "_bit_register_", 64, 127) ||
        is_numbered(name, std::string(direction) + "_int_register_", 0, 47) ||
        is_numbered(name, std::string(direction) + "_double_register_", 0, 47))
      return true;
  return false;
}

struct Port : WholeRange {
  Port() : WholeRange{1, 65535} {}
};

void describe_program(Fields& f, NamedProgram& p) {
  f.field("script", p.script, f.file(),
          "URScript of the program (docs/controllers.md); without it a driver serves the program, as for the "
          "URCap "
          "External Control.");
  f.field("host", p.host, Text{},
          "Of the driver that serves the program; without it the client that sends play.");
  f.field("port", p.port, Port{}, "Of that driver.");
}

void describe_mapping(Fields& f, UrMapping& m, const CellInfo& cell) {
  int format = 1;
  f.field("takt_ur", format, WholeRange{1, 1}, "Version of this format.", kRequired);
  gateway::describe_robot(f, m.robot, cell, 6);
  std::vector<std::string> tools;
  for (const auto& gripper : cell.grippers)
    if (gripper.robot >= 0 && cell.robots[static_cast<std::size_t>(gripper.robot)].name == m.robot.robot)
      tools.push_back(gripper.name);
  f.field("tool", m.tool, NameOf{tools, "a gripper of the robot"},
          "Gripper whose TCP and contact forces the controller shows; without it the TCP is the flange.");
  f.field("robotiq", m.robotiq, NameOf{tools, "a gripper of the robot"},
          "Gripper that clients of Robotiq's URCap command; without it their port is closed.");
  gateway::describe_force_sensor(
      f, m.force_sensor, cell, m.robot.robot,
      "Sensor on the flange that the controller reads; without it forces are the contact "
      "forces of the tool.");
  f.pose("base_frame", m.base_frame, "The protocol's base frame in the robot's base.");
  f.section("listen", "Where the controller listens.", [&] {
    f.field("address", m.address, Text{},
            "IP address; each robot has its own, since drivers use fixed ports.");
    f.field("rtde", m.rtde_port, Port{}, "Port of RTDE.");
    f.field("primary", m.primary_port, Port{}, "Port of the primary interface.");
    f.field("secondary", m.secondary_port, Port{}, "Port of the secondary interface.");
    f.field("realtime", m.realtime_port, Port{}, "Port of the real-time interface.");
    f.field("dashboard", m.dashboard_port, Port{}, "Port of the dashboard server.");
    f.field("robotiq", m.robotiq_port, Port{}, "Port of Robotiq's URCap.");
  });
  f.section("controller", "What the controller says of itself.", [&] {
    f.field("model", m.model, Text{}, "Model, e.g. UR10e.");
    f.field("serial_number", m.serial_number, Text{},
            "Serial number; drivers expect that it begins with 20.");
    f.field("version", m.version, Text{}, "Software version, 5.x.y.");
    f.field("remote_control", m.remote_control, Flag{}, "Shown as remote control.");
    f.field("powered", m.powered, Flag{}, "The robot has power and released brakes at the start.");
  });
  const auto numbers = m.version_numbers();
  f.check(numbers[0] == 5, "controller", "version " + m.version, "5.x.y: PolyScope X has other interfaces");
  gateway::describe_time(f, m.time);
  gateway::describe_filter(f, m.filter_rad_per_s);
  f.field("contact_force_N", m.contact_force_N, positive("N"),
          "Force at the TCP that counts as tool contact.");
  gateway::describe_outputs(f, m.outputs, cell, is_ur_output, kOutputNames);
  gateway::describe_inputs(f, m.inputs, cell, is_ur_input, kInputNames);
  f.entries(
      "programs", m.programs, "Programs that the dashboard can load.", "A program by its file name.", 0,
      [] { return NamedProgram{}; }, [&](NamedProgram& program) { describe_program(f, program); });
  f.field("reports", m.reports, Text{},
          "Directory, from the working directory, of flight reports and support files that clients of the "
          "dashboard ask for; without it they are refused.");
  f.check(m.reports.empty() || std::filesystem::is_directory(m.reports), "reports", m.reports,
          "an existing directory");
  f.section("follow", "The role of takt-ur follow: takt's robot follows a controller.", [&] {
    f.field("frequency_Hz", m.follow.frequency_Hz, NumberRange{1.0, 500.0, false, "Hz"}, "Rate of its data.");
    f.field("positions", m.follow.uses_target, kPositions, "Which positions the robot follows.");
    gateway::describe_silence(f, m.follow.silence);
    gateway::describe_resynchronisation(f, m.follow.first_command);
  });
}

}  // namespace

std::string UrMapping::address_of(const std::string& host, int port) const {
  const std::array<int, 6> own{rtde_port,     primary_port,   secondary_port,
                               realtime_port, dashboard_port, robotiq.empty() ? port - 1 : robotiq_port};
  const bool local = host == "127.0.0.1" || host == "localhost";
  return local && std::find(own.begin(), own.end(), port) != own.end() ? address : host;
}

std::array<int, 3> UrMapping::version_numbers() const {
  std::array<int, 3> numbers{};
  const char* at = version.data();
  const char* end = at + version.size();
  for (int& number : numbers) {
    const auto [next, problem] = std::from_chars(at, end, number);
    if (problem != std::errc{}) return {};
    at = next < end ? next + 1 : next;
  }
  return numbers;
}

int UrMapping::robot_type() const {
  constexpr std::array<std::pair<std::string_view, int>, 9> kTypes{{{"UR5", 1},
                                                                    {"UR10", 2},
                                                                    {"UR3", 3},
                                                                    {"UR16", 4},
                                                                    {"UR18", 5},
                                                                    {"UR8", 6},
                                                                    {"UR20", 7},
                                                                    {"UR30", 8},
                                                                    {"UR15", 9}}};
  std::string_view family = model;
  if (!family.empty() && family.back() == 'e') family.remove_suffix(1);
  for (const auto& [name, type] : kTypes)
    if (name == family) return type;
  return 0;
}

bool is_ur_output(const std::string& name) {
  return is_numbered(name, "standard_digital_output_", 0, 7) ||
         is_numbered(name, "configurable_digital_output_", 0, 7) ||
         is_numbered(name, "tool_digital_output_", 0, 1) ||
         is_numbered(name, "standard_analog_output_", 0, 1) || is_register(name);
}

bool is_ur_input(const std::string& name) {
  return is_numbered(name, "standard_digital_input_", 0, 7) ||
         is_numbered(name, "configurable_digital_input_", 0, 7) ||
         is_numbered(name, "tool_digital_input_", 0, 1) || is_numbered(name, "standard_analog_input", 0, 1) ||
         is_numbered(name, "tool_analog_input", 0, 1) || is_register(name);
}

UrMapping read_ur_mapping(const std::filesystem::path& file, const CellInfo& cell) {
  UrMapping mapping;
  const YamlSource source{file, {}};
  Fields f(source, load_yaml(file));
  describe_mapping(f, mapping, cell);
  f.finish();
  return mapping;
}

UrMapping default_ur_mapping(const CellInfo& cell, const std::string& robot) {
  UrMapping mapping;
  std::string names;
  for (const auto& one : cell.robots) {
    names += (names.empty() ? "" : ", ") + one.name;
    if (!robot.empty() ? one.name == robot : mapping.robot.robot.empty()) mapping.robot.robot = one.name;
  }
  const int found = cell.find_robot(mapping.robot.robot);
  if (found < 0 || (robot.empty() && cell.robots.size() > 1))
    throw ScenarioError("--robot: found " + (robot.empty() ? "no name" : "'" + robot + "'") +
                        "; allowed: " + names);
  const auto& description = cell.robots[static_cast<std::size_t>(found)];
  if (description.joints.size() != 6)
    throw ScenarioError("--robot: found " + description.name + " with " +
                        std::to_string(description.joints.size()) +
                        " joints; allowed: a robot with 6 joints");
  for (std::size_t i = 0; i < 6; ++i) {
    mapping.robot.order.push_back(description.joints[i].name);
    mapping.robot.index.push_back(i);
  }
  mapping.robot.sign.assign(6, 1.0);
  mapping.robot.offset.assign(6, 0.0);
  for (const auto& gripper : cell.grippers)
    if (gripper.robot == found && mapping.tool.empty()) mapping.tool = mapping.robotiq = gripper.name;
  return mapping;
}

}  // namespace takt::ur
