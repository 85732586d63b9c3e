#include "client_lib/controller/controller.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>

#include "client_lib/controller/program.h"
#include "client_lib/controller/robot_driver.h"
#include "idl/common/bounded_file.h"
#include "idl/common/named_lists.h"

namespace takt::controller {

using takt_msgs::msg::CellDescription;
using takt_msgs::msg::CellState;
using takt_msgs::msg::GripperDescription;

namespace {

constexpr std::size_t kLargestProgram_MB = 4;

std::string read_program(const std::string& file) {
  FileText read = read_bounded_file(file, kLargestProgram_MB);
  if (!read.problem.empty()) throw std::runtime_error(file + ": the program cannot be read: " + read.problem);
  return std::move(read.text);
}

/// The robot with the tool centre point of its first gripper; of the flange where it has none.
Arm arm_of(const CellDescription& cell, std::size_t robot) {
  const auto carried = std::ranges::find(cell.grippers, static_cast<int>(robot), &GripperDescription::robot);
  return {cell, cell.robots[robot].name, carried == cell.grippers.end() ? std::string() : carried->name};
}

}  // namespace

struct Controller::Impl {
  Impl(const std::string& program_file, const CellDescription& the_cell, const Parameters& given)
      : file(program_file),
        text(read_program(program_file)),
        cell(the_cell),
        names(named_lists(the_cell)),
        parameters(given) {
    restart();
    for (const int robot : driven_robots) output.joints.push_back({robot, {}, {}});
    for (const int gripper : driven_grippers) output.grippers.push_back({gripper, {}, 0.0, 0.0});
    for (const int device : driven_devices) output.devices.push_back({device, {}, {}});
  }

  void restart() {
    program.reset();
    if (steps) steps->clear();
    robots.clear();
    for (size_t i = 0; i < cell.robots.size(); ++i) robots.emplace_back(arm_of(cell, i));
    grippers.assign(cell.grippers.size(), {});
    devices.clear();
    for (size_t i = 0; i < cell.devices.size(); ++i) devices.push_back({static_cast<int>(i), {}, {}});
    program.emplace(
        text, file,
        ProgramContext{&cell, &names, &robots, &grippers, &devices, &parameters, steps ? &*steps : nullptr});
    for (RobotDriver& robot : robots) robot.set_period(program->period_s());
    driven_robots = program->driven_robots();
    driven_devices = program->driven_devices();
    driven_grippers.clear();
    for (size_t i = 0; i < cell.grippers.size(); ++i) {
      const int carrier = cell.grippers[i].robot;
      if (std::find(driven_robots.begin(), driven_robots.end(), carrier) == driven_robots.end()) continue;
      if (program->leaves_gripper(static_cast<int>(i))) continue;
      driven_grippers.push_back(static_cast<int>(i));
    }
    output.finished = false;
    started = false;
    fault.clear();
  }

  void check_fits(const CellState& state) const {
    if (!fits(state, names, names))
      throw std::runtime_error(
          "the state does not fit the description of the cell: other numbers of components, robots, joints, "
          "grippers, devices or signals, or an index beyond them");
  }

  void check_time(const CellState& state) const {
    if (!std::isfinite(state.time)) throw std::runtime_error("the time of the state is not finite");
    if (started && state.time < last_time_s) {
      throw std::runtime_error("time went back from " + std::to_string(last_time_s) + " s to " +
                               std::to_string(state.time) +
                               " s; after a reset the program has to be restarted");
    }
  }

  /// The program starts from where the cell is: robots stand, grippers keep their Part or their width.
  void start(const CellState& state) {
    for (size_t i = 0; i < robots.size(); ++i) robots[i].stand_at(state.robots[i].position);
    for (size_t i = 0; i < grippers.size(); ++i) {
      const bool holds = state.grippers[i].closed && state.grippers[i].part >= 0;
      const double width = std::clamp(state.grippers[i].width, 0.0, cell.grippers[i].max_width);
      grippers[i] = {static_cast<int>(i), holds ? GripperAction::close : GripperAction::width, width,
                     cell.grippers[i].max_force};
    }
    started = true;
  }

  void update(StateSource& source) {
    const CellState& state = source.read(StatePart::time, 0);
    check_time(state);
    if (!started) start(source.read(StatePart::machines, 0));
    last_time_s = state.time;
    for (RobotDriver& robot : robots)
      if (robot.mounted_on() >= 0)
        robot.set_base(source.read(StatePart::component, static_cast<std::size_t>(robot.mounted_on())));
    program->run(source);
    for (JointSetPoint& joints : output.joints) {
      try {
        const ArmSetPoint& set_point = robots[static_cast<size_t>(joints.robot)].advance(state.time);
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
  const CellDescription& cell;
  Named names;  ///< of what the cell has
  Parameters parameters;
  std::vector<RobotDriver> robots;
  std::vector<GripperSetPoint> grippers;  ///< standing commands of all grippers
  std::optional<Program> program;
  std::vector<DeviceSetPoint> devices;  ///< what has been set of all devices
  std::vector<int> driven_robots, driven_grippers, driven_devices;
  Output output;
  std::optional<StepLog> steps;
  bool started = false;
  double last_time_s = 0.0;
  std::string fault;  ///< of an earlier update; a program that failed does not go on
};

Controller::Controller(const std::string& program_file, const CellDescription& cell,
                       const Parameters& parameters)
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

const Output& Controller::update(const CellState& state) {
  struct Whole : StateSource {
    Whole(const Impl& checker, const CellState& message) : impl(checker), state(message) {}
    const CellState& read(StatePart part, std::size_t) override {
      if (part == StatePart::time && !std::exchange(checked, true)) impl.check_fits(state);
      return state;
    }
    const Impl& impl;
    const CellState& state;
    bool checked = false;
  } whole(*impl_, state);
  return update(whole);
}

const Output& Controller::update(StateSource& source) {
  if (!impl_->fault.empty()) throw std::runtime_error(impl_->fault);
  try {
    impl_->update(source);
  } catch (const std::exception& error) {
    impl_->fault = error.what();
    throw std::runtime_error(impl_->fault);
  }
  return impl_->output;
}

void Controller::restart() {
  impl_->restart();
}

void Controller::keep_steps(std::size_t newest) {
  impl_->steps.emplace(newest);
  impl_->program->keep_steps(&*impl_->steps);
}

const StepLog& Controller::steps() const {
  static const StepLog none;
  return impl_->steps ? *impl_->steps : none;
}

const std::string& Controller::text() const {
  return impl_->text;
}

}  // namespace takt::controller
