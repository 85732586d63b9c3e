#include "server/fmu_export/cell_variables.h"

#include <fstream>
#include <stdexcept>

namespace takt {
namespace {

using Kind = CellVariable::Kind;

std::string element(const std::string& name, std::size_t i) {
  return name + "[" + std::to_string(i + 1) + "]";
}

}  // namespace

std::vector<CellVariable> cell_variables(const CellDescription& cell) {
  std::vector<CellVariable> all;
  const auto add = [&](Kind kind, std::string name, const char* unit, std::string description,
                       std::size_t object, std::size_t place = 0,
                       SignalType type = SignalType::real) -> CellVariable& {
    all.push_back({kind, std::move(name), unit, std::move(description), type, false, static_cast<int>(object),
                   static_cast<int>(place), 0.0, 0.0});
    return all.back();
  };
  const auto input = [&](CellVariable& variable, double lower, double upper) {
    variable.is_input = true;
    variable.lower = lower, variable.upper = upper;
  };
  for (std::size_t r = 0; r < cell.robots.size(); ++r) {
    const RobotDescription& robot = cell.robots[r];
    for (std::size_t j = 0; j < robot.arm.joints.size(); ++j) {
      const JointModel& joint = robot.arm.joints[j];
      input(add(Kind::joint_target, element(robot.name + ".q_set", j),
                joint.type == JointType::prismatic ? "m" : "rad",
                "set-point of joint '" + joint.name + "', one communication step ahead", r, j),
            joint.lower, joint.upper);
    }
  }
  for (std::size_t g = 0; g < cell.grippers.size(); ++g)
    input(add(Kind::gripper_closed, cell.grippers[g].name + ".close", "", "closes the jaws, else opens them",
              g, 0, SignalType::boolean),
          0.0, 1.0);
  for (std::size_t d = 0; d < cell.devices.size(); ++d)
    for (std::size_t s = 0; s < cell.devices[d].signals.size(); ++s) {
      const SignalDescription& signal = cell.devices[d].signals[s];
      if (signal.commanded)
        input(add(Kind::signal_value, cell.devices[d].name + "." + signal.name, signal.unit.c_str(),
                  "commanded signal", d, s, signal.type),
              signal.lower, signal.upper);
    }
  for (std::size_t r = 0; r < cell.robots.size(); ++r) {
    const RobotDescription& robot = cell.robots[r];
    for (std::size_t j = 0; j < robot.arm.joints.size(); ++j) {
      const bool slides = robot.arm.joints[j].type == JointType::prismatic;
      add(Kind::joint_position, element(robot.name + ".q", j), slides ? "m" : "rad",
          "position of joint " + std::to_string(j + 1), r, j);
    }
    for (std::size_t j = 0; j < robot.arm.joints.size(); ++j) {
      const bool slides = robot.arm.joints[j].type == JointType::prismatic;
      add(Kind::joint_velocity, element(robot.name + ".qd", j), slides ? "m/s" : "rad/s", "its speed", r, j);
    }
    for (std::size_t j = 0; j < robot.arm.joints.size(); ++j) {
      const bool slides = robot.arm.joints[j].type == JointType::prismatic;
      add(Kind::joint_torque, element(robot.name + ".torque", j), slides ? "N" : "N.m",
          "of the drive on the joint; 0 at level of detail 1", r, j);
    }
  }
  for (std::size_t g = 0; g < cell.grippers.size(); ++g) {
    add(Kind::gripper_width, cell.grippers[g].name + ".width", "m", "between the grip faces", g);
    add(Kind::gripper_force, cell.grippers[g].name + ".force", "N", "of the jaws", g);
  }
  for (std::size_t c = 0; c < cell.components.size(); ++c) {
    if (cell.components[c].type != ComponentType::part) continue;
    const std::string& name = cell.components[c].name;
    for (std::size_t i = 0; i < 3; ++i)
      add(Kind::part_position, element(name + ".position", i), "m", "in the world: x, y, z", c, i);
    for (std::size_t i = 0; i < 4; ++i)
      add(Kind::part_rotation, element(name + ".quaternion", i), "", "in the world: x, y, z, w", c, i);
    add(Kind::part_holder, name + ".holder", "", "number of the component that holds it, or -1", c, 0,
        SignalType::integer);
  }
  for (std::size_t d = 0; d < cell.devices.size(); ++d)
    for (std::size_t s = 0; s < cell.devices[d].signals.size(); ++s) {
      const SignalDescription& signal = cell.devices[d].signals[s];
      if (!signal.commanded)
        add(Kind::signal, cell.devices[d].name + "." + signal.name, signal.unit.c_str(), "reported signal", d,
            s, signal.type);
    }
  for (std::size_t i = 0; i < 2; ++i)
    add(Kind::state_hash, element("state_hash", i), "", i == 0 ? "lower 32 bits" : "upper 32 bits", 0, i);
  return all;
}

double value_of(const CellVariable& v, const Snapshot& s) {
  const auto object = static_cast<std::size_t>(v.object), place = static_cast<std::size_t>(v.element);
  switch (v.kind) {
    case Kind::joint_target:
    case Kind::joint_position:
      return s.robots[object].position[place];
    case Kind::joint_velocity:
      return s.robots[object].velocity[place];
    case Kind::joint_torque:
      return s.robots[object].effort[place];
    case Kind::gripper_closed:
      return s.grippers[object].closed ? 1.0 : 0.0;
    case Kind::gripper_width:
      return s.grippers[object].width_m;
    case Kind::gripper_force:
      return s.grippers[object].force_N;
    case Kind::part_position:
      return s.components[object].p_WB[v.element];
    case Kind::part_rotation:
      return s.components[object].q_WB.coeffs()[v.element];
    case Kind::part_holder:
      return s.components[object].partner;
    case Kind::signal_value:
    case Kind::signal:
      return s.devices[object].signals[place];
    case Kind::state_hash:
      return static_cast<double>(place == 0 ? s.state_hash & 0xffffffffU : s.state_hash >> 32U);
  }
  return 0.0;
}

void write_interface(const CellInterface& interface, const std::filesystem::path& file) {
  std::ofstream out(file);
  out << interface.token << '\n';
  for (const std::string& name : interface.inputs) out << "in " << name << '\n';
  for (const std::string& name : interface.outputs) out << "out " << name << '\n';
  if (!out.flush()) throw std::runtime_error(file.string() + " cannot be written");
}

CellInterface read_interface(const std::filesystem::path& file) {
  std::ifstream in(file);
  CellInterface result;
  if (!std::getline(in, result.token)) throw std::runtime_error(file.string() + " cannot be read");
  for (std::string kind, name; in >> kind >> name;)
    (kind == "in" ? result.inputs : result.outputs).push_back(name);
  return result;
}

}  // namespace takt
