#include "server/fmu_export/cell_instance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "idl/common/text.h"
#include "plant_models/state_bytes.h"
#include "server/scenario/scenario_builder.h"
#include "server/scenario/scenario_reader.h"

namespace takt {

CellInstance::CellInstance(const std::filesystem::path& resources, const std::string& token) {
  const CellInterface interface = read_interface(resources / kInterfaceFile);
  if (interface.token != token)
    throw std::runtime_error("the description of this FMU is of another one: the tokens differ");
  scenario_ = read_scenario(resources / kExportedScenario);
  model_ = build_cell(scenario_, {resources / kExportedCache});
  const std::vector<CellVariable> all = cell_variables(model_->description);
  for (const auto* names : {&interface.inputs, &interface.outputs})
    for (const std::string& name : *names) {
      const auto found =
          std::find_if(all.begin(), all.end(), [&](const CellVariable& v) { return v.name == name; });
      if (found == all.end()) throw std::runtime_error("the cell has no variable '" + name + "'");
      variables_.push_back(*found);
    }
  simulation_ = std::make_unique<Simulation>(model_);
  snapshot_ = simulation_->make_snapshot();
  for (std::size_t i = 0; i < interface.inputs.size(); ++i)
    start_.push_back(value_of(variables_[i], snapshot_));
  driven_.assign(model_->robots.size(), 0);
  reset();
}

std::string CellInstance::only_in(Phase allowed, const char* call) const {
  constexpr std::array<const char*, 5> kPhases{"instantiated", "in initialisation mode", "initialised",
                                               "terminated", "stopped by an error"};
  if (phase_ == allowed) return {};
  return std::string(call) + " was called while the FMU is " + kPhases[static_cast<std::size_t>(phase_)] +
         "; allowed: while it is " + kPhases[static_cast<std::size_t>(allowed)];
}

std::string CellInstance::set_experiment(double start_s, double stop_s) {
  if (std::string why = only_in(Phase::instantiated, "the setup of the experiment"); !why.empty()) return why;
  if (!std::isfinite(start_s) || std::isnan(stop_s) || stop_s < start_s)
    return "the experiment is from " + number_text(start_s, 12) + " s to " + number_text(stop_s, 12) +
           " s; allowed: a finite start, and an end after it";
  start_s_ = start_s, stop_s_ = stop_s;
  return {};
}

std::string CellInstance::enter_initialisation() {
  std::string why = only_in(Phase::instantiated, "the entry into initialisation mode");
  if (why.empty()) phase_ = Phase::initialising;
  return why;
}

std::string CellInstance::exit_initialisation() {
  std::string why = only_in(Phase::initialising, "the exit from initialisation mode");
  if (why.empty()) phase_ = Phase::stepping;
  return why;
}

std::string CellInstance::terminate() {
  if (phase_ == Phase::failed) return {};
  std::string why = only_in(Phase::stepping, "the end of the simulation");
  if (why.empty()) phase_ = Phase::terminated;
  return why;
}

std::string CellInstance::check_type(std::size_t variable, SignalType type) const {
  if (variable > variables_.size()) return "there is no variable " + std::to_string(variable);
  const bool is_time = variable == variables_.size();
  const SignalType own = is_time ? SignalType::real : variables_[variable].type;
  if (own == type) return {};
  const auto word = [](SignalType of) {
    return of == SignalType::real ? "real" : of == SignalType::boolean ? "boolean" : "an integer";
  };
  return "the variable '" + (is_time ? "time" : variables_[variable].name) + "' is " + word(own) +
         "; found a function for what is " + word(type);
}

std::string CellInstance::get(std::size_t variable, SignalType type, double& value) const {
  std::string why = check_type(variable, type);
  if (why.empty()) value = this->value(variable);
  return why;
}

std::string CellInstance::set(std::size_t variable, SignalType type, double value) {
  if (std::string why = check_type(variable, type); !why.empty()) return why;
  if (!is_input(variable)) return "variable " + std::to_string(variable) + " is no input";
  if (phase_ == Phase::terminated || phase_ == Phase::failed)
    return only_in(Phase::stepping, "a function that sets inputs");
  const CellVariable& v = variables_[variable];
  if (!(value >= v.lower && value <= v.upper))
    return "the input '" + v.name + "': found " + number_text(value, 12) + "; allowed: from " +
           number_text(v.lower, 12) + " to " + number_text(v.upper, 12);
  inputs_[variable] = value;
  return {};
}

void CellInstance::reset() {
  if (simulation_->step_index() > 0 || !simulation_->fault().empty()) simulation_->reset();
  program_.reset();
  if (!scenario_.controller_program.empty())
    program_.emplace(scenario_.controller_program.string(), *simulation_, scenario_.program_parameters);
  inputs_ = applied_ = start_;
  phase_ = Phase::instantiated;
  start_s_ = 0.0, stop_s_ = std::numeric_limits<double>::infinity();
  std::fill(driven_.begin(), driven_.end(), 0);
  simulation_->read_snapshot(snapshot_);
}

double CellInstance::value(std::size_t variable) const {
  if (variable == variables_.size()) return start_s_ + snapshot_.time_s;
  return is_input(variable) ? inputs_[variable] : value_of(variables_[variable], snapshot_);
}

void CellInstance::add_commands(double h) {
  const CellDescription& cell = model_->description;
  const auto take = [&](auto result) {
    if (auto* rejection = std::get_if<Rejection>(&result)) throw std::runtime_error(rejection->message);
    commands_.emplace_back(std::move(std::get<0>(result)));
  };
  for (std::size_t i = 0; i < inputs_.size(); ++i)
    if (variables_[i].kind == CellVariable::Kind::joint_target && inputs_[i] != applied_[i])
      driven_[static_cast<std::size_t>(variables_[i].object)] = 1;
  for (std::size_t r = 0; r < cell.robots.size(); ++r) {
    if (driven_[r] == 0) continue;
    RawJointCommand raw;
    for (std::size_t j = 0; j < cell.robots[r].arm.joints.size(); ++j) {
      raw.names.push_back(cell.robots[r].arm.joints[j].name);
      raw.position.push_back(snapshot_.robots[r].position[j]);
    }
    for (std::size_t i = 0; i < inputs_.size(); ++i)
      if (variables_[i].kind == CellVariable::Kind::joint_target &&
          variables_[i].object == static_cast<int>(r))
        raw.position[static_cast<std::size_t>(variables_[i].element)] = inputs_[i];
    take(validate(cell, find_target(cell, cell.robots[r].name), raw));
    std::get<JointCommand>(commands_.back()).period_s = h;
  }
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    const CellVariable& v = variables_[i];
    if (inputs_[i] == applied_[i]) continue;
    const auto object = static_cast<std::size_t>(v.object);
    if (v.kind == CellVariable::Kind::gripper_closed)
      take(validate(
          cell, find_target(cell, cell.grippers[object].name),
          RawGripperCommand{{}, inputs_[i] >= 0.5 ? GripperAction::close : GripperAction::open, 0.0, 0.0}));
    if (v.kind == CellVariable::Kind::signal_value)
      take(validate(
          cell, find_target(cell, cell.devices[object].name),
          RawDeviceCommand{
              {}, {cell.devices[object].signals[static_cast<std::size_t>(v.element)].name}, {inputs_[i]}}));
  }
  applied_ = inputs_;
}

