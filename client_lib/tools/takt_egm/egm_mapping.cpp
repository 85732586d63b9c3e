#include "client_lib/tools/takt_egm/egm_mapping.h"

#include "client_lib/gateway/force_sensor.h"
#include "idl/common/parse.h"

namespace takt {

void describe(Fields& f, gateway::egm::PathPoint& s) {
  f.pose("pose", s.X_RT, "Pose of the tool in the base frame of the robot.");
}

}  // namespace takt

namespace takt::tool {
namespace {

using namespace gateway;

const Choice<EgmRole> kRoles{{{"controller", EgmRole::controller}, {"sensor", EgmRole::sensor}}};
const Choice<egm::Guidance> kGuidances{
    {{"joint", egm::Guidance::joint}, {"pose", egm::Guidance::pose}, {"path", egm::Guidance::path}}};
const Choice<bool> kFollowed{{{"feedback", false}, {"planned", true}}};
const Choice<int> kRobotWares{{{"6", 6}, {"7", 7}}};
constexpr const char* kRapidNames = "digital, number1 to number40";

/// 0: the digital signal; 1 to 40: a number; -1: none of them.
int rapid_place(const std::string& name) {
  if (name == "digital") return 0;
  if (!name.starts_with("number")) return -1;
  const auto number = finite_number(name.substr(6));
  for (int i = 1; i <= static_cast<int>(egm::kMaxRapidNumbers); ++i)
    if (number && *number == i && name == "number" + std::to_string(i)) return i;
  return -1;
}

void describe_control(Fields& f, egm::ControllerOptions& c) {
  f.field("guidance", c.guidance, kGuidances,
          "joint (EGMActJoint, EGMRunJoint), pose (EGMActPose, EGMRunPose) or path (EGMActMove, EGMMoveL).");
  f.when("guidance", kGuidances, c.guidance, {egm::Guidance::path}, [&] {
    f.section("path", "The programmed path, which the sensor corrects.", [&] {
      f.field("speed_mm_per_s", c.path_speed_mm_per_s, positive("mm/s"), "Speed along the path.");
      f.list("points", c.path, "Straight lines lead to them, from the pose at the start on.",
             "a list of {pose: {position_m: [x, y, z], ...}}");
      f.check(!c.path.empty(), "points", "nothing", "a list of one pose or more");
    });
  });
  f.section("control", "The control law of position guidance.", [&] {
    f.field("position_gain_per_s", c.position_gain_per_s, not_negative("1/s"),
            "Speed per difference of position; PosCorrGain is a factor of it. 0: speed references alone. The "
            "gain of a real "
            "controller is not published: 20 is assumed.");
    f.field(
        "max_speed_deviation_deg_per_s", c.max_speed_deviation_deg_per_s, positive("degrees/s"),
        "MaxSpeedDeviation: above it all axes are slowed by one factor. A real controller has 1 by default.");
    f.field("max_position_deviation_deg", c.max_position_deviation_deg, positive("degrees"),
            "MaxPosDeviation: farthest from the positions at the start.");
    f.field("low_pass_Hz", c.low_pass_Hz, not_negative("Hz"), "LpFilter, of the speed; 0: none.");
    f.field("ramp_in_s", c.ramp_in_s, not_negative("s"), "RampInTime.");
    f.field("comm_timeout_s", c.comm_timeout_s, positive("s"), "CommTimeout: silence until RAPID stops.");
    f.field("convergence_deg", c.convergence_deg, positive("degrees"),
            "Tolerance of each joint, or of the rotation.");
    f.field("convergence_mm", c.convergence_mm, positive("mm"), "Tolerance of the position (pose guidance).");
    f.field("condition_time_s", c.condition_time_s, not_negative("s"),
            "CondTime: so long within the tolerance.");
  });
}

}  // namespace

EgmMapping read_egm_mapping(const std::filesystem::path& file, const CellInfo& cell) {
  EgmMapping m;
  const YamlSource source{file, {}};
  Fields f(source, load_yaml(file));
  int version = 1;
  f.field("takt_egm", version, WholeRange{1, 1}, "Version of the format.", kRequired);
  f.field("role", m.role, kRoles,
          "What takt is: controller (for an EGM program of your own) or sensor (follows a controller or "
          "RobotStudio).");
  describe_robot(f, m.robot, cell, 0);
  std::vector<std::string> grippers;
  for (const auto& gripper : cell.grippers) grippers.push_back(gripper.name);
  f.field("tool", m.tool, NameOf{grippers, "a gripper of the cell"},
          "The gripper whose tool centre point is the tool of poses; without it the flange.");
  f.field("address", m.address, Text{},
          "IP address of the sensor: where takt sends to, or where it listens.");
  f.field("port", m.port, WholeRange{0, 65535}, "UDP port of the sensor.");
  f.field("cycle_ms", m.cycle_ms, WholeRange{4, 1000}, "SampleRate: 4 or a multiple of it.");
  f.check(m.cycle_ms % 4 == 0, "cycle_ms", std::to_string(m.cycle_ms), "a multiple of 4");
  f.when("role", kRoles, m.role, {EgmRole::controller}, [&] {
    describe_control(f, m.control);
    describe_force_sensor(f, m.force_sensor, cell, m.robot.robot,
                          "Sensor whose forces and torques are sent as measuredForce, in its own axes.");
    f.field("robotware", m.robotware, kRobotWares,
            "Layout of measuredForce: of RobotWare 6 (abb_libegm reads it) or 7.");
  });
  f.check(
      m.role == EgmRole::sensor || m.control.guidance == egm::Guidance::joint || m.robot.index.size() >= 6,
      "guidance", "pose or path, of a robot with " + std::to_string(m.robot.index.size()) + " joints",
      "joint; pose and path need six joints or more");
  describe_filter(f, m.filter_rad_per_s);
  f.when("role", kRoles, m.role, {EgmRole::sensor}, [&] {
    f.field("follow", m.planned, kFollowed, "The joints to follow: feedback (measured) or planned.");
    f.field("answers", m.answers, Flag{}, "Signals are sent to RAPID (RobotWare 7), if there are inputs.");
    f.field("delay_s", m.delay_s, NumberRange{.lower = 0.0, .upper = 1.0, .unit = "s"},
            "Positions take effect so long after the instant of their time stamp: jitter below it does not "
            "reach the robot.");
    describe_silence(f, m.silence);
    describe_resynchronisation(f, m.first_command);
  });
  const auto is_rapid = [](const std::string& name) { return rapid_place(name) >= 0; };
  describe_outputs(f, m.outputs, cell, is_rapid, kRapidNames);
  describe_inputs(f, m.inputs, cell, is_rapid, kRapidNames);
  f.finish();
  return m;
}

std::optional<double> rapid_value(const egm::RapidData& data, const std::string& name) {
  const int place = rapid_place(name);
  if (place == 0) return data.digital ? std::optional<double>(*data.digital ? 1.0 : 0.0) : std::nullopt;
  const auto number = static_cast<std::size_t>(place) - 1;
  return number < data.numbers.size() ? std::optional<double>(data.numbers[number]) : std::nullopt;
}

std::optional<egm::RapidData> rapid_data_of(const std::vector<InputMapping>& inputs, const State& state) {
  if (inputs.empty()) return std::nullopt;
  egm::RapidData data;
  for (const InputMapping& input : inputs) {
    const int place = rapid_place(input.name);
    if (place == 0) {
      data.digital = digital(input, state);
      continue;
    }
    data.numbers.resize(std::max(data.numbers.size(), static_cast<std::size_t>(place)), 0.0);
    data.numbers[static_cast<std::size_t>(place) - 1] = number_of(input, state);
  }
  return data;
}

}  // namespace takt::tool
