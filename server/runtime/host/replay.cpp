#include "server/runtime/host/replay.h"

#include <concepts>
#include <map>
#include <utility>
#include <variant>

#include "idl/common/text.h"
#include "plant_models/state_bytes.h"
#include "server/runtime/host/scenario_edit.h"
#include "server/runtime/requests/bit_changes.h"
#include "server/scenario/scenario_builder.h"
#include "server/simulation/model/model_hash.h"
#include "server/simulation/model/state_hash.h"
#include "server/simulation/step/simulation.h"

namespace takt {
namespace {

class Replay {
 public:
  Replay(const std::filesystem::path& log, const ReplayOptions& options)
      : name_("the log '" + log.string() + "'"), options_(options), reader_(log) {}

  ReplayResult run() {
    LogEntry entry;
    while (result_.difference.empty() && reader_.next(entry)) {
      try {
        StateReader content(entry.content, name_ + ", before byte " + std::to_string(reader_.read_bytes()));
        apply(entry, content);
      } catch (const StateError& error) {
        throw LogError(error.what());
      }
    }
    if (!result_.difference.empty()) return std::move(result_);
    if (!begun_)
      throw LogError(name_ + (reader_.torn() ? " was cut off within its first record" : " is empty"));
    if (reader_.torn()) {
      result_.early_end = name_ + " was cut off after byte " + std::to_string(reader_.read_bytes());
    } else if (result_.early_end.empty() && !result_.complete) {
      result_.early_end = name_ + " was not ended in order";
    }
    if (result_.checkpoints == 0)
      throw LogError(name_ + " has no checkpoint: there is nothing to compare with" +
                     (result_.early_end.empty() ? "" : "; " + result_.early_end));
    // The steps after the last checkpoint were recorded, but there is no hash for comparison.
    if (simulation_ && !batch_.empty()) take_step();
    return std::move(result_);
  }

 private:
  void apply(const LogEntry& entry, StateReader& content) {
    static const CellDescription no_cell;
    const auto record = decode(entry.kind, content, simulation_ ? simulation_->description() : no_cell);
    if (!record)
      content.fail("it has a record of kind " + std::to_string(static_cast<int>(entry.kind)) +
                   ", which this program does not know; it was recorded by " + result_.version);
    if (!begun_ && entry.kind != LogKind::begin)
      content.fail("the first record is not the beginning of a log");
    std::visit([&](const auto& known) { apply_known(known, entry.step, content); }, *record);
  }

  // Records without a step.

  void apply_known(const LogBegin& begin, std::uint64_t, StateReader&) {
    begun_ = true;
    result_.version = begin.version;
    result_.cell = begin.cell;
  }
  void apply_known(const LogScenario& logged, std::uint64_t, StateReader&) { begin_scenario(logged); }
  void apply_known(const LogState& state, std::uint64_t, StateReader&) {
    states_[state.number] = state.bytes;
  }
  void apply_known(const LogLost&, std::uint64_t, StateReader&) {
    result_.early_end = "from here on " + name_ + " lacks records, as the disk was too slow";
  }
  void apply_known(const LogEnd&, std::uint64_t, StateReader&) { result_.complete = true; }
  template <typename Record>
  void apply_known(const Record& record, std::uint64_t step, StateReader& content) {
    if (!simulation_) content.fail("there is a record of a step, but no scenario is loaded");
    advance_to(step, content);
    if (result_.difference.empty()) apply_at_step(record, content);
  }

  // Records ahead of a step: commands, effects of requests, notes of the loop.

  template <typename Record>
  requires std::constructible_from<Command, Record>
  void apply_at_step(const Record& command, StateReader&) {
    batch_.emplace_back(command);
    ++result_.commands;
  }
  void apply_at_step(const LogReset&, StateReader&) {
    ++result_.requests;
    batch_.clear();
    simulation_->reset();
    trail_.clear();
    trail_begin_ = 0;
  }
  void apply_at_step(const LogRequest& logged, StateReader& content) {
    ++result_.requests;
    const auto apply_one = [&]<typename Type>(const Type& request) {
      if constexpr (request_info<Type>().changes == RequestChanges::bits) {
        const BitChange change = takt::apply(request, *simulation_);
        const auto* refusal = std::get_if<std::string>(&change);
        expect_done("the request " + std::string(request_info<Type>().name) + " was executed",
                    refusal == nullptr ? "" : *refusal);
      } else {
        content.fail("a request of it changes no bits");
      }
    };
    std::visit(apply_one, logged.request);
  }
  void apply_at_step(const LogRestored& restored, StateReader& content) {
    ++result_.requests;
    batch_.clear();
    restore(restored.state, content);
  }
  void apply_at_step(const LogSaved&, StateReader&) {
    ++result_.requests;
    static_cast<void>(simulation_->save_state(scratch_));  // the recorded run may have been refused too
  }
  void apply_at_step(const LogDeadlines& deadlines, StateReader&) {
    simulation_->watch_deadlines(deadlines.count);
  }
  void apply_at_step(const LogCheckpoint& checkpoint, StateReader&) { compare(checkpoint); }
  void apply_at_step(const LogFault&, StateReader&) {
    if (simulation_->step(std::exchange(batch_, {})))
      differ(simulation_->step_index(), "the step could not be taken then, but can now");
  }
  void apply_at_step(const LogScenarioEnd&, StateReader&) { simulation_.reset(); }

