#include "client_lib/tools/takt_controller/program_reporter.h"

#include <algorithm>
#include <utility>

#include "idl/common/message.h"

namespace takt::tool {
namespace {

using takt_msgs::msg::Program;
using takt_msgs::msg::ProgramStep;
using takt_msgs::msg::ProgramSteps;

/// Texts of a program may have any length; those on the wire are bounded.
std::string cut(std::string text, std::size_t most) {
  if (text.size() > most) text.resize(most);
  return text;
}

}  // namespace

ProgramReporter::ProgramReporter(Client& cell, controller::Controller& controller, const CellInfo& info,
                                 const std::string& name)
    : cell_(cell),
      controller_(controller),
      name_(cut(name, field_info<ProgramSteps>("controller").string_bound)) {
  controller_.keep_steps(field_info<ProgramSteps>("steps").bound);
  for (const int robot : controller_.driven_robots())
    robots_.push_back({robot, info.robots.at(static_cast<std::size_t>(robot)).name, {}});
}

std::string ProgramReporter::begin(const std::string& file) {
  Program program;
  program.controller = name_;
  program.file = cut(file, field_info<Program>("file").string_bound);
  program.text = cut(controller_.text(), field_info<Program>("text").string_bound);
  try {
    for (const Robot& robot : robots_) cell_.publish(robot.name, program);
    send();
  } catch (const ClientError& error) {
    robots_.clear();
    return error.what();
  }
  return {};
}

void ProgramReporter::note(std::uint32_t epoch, double time_s, bool finished) {
  epoch_ = epoch;
  time_s_ = time_s;
  finished_ = finished;
  if (is_behind() && Clock::now() - sent_ >= kPeriod) send();
}

void ProgramReporter::send() {
  const controller::StepLog& log = controller_.steps();
  for (Robot& robot : robots_) {
    robot.steps.controller = name_;
    robot.steps.epoch = epoch_;
    robot.steps.time = time_s_;
    robot.steps.finished = finished_;
    robot.steps.steps.clear();
    for (const controller::ProgramStep& step : log.steps()) {
      if (step.robot != robot.index) continue;
      robot.steps.steps.push_back({.name = cut(step.name, field_info<ProgramStep>("name").string_bound),
                                   .named = step.named,
                                   .line = static_cast<std::uint32_t>(std::max(step.line, 0)),
                                   .begin = step.begin_s,
                                   .end = step.end_s});
    }
    cell_.publish(robot.name, robot.steps);
  }
  sent_changes_ = log.changes();
  sent_finished_ = finished_;
  sent_ = Clock::now();
}

}  // namespace takt::tool
