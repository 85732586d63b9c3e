#include "client_lib/controller/controller.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <optional>
#include <stdexcept>

#include "client_lib/controller/program.h"
#include "client_lib/controller/robot_driver.h"

namespace takt::controller {

namespace {

std::string read_program(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (!in.is_open() || in.bad()) throw std::runtime_error(file + ": the program cannot be read");
  return text;
}

/// The tool centre point of a robot's (first) gripper; the flange where it has none.
Pose tcp_of(const CellInfo& cell, int robot) {
  for (const GripperInfo& gripper : cell.grippers) {
    if (gripper.robot == robot) return gripper.X_FT;
  }
  return {};
}

}  // namespace

struct Controller::Impl {
  Impl(const std::string& program_file, const CellInfo& the_cell, const Parameters& given)
      : file(program_file), text(read_program(program_file)), cell(the_cell), parameters(given) {
    restart();
    for (const int robot : driven_robots) output.joints.push_back({robot, {}, {}});
    for (const int gripper : driven_grippers) output.grippers.push_back({gripper, {}, 0.0, 0.0});
    for (const int device : driven_devices) output.devices.push_back({device, {}, {}});
  }

  void restart() {
    program.reset();
    steps.clear();
    robots.clear();
    for (size_t i = 0; i < cell.robots.size(); ++i) {
      robots.emplace_back(cell.robots[i], tcp_of(cell, static_cast<int>(i)));
    }
    grippers.assign(cell.grippers.size(), {});
    devices.clear();
    for (size_t i = 0; i < cell.devices.size(); ++i) devices.push_back({static_cast<int>(i), {}, {}});
    program.emplace(
        text, file,
        ProgramContext{&cell, &robots, &grippers, &devices, &parameters, keeps_steps ? &steps : nullptr});
    for (RobotDriver& robot : robots) robot.set_period(program->period_s());
    driven_robots = program->driven_robots();
    driven_devices = program->driven_devices();
    driven_grippers.clear();
    for (size_t i = 0; i < cell.grippers.size(); ++i) {
      const int carrier = cell.grippers[i].robot;
      if (std::find(driven_robots.begin(), driven_robots.end(), carrier) == driven_robots.end()) continue;
      driven_grippers.push_back(static_cast<int>(i));
    }
    output.finished = false;
    started = false;
    fault.clear();
  }

  void check(const Input& input) const {
    if (input.robots.size() != cell.robots.size() || input.grippers.size() != cell.grippers.size() ||
        input.components.size() != cell.components.size() || input.devices.size() != cell.devices.size()) {
      throw std::runtime_error(
          "the input does not fit the cell: it has " + std::to_string(input.robots.size()) + " robots, " +
          std::to_string(input.grippers.size()) + " grippers, " + std::to_string(input.components.size()) +
          " components, " + std::to_string(input.devices.size()) + " devices; the cell has " +
          std::to_string(cell.robots.size()) + ", " + std::to_string(cell.grippers.size()) + ", " +
          std::to_string(cell.components.size()) + ", " + std::to_string(cell.devices.size()));
    }
    if (!std::isfinite(input.time_s)) throw std::runtime_error("the input's time is not finite");
    if (started && input.time_s < last_time_s) {
      throw std::runtime_error("time went back from " + std::to_string(last_time_s) + " s to " +
                               std::to_string(input.time_s) +
                               " s; after a reset the program has to be restarted");
    }
  }

  /// The program starts from where the cell is: robots stand, grippers keep their width.
  void start(const Input& input) {
    for (size_t i = 0; i < robots.size(); ++i) robots[i].stand_at(input.robots[i].position);
    for (size_t i = 0; i < grippers.size(); ++i) {
      const double width = std::clamp(input.grippers[i].width_m, 0.0, cell.grippers[i].max_width_m);
      grippers[i] = {static_cast<int>(i), GripperAction::width, width, cell.grippers[i].max_force_N};
    }
    started = true;
  }

  void update(const Input& input) {
    check(input);
    if (!started) start(input);
    last_time_s = input.time_s;
    program->run(input);
    for (JointSetPoint& joints : output.joints) {
      try {
        const ArmSetPoint& set_point = robots[static_cast<size_t>(joints.robot)].advance(input.time_s);
        joints.position = set_point.position;
        joints.velocity = set_point.velocity;
      } catch (const std::runtime_error& error) {
        throw std::runtime_error(program->located(joints.robot, error.what()));
      }
    }
    for (GripperSetPoint& gripper : output.grippers) gripper = grippers[static_cast<size_t>(gripper.gripper)];
    for (DeviceSetPoint& device : output.devices) device = devices[static_cast<size_t>(device.device)];
    output.finished = program->finished();
  }

  std::string file, text;
  CellInfo cell;
  Parameters parameters;
  std::vector<RobotDriver> robots;
  std::vector<GripperSetPoint> grippers;  ///< standing commands of all grippers
  std::optional<Program> program;
  std::vector<DeviceSetPoint> devices;  ///< what has been set of all devices
  std::vector<int> driven_robots, driven_grippers, driven_devices;
  Output output;
  std::vector<ProgramStep> steps;
  bool keeps_steps = false;
  bool started = false;
  double last_time_s = 0.0;
  std::string fault;  ///< of an earlier update; a program that failed does not go on
};

Controller::Controller(const std::string& program_file, const CellInfo& cell, const Parameters& parameters)
    : impl_(std::make_unique<Impl>(program_file, cell, parameters)) {}
Controller::~Controller() = default;

double Controller::period_s() const {
  return impl_->program->period_s();
}
const std::vector<int>& Controller::driven_robots() const {
  return impl_->driven_robots;
}
const std::vector<int>& Controller::driven_grippers() const {
  return impl_->driven_grippers;
}

const std::vector<int>& Controller::driven_devices() const {
  return impl_->driven_devices;
}

const Output& Controller::update(const Input& input) {
  if (!impl_->fault.empty()) throw std::runtime_error(impl_->fault);
  try {
    impl_->update(input);
  } catch (const std::exception& error) {
    impl_->fault = error.what();
    throw std::runtime_error(impl_->fault);
  }
  return impl_->output;
}

void Controller::restart() {
  impl_->restart();
}

void Controller::keep_steps() {
  impl_->keeps_steps = true;
  impl_->program->keep_steps(&impl_->steps);
}

const std::vector<ProgramStep>& Controller::steps() const {
  return impl_->steps;
}

}  // namespace takt::controller
