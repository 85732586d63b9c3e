#include "client_lib/gateway/egm/messages.h"

#include <egm.pb.h>

#include <cmath>

#include "idl/common/text.h"

namespace takt::gateway::egm {
namespace {

/// Joints, external joints, forces, test signals.
constexpr int kMostNumbers = 64;
/// Beyond any position, speed and signal.
constexpr double kMostValue = 1e9;

double finite(double value) {
  return std::isfinite(value) ? value : 0.0;
}

template <class Field>
void fill(Field& field, const std::vector<double>& values) {
  for (const double value : values) field.Add(finite(value));
}

void fill(wire::Header& to, const Header& from) {
  to.set_seqno(from.seqno);
  if (from.tm_ms) to.set_tm(*from.tm_ms);
  to.set_mtype(static_cast<std::uint32_t>(from.type));
}

void fill(wire::Pose& to, const EgmPose& from) {
  to.mutable_pos()->set_x(finite(from.position_mm[0]));
  to.mutable_pos()->set_y(finite(from.position_mm[1]));
  to.mutable_pos()->set_z(finite(from.position_mm[2]));
  to.mutable_orient()->set_u0(finite(from.quaternion[0]));
  to.mutable_orient()->set_u1(finite(from.quaternion[1]));
  to.mutable_orient()->set_u2(finite(from.quaternion[2]));
  to.mutable_orient()->set_u3(finite(from.quaternion[3]));
  if (!from.euler_deg) return;
  to.mutable_euler()->set_x(finite((*from.euler_deg)[0]));
  to.mutable_euler()->set_y(finite((*from.euler_deg)[1]));
  to.mutable_euler()->set_z(finite((*from.euler_deg)[2]));
}

void fill(wire::Motion& to, const Motion& from) {
  if (!from.joints.empty()) fill(*to.mutable_joints()->mutable_value(), from.joints);
  if (from.pose) fill(*to.mutable_cartesian(), *from.pose);
  if (!from.external_joints.empty())
    fill(*to.mutable_external_joints()->mutable_value(), from.external_joints);
  if (!from.time_us) return;
  to.mutable_time()->set_sec(*from.time_us / 1000000U);
  to.mutable_time()->set_usec(*from.time_us % 1000000U);
}

void fill(wire::RapidData& to, const RapidData& from) {
  if (from.digital) to.set_digital(*from.digital);
  fill(*to.mutable_numbers(), from.numbers);
}

/// Reads with checks; the first fault stays.
class Checked {
 public:
  std::string fault;

