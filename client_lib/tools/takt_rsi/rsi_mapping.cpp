#include "client_lib/tools/takt_rsi/rsi_mapping.h"

#include "idl/common/bounded_file.h"

namespace takt::tool {
namespace {

using namespace gateway;

constexpr std::size_t kMostConfiguration_MB = 1;

const Choice<RsiRole> kRoles{{{"controller", RsiRole::controller}, {"sensor_pc", RsiRole::sensor_pc}}};
const Choice<bool> kCorrections{{{"absolute", false}, {"relative", true}}};
const Choice<int> kCycles{{{"4", 4}, {"12", 12}}};

void describe_limits(Fields& f, rsi::KrcOptions& krc) {
  const auto six = [&](const char* key, Six& member, const char* doc) {
    std::vector<double> values;
    f.field(key, values, Numbers{6, positive("degrees")}, doc);
    if (f.reading() && values.size() == 6) std::copy(values.begin(), values.end(), member.begin());
  };
  f.section("limits", "Limits of corrections, as in the RSI context; without a key there is no limit.", [&] {
    six("axis_deg", krc.axis_limit, "AXISCORR: the corrections of A1 to A6 are cut to this.");
    six("axis_monitor_deg", krc.axis_monitor, "AXISCORRMON: a larger correction stops RSI.");
    const auto one = [&](const char* key, double& member, const char* unit, const char* doc) {
      std::optional<double> value;
      f.field(key, value, positive(unit), doc);
      if (value) member = *value;
    };
    one("translation_mm", krc.translation_limit_mm, "mm", "POSCORR: X, Y, Z are cut to this.");
    one("rotation_deg", krc.rotation_limit_deg, "degrees", "POSCORR: the angle is cut to this.");
    one("translation_monitor_mm", krc.translation_monitor_mm, "mm", "POSCORRMON: a larger way stops RSI.");
    one("rotation_monitor_deg", krc.rotation_monitor_deg, "degrees", "POSCORRMON: a larger angle stops RSI.");
  });
}

IsElement elements_of(const std::vector<rsi::Channel>& channels) {
  return [&channels](const std::string& tag) {
    const int place = rsi::Configuration::find(channels, tag);
    return place >= 0 && channels[static_cast<std::size_t>(place)].internal == rsi::Internal::none;
  };
}

}  // namespace

RsiMapping read_rsi_mapping(const std::filesystem::path& file, const CellInfo& cell) {
  RsiMapping m;
  const YamlSource source{file, {}};
  Fields f(source, load_yaml(file));
  int version = 1;
  f.field("takt_rsi", version, WholeRange{1, 1}, "Version of the format.", kRequired);
  f.field("role", m.role, kRoles,
          "What takt is: controller (the KRC, for an RSI program of your own) or sensor_pc (follows a KRC or "
          "VRC).");
  describe_robot(f, m.robot, cell, 0);
  f.check(m.robot.index.size() <= 12, "robot", std::to_string(m.robot.index.size()) + " joints",
          "at most 12: A1 to A6 and E1 to E6");
  std::vector<std::string> grippers;
  for (const auto& gripper : cell.grippers) grippers.push_back(gripper.name);
  f.field("tool", m.tool, NameOf{grippers, "a gripper of the cell"},
          "The gripper whose tool centre point is the tool of RIst and RKorr; without it the flange.");
  f.field("configuration", m.configuration_file, ExistingFile{},
          "The Ethernet configuration (XML) of the KRC.", kRequired);
  const FileText text = read_bounded_file(m.configuration_file, kMostConfiguration_MB);
  f.check(text.problem.empty(), "configuration", m.configuration_file.string() + ": " + text.problem,
          "a readable file");
  m.configuration = rsi::parse_configuration(text.text, m.configuration_file.string());
  m.address = m.configuration.address;
  m.port = m.configuration.port;
  f.field("address", m.address, Text{}, "IP address of the sensor PC; without it that of the configuration.");
  f.field("port", m.port, WholeRange{0, 65535},
          "UDP port of the sensor PC; without it that of the configuration.");
  f.field("cycle_ms", m.krc.cycle_ms, kCycles, "4 (#IPO_FAST) or 12 (#IPO).");
  f.when("role", kRoles, m.role, {RsiRole::controller}, [&] {
    f.field("corrections", m.krc.relative, kCorrections, "RSI_ON(#ABSOLUTE) or RSI_ON(#RELATIVE).");
    f.section("elements", "Elements of the configuration that the RSI context wires to corrections.", [&] {
      f.field("axes", m.krc.axes_element, Text{}, "AXISCORR: the element with A1 to A6.");
      f.field("external_axes", m.krc.external_axes_element, Text{},
              "AXISCORREXT: the element with E1 to E6.");
      f.field("pose", m.krc.pose_element, Text{}, "POSCORR: the element with X, Y, Z, A, B, C.");
    });
    f.field("timeout_packets", m.krc.timeout, WholeRange{1, 100000},
            "Late packets until RSI stops with KSS29002.");
    m.krc.waits_for_sensor = true;
    f.field("waits_for_sensor", m.krc.waits_for_sensor, Flag{},
            "Late packets count from the first answer on; false: as in a real controller, from RSI_ON on.");
    f.field("repeat", m.repeat, Flag{}, "RSI is switched on again after each end; false: the program ends.");
    describe_time(f, m.time);
    describe_limits(f, m.krc);
  });
  describe_filter(f, m.filter_rad_per_s);
  f.when("role", kRoles, m.role, {RsiRole::sensor_pc}, [&] {
    f.field("delay_s", m.delay_s, NumberRange{.lower = 0.0, .upper = 1.0, .unit = "s"},
            "Positions take effect so long after the instant that IPOC means: jitter below it does not reach "
            "the robot.");
    describe_silence(f, m.silence);
    describe_resynchronisation(f, m.first_command);
  });
  const bool controller = m.role == RsiRole::controller;
  const auto& written = controller ? m.configuration.receive : m.configuration.send;
  const auto& read = controller ? m.configuration.send : m.configuration.receive;
  describe_outputs(f, m.outputs, cell, elements_of(written),
                   controller ? "a tag of the list RECEIVE" : "a tag of the list SEND with an index");
  describe_inputs(f, m.inputs, cell, elements_of(read),
                  controller ? "a tag of the list SEND with an index" : "a tag of the list RECEIVE");
  f.finish();
  return m;
}

}  // namespace takt::tool
