#pragma once
// An exported cell that runs: what the functions of FMI 2.0 and 3.0 have in common. Variables are numbered: first the inputs,
// then the outputs, then the time.
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
  /// Builds the cell of the resources of an FMU. Throws with a sentence, also if the token is another one.
  CellInstance(const std::filesystem::path& resources, const std::string& token);

  std::size_t time_variable() const { return variables_.size(); }
  bool is_input(std::size_t variable) const { return variable < inputs_.size(); }
  bool exists(std::size_t variable) const { return variable <= variables_.size(); }
  double value(std::size_t variable) const;
  void set(std::size_t input, double value) { inputs_[input] = value; }
  /// Advances from t to t + h, both whole multiples of the cell's step. Empty on success; else the reason. A wrong t or h
  /// changes nothing (`refused`); a cell that cannot be advanced stays as it is until reset().
  std::string step(double t, double h, bool& refused);
  void reset();
  /// All that influences later steps. Empty on success; else the reason: a cell with a robot program has no such state.
  std::string save(std::vector<std::byte>& state);
  std::string restore(std::span<const std::byte> state);

 private:
  /// Commands of the inputs that differ from those applied before. Throws std::runtime_error.
  void add_commands(double h);

  Scenario scenario_;
  std::shared_ptr<const CellModel> model_;
  std::unique_ptr<Simulation> simulation_;
  std::optional<InProcessController> program_;
  std::vector<CellVariable> variables_;
  std::vector<double> inputs_, applied_, start_;
  std::vector<char> driven_;  ///< by robot: its set-points have been commanded
  std::vector<Command> commands_;
  Snapshot snapshot_;
};

}  // namespace takt
