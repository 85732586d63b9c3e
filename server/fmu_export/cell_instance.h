#pragma once
// An exported cell that runs: what the functions of FMI 2.0 and 3.0 have in common. Variables are numbered: first the inputs,
// then the outputs, then the time.
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "server/fmu_export/cell_variables.h"
#include "server/headless/in_process_controller.h"
#include "server/scenario/scenario.h"
#include "server/simulation/step/simulation.h"

namespace takt {

class CellInstance {
 public:
  /// Where the instance is in the life that FMI prescribes.
  enum class Phase : std::uint8_t { instantiated, initialising, stepping, terminated, failed };

  /// Builds the cell of the resources of an FMU. Throws with a sentence, also if the token is another one.
  CellInstance(const std::filesystem::path& resources, const std::string& token);

  // Calls that FMI allows in some phases alone. Empty on success; else the reason, and nothing has changed.
  std::string enter_initialisation();
  std::string exit_initialisation();
  std::string terminate();
  /// Before enter_initialisation(): times of the importer. No end: infinity.
  std::string set_experiment(double start_s, double stop_s);

  std::size_t time_variable() const { return variables_.size(); }
  bool is_input(std::size_t variable) const { return variable < inputs_.size(); }
  double value(std::size_t variable) const;
  // By functions of FMI for `type`. Empty on success; else the reason: no variable of this type, no input, a number
  // beyond its limits, or the wrong phase.
  std::string get(std::size_t variable, SignalType type, double& value) const;
  std::string set(std::size_t variable, SignalType type, double value);
  /// `discarded`: h is no whole multiple of the cell's step. `refused`: t, h or the phase is wrong. Both change nothing.
  /// `failed`: the cell cannot be advanced, and stays as it is until reset() or restore().
  enum class Outcome : std::uint8_t { stepped, discarded, refused, failed };
  /// Advances from t to t + h.
  Outcome step(double t, double h, std::string& why);
  void reset();
  /// All that influences later steps. Empty on success; else the reason: a cell with a robot program has no such state.
  std::string save(std::vector<std::byte>& state);
  std::string restore(std::span<const std::byte> state);

 private:
  /// Commands of the inputs that differ from those applied before. Throws std::runtime_error.
  void add_commands(double h);
  std::string check_type(std::size_t variable, SignalType type) const;
  std::string only_in(Phase allowed, const char* call) const;

  Scenario scenario_;
  std::shared_ptr<const CellModel> model_;
  std::unique_ptr<Simulation> simulation_;
  std::optional<InProcessController> program_;
  std::vector<CellVariable> variables_;
  std::vector<double> inputs_, applied_, start_;
  std::vector<char> driven_;  ///< by robot: its set-points have been commanded
  std::vector<Command> commands_;
  Snapshot snapshot_;
  Phase phase_ = Phase::instantiated;
  double start_s_ = 0.0, stop_s_ = 0.0;  ///< of the importer's time; the cell begins at 0
};

}  // namespace takt