  void begin_scenario(const LogScenario& logged) {
    const auto model = options_.load(logged);
    const std::string& scenario = model->description.scenario;
    if (scenario != logged.scenario)
      throw LogError(name_ + " is of the scenario '" + logged.scenario + "', but '" + scenario +
                     "' was read");
    const std::uint64_t hash = model_hash(*model);
    if (hash != logged.model)
      throw LogError(name_ + " is of another model (" + hexadecimal_text(logged.model) +
                     ") of the scenario '" + scenario + "' than what was read now (" +
                     hexadecimal_text(hash) + "): shapes, masses, constants and solver must be as they were");
    simulation_ = std::make_unique<Simulation>(model);
    if (options_.executor != nullptr) simulation_->set_executor(options_.executor);
    batch_.clear();
    trail_.clear();
    trail_begin_ = simulation_->step_index();
    ++result_.scenarios;
    result_.scenario = scenario;
    if (logged.state != 0) {
      StateReader nothing({}, name_);
      restore(logged.state, nothing);
    }
  }

  void restore(std::uint64_t number, StateReader& where) {
    const auto state = states_.find(number);
    if (state == states_.end()) where.fail("the state " + std::to_string(number) + " is not there");
    expect_done("a state was restored", simulation_->restore_state(state->second));
    states_.erase(state);
    trail_.clear();
    trail_begin_ = simulation_->step_index();
  }

  void expect_done(const std::string& what, const std::string& refusal) {
    if (!refusal.empty()) differ(simulation_->step_index(), what + " then, but cannot be now: " + refusal);
  }

  bool take_step() {
    const bool stepped = simulation_->step(batch_);
    batch_.clear();
    if (!stepped) return false;
    ++result_.steps;
    trail_.push_back(simulation_->state_hash());
    return true;
  }

  void advance_to(std::uint64_t step, const StateReader& content) {
    if (simulation_->step_index() > step)
      content.fail("a record is of step " + std::to_string(step) + ", but comes after step " +
                   std::to_string(simulation_->step_index()));
    while (simulation_->step_index() < step) {
      if (!take_step()) {
        differ(simulation_->step_index() + 1,
               "the step was taken then, but cannot be now: " + simulation_->fault());
        return;
      }
    }
  }

  void compare(const LogCheckpoint& checkpoint) {
    const auto& [hash, trail] = checkpoint;
    const std::vector<std::uint64_t> mine = std::exchange(trail_, {});
    const std::uint64_t begin = std::exchange(trail_begin_, simulation_->step_index());
    if (hash == simulation_->state_hash()) {
      ++result_.checkpoints;
      result_.step = simulation_->step_index();
      result_.state_hash = hash;
      return;
    }
    std::uint64_t step = simulation_->step_index();
    if (trail.size() == mine.size()) {
      for (std::size_t i = 0; i < trail.size(); ++i) {
        if (trail[i] == static_cast<LogTrail>(mine[i])) continue;
        step = begin + i + 1;
        break;
      }
    }
    differ(step, "at step " + std::to_string(simulation_->step_index()) + " the hash of the state was " +
                     hexadecimal_text(hash) + ", and is " + hexadecimal_text(simulation_->state_hash()));
  }

  void differ(std::uint64_t step, const std::string& how) {
    if (!result_.difference.empty()) return;
    result_.different_step = step;
    result_.difference = "The replay differs first after step " + std::to_string(step) + " (" +
                         fixed_text(static_cast<double>(step) * simulation_->description().step_s, 6) +
                         " s) of scenario " + simulation_->description().scenario + ": " + how + ".";
  }

  std::string name_;
  const ReplayOptions& options_;
  LogReader reader_;
  ReplayResult result_;
  bool begun_ = false;
  std::unique_ptr<Simulation> simulation_;
  std::vector<Command> batch_;
  std::vector<std::byte> scratch_;
  std::map<std::uint64_t, std::vector<std::byte>> states_;  ///< not restored yet
  std::vector<std::uint64_t> trail_;                        ///< hashes after the last checkpoint
  std::uint64_t trail_begin_ = 0;
};

}  // namespace

std::shared_ptr<const CellModel> load_logged_scenario(const LogScenario& logged,
                                                      const std::filesystem::path& cache_directory,
                                                      const std::filesystem::path& instead, FmuOpener* fmus,
                                                      const PackageFolders& packages) {
  const std::filesystem::path& file = instead.empty() ? logged.source.file : instead;
  if (file.empty()) throw LogError("the recorded cell '" + logged.scenario + "' came from no scenario file");
  const Scenario scenario = read_scenario(file, logged.source.options);
  return build_cell(with_changes(scenario, logged.changes), {cache_directory, nullptr, {}, fmus, packages});
}

ReplayResult replay(const std::filesystem::path& log, const ReplayOptions& options) {
  return Replay(log, options).run();
}

}  // namespace takt
