#include "server/fmu_export/cell_instance.h"

#include <algorithm>
#include <cmath>
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

void CellInstance::reset() {
  if (simulation_->step_index() > 0 || !simulation_->fault().empty()) simulation_->reset();
  program_.reset();
  if (!scenario_.controller_program.empty())
    program_.emplace(scenario_.controller_program.string(), *simulation_, scenario_.program_parameters);
  inputs_ = applied_ = start_;
  std::fill(driven_.begin(), driven_.end(), 0);
  simulation_->read_snapshot(snapshot_);
}

double CellInstance::value(std::size_t variable) const {
  if (variable == variables_.size()) return snapshot_.time_s;
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

std::string CellInstance::step(double t, double h, bool& refused) {
  const double step_s = model_->step_s;
  refused = true;
  if (!(std::abs(t - simulation_->time_s()) <= 0.25 * step_s))
    return "the step begins at " + number_text(t, 12) + " s; the cell is at " +
           number_text(simulation_->time_s(), 12) + " s";
  const double count = h / step_s;
  if (!(count > 0.5 && count < 1e9) || std::abs(count - std::round(count)) > 1e-6 * count)
    return "the communication step is " + number_text(h, 12) +
           " s; allowed is a whole multiple of the cell's step, " + number_text(step_s, 12) + " s";
  refused = false;
  const auto steps = std::llround(count);
  try {
    for (long long i = 0; i < steps; ++i) {
      commands_.clear();
      if (program_) {
        const std::span<const Command> own = program_->commands(*simulation_);
        commands_.assign(own.begin(), own.end());
      }
      if (i == 0) add_commands(h);
      if (!simulation_->step(commands_)) return simulation_->fault();
    }
  } catch (const std::exception& error) {
    return error.what();
  }
  simulation_->read_snapshot(snapshot_);
  return {};
}

std::string CellInstance::save(std::vector<std::byte>& state) {
  if (program_)
    return "a cell with a robot program has no state that can be saved: that of the program is in Lua";
  std::vector<std::byte> cell;
  if (std::string why = simulation_->save_state(cell); !why.empty()) return why;
  state.clear();
  StateWriter out(state);
  out.put(std::span<const double>(inputs_)), out.put(std::span<const double>(applied_));
  for (const char driven : driven_) out.put(static_cast<std::uint8_t>(driven));
  state.insert(state.end(), cell.begin(), cell.end());
  return {};
}

std::string CellInstance::restore(std::span<const std::byte> state) {
  if (program_) return "a cell with a robot program has no state that can be restored";
  try {
    StateReader in(state);
    std::vector<double> inputs(inputs_.size()), applied(inputs_.size());
    in.numbers(inputs, "an input"), in.numbers(applied, "an input");
    std::vector<char> driven(driven_.size());
    for (char& one : driven) one = in.flag("'a robot is driven'") ? 1 : 0;
    if (std::string why = simulation_->restore_state(in.rest()); !why.empty()) return why;
    inputs_ = inputs, applied_ = applied, driven_ = driven;
  } catch (const std::exception& error) {
    return error.what();
  }
  simulation_->read_snapshot(snapshot_);
  return {};
}

}  // namespace takt
