#include "server/runtime/host/replay.h"

#include <cstdio>
#include <cstring>
#include <map>
#include <utility>

#include "plant_models/state_bytes.h"
#include "server/runtime/host/scenario_edit.h"
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
    // What was recorded behind the last checkpoint was simulated, but there is nothing to compare it with.
    if (simulation_ && !batch_.empty()) take_step();
    return std::move(result_);
  }

 private:
  void apply(const LogEntry& entry, StateReader& content) {
    if (entry.kind == LogKind::begin) {
      begun_ = true;
      result_.version = content.text(1000, "letters of the version");
      result_.cell = content.text(1000, "letters of the cell's name");
      return;
    }
    if (!begun_) content.fail("the first record is not the beginning of a log");
    switch (entry.kind) {
      case LogKind::scenario:
        begin_scenario(entry);
        return;
      case LogKind::state: {
        const auto number = content.get<std::uint64_t>();
        states_[number].assign(entry.content.begin() + sizeof(number), entry.content.end());
        return;
      }
      case LogKind::lost:
        result_.early_end = "from here on " + name_ + " lacks records, as the disk was too slow";
        return;
      case LogKind::end:
        result_.complete = true;
        return;
      default:
        break;
    }
    if (!simulation_) content.fail("there is a record of a step, but no scenario is loaded");
    advance_to(entry.step, content);
    if (!result_.difference.empty()) return;
    apply_to_world(entry, content);
    if (entry.kind != LogKind::checkpoint) content.expect_end();
  }

  void apply_to_world(const LogEntry& entry, StateReader& content) {
    const CellDescription& cell = simulation_->description();
    const auto component = [&] {
      return content.integer<std::int32_t>(0, size_of(cell.components) - 1, "a component");
    };
    ++result_.requests;
    switch (entry.kind) {
      case LogKind::joint_command: {
        JointCommand command;
        command.robot = content.integer<std::int32_t>(0, size_of(cell.robots) - 1, "the robot");
        command.stamp_s = content.get<double>();
        command.period_s = content.get<double>();
        command.has_velocity = content.flag("whether there are velocities");
        command.has_effort = content.flag("whether there are efforts");
        content.integer(static_cast<int>(command.position.size()), static_cast<int>(command.position.size()),
                        "the number of joints");
        for (double& q : command.position) q = content.get<double>();
        for (double& v : command.velocity) v = content.get<double>();
        if (command.has_effort)
          for (double& tau : command.effort) tau = content.get<double>();
        add(command);
        return;
      }
      case LogKind::gripper_command: {
        GripperCommand command;
        command.gripper = content.integer<std::int32_t>(0, size_of(cell.grippers) - 1, "the gripper");
        command.stamp_s = content.get<double>();
        command.action = static_cast<GripperAction>(content.integer(0, 2, "the gripper's action"));
        command.width_m = content.get<double>();
        command.max_force_N = content.get<double>();
        add(command);
        return;
      }
      case LogKind::trajectory_command: {
        TrajectoryCommand command;
        command.robot = content.integer<std::int32_t>(0, size_of(cell.robots) - 1, "the robot");
        command.stamp_s = content.get<double>();
        auto path = std::make_shared<JointPath>();
        path->order = static_cast<PathOrder>(content.integer(1, 5, "the order of the trajectory"));
        path->has_feed_forward = content.flag("whether the trajectory has efforts");
        path->points.resize(static_cast<std::size_t>(content.integer<std::int32_t>(
            0, static_cast<int>(kMaxTrajectoryPoints), "the number of points")));
        for (JointPathPoint& point : path->points) {
          point.t = content.get<double>();
          for (JointArray* values : {&point.q, &point.qd, &point.qdd})
            for (double& value : *values) value = content.get<double>();
          if (!path->has_feed_forward) continue;
          for (double& tau : point.feed_forward) tau = content.get<double>();
        }
        command.path = std::move(path);
        add(command);
        return;
      }
      case LogKind::device_command: {
        DeviceCommand command;
        command.device = content.integer<std::int32_t>(0, size_of(cell.devices) - 1, "the device");
        command.stamp_s = content.get<double>();
        const int signals =
            static_cast<int>(cell.devices[static_cast<std::size_t>(command.device)].signals.size());
        command.count = content.integer(0, kMaxSignals, "the number of signals");
        for (std::size_t i = 0; i < static_cast<std::size_t>(command.count); ++i) {
          command.signals[i] = static_cast<std::uint8_t>(content.integer(0, signals - 1, "a signal"));
          command.values[i] = content.get<double>();
        }
        add(command);
        return;
      }
      case LogKind::deadlines:
        --result_.requests;
        simulation_->watch_deadlines(content.flag("whether deadlines count"));
        return;
      case LogKind::reset:
        batch_.clear();
        simulation_->reset();
        trail_.clear();
        trail_begin_ = 0;
        return;
      case LogKind::level_of_detail: {
        const int process = content.integer<std::int32_t>(-1, size_of(cell.processes) - 1, "the process");
        const int level = content.integer<std::int32_t>(1, 3, "the level of detail");
        expect_done("the level of detail was changed", simulation_->set_level_of_detail(process, level));
        return;
      }
      case LogKind::attach: {
        const int part = component();
        expect_done("a Part was attached", simulation_->attach(part, component()));
        return;
      }
      case LogKind::detach:
        expect_done("a Part was detached", simulation_->detach(component()));
        return;
      case LogKind::entity_state: {
        const int which = component();
        Pose X_WB;
        Twist V_WB;
        for (double& value : std::span(X_WB.R.data(), 9)) value = content.get<double>();
        for (double& value : std::span(X_WB.p.data(), 3)) value = content.get<double>();
        for (double& value : std::span(V_WB.v.data(), 3)) value = content.get<double>();
        for (double& value : std::span(V_WB.w.data(), 3)) value = content.get<double>();
        expect_done("a Part was put elsewhere", simulation_->set_component_state(which, X_WB, V_WB));
        return;
      }
      case LogKind::restored:
        batch_.clear();
        restore(content.get<std::uint64_t>(), content);
        return;
      case LogKind::saved:
        static_cast<void>(simulation_->save_state(scratch_));  // it may have been refused then, too
        return;
      case LogKind::checkpoint:
        --result_.requests;
        compare(entry);
        return;
      case LogKind::fault:
        --result_.requests;
        if (simulation_->step(std::exchange(batch_, {})))
          differ(simulation_->step_index(), "the step could not be taken then, but can now");
        return;
      case LogKind::scenario_end:
        --result_.requests;
        simulation_.reset();
        return;
      default:
        content.fail("it has a record of kind " + std::to_string(static_cast<int>(entry.kind)) +
                     ", which this program does not know; it was recorded by " + result_.version);
    }
  }

  template <typename T>
  static int size_of(const std::vector<T>& items) {
    return static_cast<int>(items.size());
  }

  void add(const Command& command) {
    batch_.push_back(command);
    --result_.requests;
    ++result_.commands;
  }

  void begin_scenario(const LogEntry& entry) {
    const LogScenario logged = decode_scenario(entry.content);
    const auto model = options_.load(logged);
    const std::string& scenario = model->description.scenario;
    if (scenario != logged.scenario)
      throw LogError(name_ + " is of the scenario '" + logged.scenario + "', but '" + scenario +
                     "' was read");
    const std::uint64_t hash = model_hash(*model);
    if (hash != logged.model)
      throw LogError(name_ + " is of another model (" + hash_text(logged.model) + ") of the scenario '" +
                     scenario + "' than what was read now (" + hash_text(hash) +
                     "): shapes, masses, constants and solver must be as they were");
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

  void compare(const LogEntry& entry) {
    std::uint64_t hash = 0;
    const std::size_t trail_bytes = entry.content.size() - sizeof(hash);
    if (entry.content.size() < sizeof(hash) || trail_bytes % sizeof(LogTrail) != 0)
      throw LogError(name_ + " has a checkpoint of a wrong length");
    std::memcpy(&hash, entry.content.data(), sizeof(hash));
    std::vector<LogTrail> trail(trail_bytes / sizeof(LogTrail));
    if (!trail.empty()) std::memcpy(trail.data(), entry.content.data() + sizeof(hash), trail_bytes);
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
                     hash_text(hash) + ", and is " + hash_text(simulation_->state_hash()));
  }

  void differ(std::uint64_t step, const std::string& how) {
    if (!result_.difference.empty()) return;
    result_.different_step = step;
    char time[48];
    std::snprintf(time, sizeof(time), "%.6f s",
                  static_cast<double>(step) * simulation_->description().step_s);
    result_.difference = "The replay differs first after step " + std::to_string(step) + " (" + time +
                         ") of scenario " + simulation_->description().scenario + ": " + how + ".";
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
  std::vector<std::uint64_t> trail_;                        ///< hashes since the last checkpoint
  std::uint64_t trail_begin_ = 0;
};

}  // namespace

std::shared_ptr<const CellModel> load_logged_scenario(const LogScenario& logged,
                                                      const std::filesystem::path& cache_directory,
                                                      const std::filesystem::path& instead) {
  const std::filesystem::path& file = instead.empty() ? logged.source.file : instead;
  if (file.empty()) throw LogError("the recorded cell '" + logged.scenario + "' came from no scenario file");
  const Scenario scenario = read_scenario(file, logged.source.options);
  return build_cell(with_changes(scenario, logged.changes), {cache_directory});
}

ReplayResult replay(const std::filesystem::path& log, const ReplayOptions& options) {
  return Replay(log, options).run();
}

}  // namespace takt