  double number(double value, const char* field) {
    if (std::abs(value) <= kMostValue) return value;
    complain(std::string(field) + ": found " + number_text(value) + "; allowed: a number of at most " +
             number_text(kMostValue));
    return 0.0;
  }
  template <class Field>
  std::vector<double> numbers(const Field& values, const char* field, int most = kMostNumbers) {
    if (values.size() > most) {
      complain(std::string(field) + ": found " + std::to_string(values.size()) +
               " numbers; allowed: " + std::to_string(most));
      return {};
    }
    std::vector<double> read;
    for (const double value : values) read.push_back(number(value, field));
    return read;
  }
  Header header(bool there, const wire::Header& from) {
    if (!there || !from.has_mtype()) complain("the header with mtype is missing");
    Header read;
    read.has_seqno = from.has_seqno();
    read.seqno = from.seqno();
    if (from.has_tm()) read.tm_ms = from.tm();
    if (from.mtype() <= 4) read.type = static_cast<MessageType>(from.mtype());
    return read;
  }
  Motion motion(const wire::Motion& from, const char* field) {
    Motion read;
    read.joints = numbers(from.joints().value(), field);
    read.external_joints = numbers(from.external_joints().value(), field);
    if (from.has_cartesian()) read.pose = pose(from.cartesian(), field);
    if (from.has_time()) read.time_us = from.time().sec() * 1000000U + from.time().usec();
    return read;
  }
  EgmPose pose(const wire::Pose& from, const char* field) {
    EgmPose read;
    if (!from.has_pos() || (!from.has_orient() && !from.has_euler()))
      complain(std::string(field) + ": a pose needs pos, and orient or euler");
    read.position_mm = {number(from.pos().x(), field), number(from.pos().y(), field),
                        number(from.pos().z(), field)};
    if (from.has_orient()) {
      read.quaternion = {number(from.orient().u0(), field), number(from.orient().u1(), field),
                         number(from.orient().u2(), field), number(from.orient().u3(), field)};
      double square = 0.0;
      for (const double u : read.quaternion) square += u * u;
      if (!from.has_euler() && !(square > 1e-6 && square < 1e6))
        complain(std::string(field) + ": the quaternion has the length " + number_text(std::sqrt(square)) +
                 "; allowed: 1");
    }
    if (from.has_euler())
      read.euler_deg = {number(from.euler().x(), field), number(from.euler().y(), field),
                        number(from.euler().z(), field)};
    return read;
  }
  RapidData rapid(const wire::RapidData& from, const char* field) {
    RapidData read;
    if (from.has_digital()) read.digital = from.digital();
    read.numbers = numbers(from.numbers(), field, kMaxRapidNumbers);
    return read;
  }
  void complain(std::string sentence) {
    if (fault.empty()) fault = std::move(sentence);
  }
};

template <class Wire>
bool parse(Wire& wire, std::string_view bytes, std::string& fault) {
  if (bytes.empty())
    fault = "the message is empty";
  else if (bytes.size() > kMaxMessage)
    fault =
        "the message has " + std::to_string(bytes.size()) + " bytes; allowed: " + std::to_string(kMaxMessage);
  else if (!wire.ParsePartialFromArray(bytes.data(), static_cast<int>(bytes.size())))
    fault = "no valid protocol buffer (cut off, or another message)";
  return fault.empty();
}

template <class Enum>
Enum state_of(const wire::State& state, std::uint32_t most) {
  return state.state() <= most ? static_cast<Enum>(state.state()) : Enum::undefined;
}

}  // namespace

std::string encode(const Robot& robot) {
  wire::Robot wire;
  fill(*wire.mutable_header(), robot.header);
  fill(*wire.mutable_feed_back(), robot.feed_back);
  fill(*wire.mutable_planned(), robot.planned);
  wire.mutable_motor_state()->set_state(static_cast<std::uint32_t>(robot.motors));
  wire.mutable_mci_state()->set_state(static_cast<std::uint32_t>(robot.mci));
  wire.set_convergence_met(robot.converged);
  wire.mutable_rapid_state()->set_state(static_cast<std::uint32_t>(robot.rapid));
  if (!robot.force.empty() && robot.robotware == 7) {
    wire::MeasuredForce7 force;
    force.set_active(true);
    fill(*force.mutable_force(), robot.force);
    wire.set_measured_force(force.SerializeAsString());
  } else if (!robot.force.empty()) {
    wire::MeasuredForce6 force;
    fill(*force.mutable_force(), robot.force);
    wire.set_measured_force(force.SerializeAsString());
  }
  if (robot.utilization) wire.set_utilization_rate(finite(*robot.utilization));
  if (robot.rapid_data) fill(*wire.mutable_rapid_data(), *robot.rapid_data);
  return wire.SerializeAsString();
}

std::string encode(const Sensor& sensor) {
  if (sensor.path_correction_mm) {
    wire::SensorPathCorrection wire;
    fill(*wire.mutable_header(), sensor.header);
    wire::Cartesian& pos = *wire.mutable_path_correction()->mutable_pos();
    pos.set_x(finite((*sensor.path_correction_mm)[0]));
    pos.set_y(finite((*sensor.path_correction_mm)[1]));
    pos.set_z(finite((*sensor.path_correction_mm)[2]));
    return wire.SerializeAsString();
  }
  wire::Sensor wire;
  fill(*wire.mutable_header(), sensor.header);
  if (sensor.planned) fill(*wire.mutable_planned(), *sensor.planned);
  if (sensor.has_speeds) {
    wire::SpeedReference& speeds = *wire.mutable_speed_reference();
    if (!sensor.joint_speeds.empty()) fill(*speeds.mutable_joints()->mutable_value(), sensor.joint_speeds);
    if (!sensor.cartesian_speeds.empty())
      fill(*speeds.mutable_cartesians()->mutable_value(), sensor.cartesian_speeds);
    if (!sensor.external_speeds.empty())
      fill(*speeds.mutable_external_joints()->mutable_value(), sensor.external_speeds);
  }
  if (sensor.rapid_data) fill(*wire.mutable_rapid_data(), *sensor.rapid_data);
  return wire.SerializeAsString();
}

Parsed<Robot> decode_robot(std::string_view bytes) {
  Parsed<Robot> parsed;
  wire::Robot wire;
  if (!parse(wire, bytes, parsed.fault)) return parsed;
  Checked checked;
  Robot robot;
  robot.header = checked.header(wire.has_header(), wire.header());
  if (!robot.header.has_seqno) checked.complain("the header has no seqno");
  if (robot.header.type != MessageType::data)
    checked.complain("mtype: found " + std::to_string(wire.header().mtype()) + "; allowed: 2 (data)");
  robot.feed_back = checked.motion(wire.feed_back(), "feedBack");
  robot.planned = checked.motion(wire.planned(), "planned");
  robot.motors = state_of<MotorState>(wire.motor_state(), 2);
  robot.mci = state_of<MciState>(wire.mci_state(), 3);
  robot.converged = wire.convergence_met();
  robot.rapid = state_of<RapidState>(wire.rapid_state(), 2);
  if (wire.has_measured_force()) {
    // A field of the other layout has another wire type, and is skipped as unknown.
    wire::MeasuredForce6 six;
    wire::MeasuredForce7 seven;
    if (!six.ParsePartialFromString(wire.measured_force()) ||
        !seven.ParsePartialFromString(wire.measured_force()))
      checked.complain("measuredForce: no valid protocol buffer");
    robot.robotware = seven.force().empty() ? 6 : 7;
    robot.force = checked.numbers(seven.force().empty() ? six.force() : seven.force(), "measuredForce");
  }
  if (wire.has_utilization_rate())
    robot.utilization = checked.number(wire.utilization_rate(), "utilizationRate");
  if (wire.has_rapid_data()) robot.rapid_data = checked.rapid(wire.rapid_data(), "RAPIDfromRobot");
  parsed.fault = std::move(checked.fault);
  if (parsed.fault.empty()) parsed.message = std::move(robot);
  return parsed;
}

Parsed<Sensor> decode_sensor(std::string_view bytes) {
  Parsed<Sensor> parsed;
  wire::Sensor wire;
  if (!parse(wire, bytes, parsed.fault)) return parsed;
  Checked checked;
  Sensor sensor;
  sensor.header = checked.header(wire.has_header(), wire.header());
  if (sensor.header.type == MessageType::path_correction) {
    wire::SensorPathCorrection path;
    if (!parse(path, bytes, parsed.fault)) return parsed;
    const wire::Cartesian& pos = path.path_correction().pos();
    if (!pos.has_x() || !pos.has_y() || !pos.has_z())
      checked.complain("pathCorr.pos: found no whole vector; allowed: x, y, z");
    sensor.path_correction_mm = {checked.number(pos.x(), "pathCorr.pos"),
                                 checked.number(pos.y(), "pathCorr.pos"),
                                 checked.number(pos.z(), "pathCorr.pos")};
    parsed.fault = std::move(checked.fault);
    if (parsed.fault.empty()) parsed.message = std::move(sensor);
    return parsed;
  }
  if (sensor.header.type != MessageType::correction)
    checked.complain("mtype: found " + std::to_string(wire.header().mtype()) +
                     "; allowed: 3 (correction) or 4 (path correction)");
  if (wire.has_planned()) sensor.planned = checked.motion(wire.planned(), "planned");
  if (wire.has_speed_reference()) {
    sensor.has_speeds = true;
    sensor.joint_speeds = checked.numbers(wire.speed_reference().joints().value(), "speedRef");
    sensor.cartesian_speeds = checked.numbers(wire.speed_reference().cartesians().value(), "speedRef");
    sensor.external_speeds = checked.numbers(wire.speed_reference().external_joints().value(), "speedRef");
  }
  if (wire.has_rapid_data()) sensor.rapid_data = checked.rapid(wire.rapid_data(), "RAPIDtoRobot");
  parsed.fault = std::move(checked.fault);
  if (parsed.fault.empty()) parsed.message = std::move(sensor);
  return parsed;
}

}  // namespace takt::gateway::egm