CellInstance::Outcome CellInstance::step(double t, double h, std::string& why) {
  if (why = only_in(Phase::stepping, "a step"); !why.empty()) return Outcome::refused;
  const double step_s = model_->step_s, now = start_s_ + simulation_->time_s();
  if (!(std::abs(t - now) <= 0.25 * step_s)) {
    why = "the step begins at " + number_text(t, 12) + " s; the cell is at " + number_text(now, 12) + " s";
    return Outcome::refused;
  }
  const double count = h / step_s;
  if (!(count > 0.5 && count < 1e9) || std::abs(count - std::round(count)) > 1e-6 * count) {
    why = "the communication step is " + number_text(h, 12) +
          " s; allowed is a whole multiple of the cell's step, " + number_text(step_s, 12) + " s";
    return Outcome::discarded;
  }
  if (t + h > stop_s_ + 0.25 * step_s) {
    why = "the step ends at " + number_text(t + h, 12) + " s; allowed: up to the end of the experiment, " +
          number_text(stop_s_, 12) + " s";
    return Outcome::refused;
  }
  const auto steps = std::llround(count);
  try {
    for (long long i = 0; i < steps && why.empty(); ++i) {
      commands_.clear();
      if (program_) {
        const std::span<const Command> own = program_->commands(*simulation_);
        commands_.assign(own.begin(), own.end());
      }
      if (i == 0) add_commands(h);
      if (!simulation_->step(commands_)) why = simulation_->fault();
    }
  } catch (const std::exception& error) {
    why = error.what();
  }
  simulation_->read_snapshot(snapshot_);
  if (why.empty()) return Outcome::stepped;
  phase_ = Phase::failed;
  return Outcome::failed;
}

std::string CellInstance::save(std::vector<std::byte>& state) {
  if (program_)
    return "a cell with a robot program has no state that can be saved: that of the program is in Lua";
  std::vector<std::byte> cell;
  if (std::string why = simulation_->save_state(cell); !why.empty()) return why;
  state.clear();
  StateWriter out(state);
  out.put(phase_), out.put(start_s_), out.put(stop_s_);
  out.put(std::span<const double>(inputs_)), out.put(std::span<const double>(applied_));
  for (const char driven : driven_) out.put(static_cast<std::uint8_t>(driven));
  state.insert(state.end(), cell.begin(), cell.end());
  return {};
}

std::string CellInstance::restore(std::span<const std::byte> state) {
  if (program_) return "a cell with a robot program has no state that can be restored";
  try {
    StateReader in(state);
    const auto phase = static_cast<Phase>(in.integer(0, static_cast<int>(Phase::failed), "a phase"));
    const auto start_s = in.get<double>(), stop_s = in.get<double>();
    std::vector<double> inputs(inputs_.size()), applied(inputs_.size());
    in.numbers(inputs, "an input"), in.numbers(applied, "an input");
    std::vector<char> driven(driven_.size());
    for (char& one : driven) one = in.flag("'a robot is driven'") ? 1 : 0;
    if (std::string why = simulation_->restore_state(in.rest()); !why.empty()) return why;
    inputs_ = inputs, applied_ = applied, driven_ = driven;
    phase_ = phase, start_s_ = start_s, stop_s_ = stop_s;
  } catch (const std::exception& error) {
    return error.what();
  }
  simulation_->read_snapshot(snapshot_);
  return {};
}

}  // namespace takt
