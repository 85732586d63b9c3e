#include "server/simulation/step/simulation.h"

#include <algorithm>
#include <vector>

#include "server/simulation/step/simulation_impl.h"
#include "server/simulation/step/step_limit.h"

namespace takt {

Simulation::Simulation(std::shared_ptr<const CellModel> model)
    : impl_(std::make_unique<Impl>(std::move(model))) {}
Simulation::~Simulation() = default;

bool Simulation::step(std::span<const Command> commands) {
  Impl& s = *impl_;
  if (!s.fault.empty()) return false;

  bool advanced = false;
  s.guard([&] { advanced = s.step(commands); });
  return advanced && s.fault.empty();
}

const std::string& Simulation::fault() const {
  return impl_->fault;
}

void Simulation::reset() {
  ++impl_->epoch;
  impl_->guard([this] { impl_->start(); });
}

const CellDescription& Simulation::description() const {
  return impl_->model->description;
}
const CellModel& Simulation::model() const {
  return *impl_->model;
}
std::uint64_t Simulation::step_index() const {
  return impl_->step_index;
}
double Simulation::time_s() const {
  return impl_->time();
}
std::uint32_t Simulation::epoch() const {
  return impl_->epoch;
}
std::uint64_t Simulation::state_hash() const {
  return impl_->hash.value();
}
std::span<const PairConnection> Simulation::connections() const {
  return impl_->interaction.connections();
}
Wrench Simulation::pair_wrench(const PairConnection& pair) const {
  impl_->refresh_motion();
  return impl_->interaction.pair_wrench(pair, impl_->system().motion());
}

StepEvents Simulation::events() const {
  return {impl_->changes,           impl_->motion_notices,      impl_->collisions,
          impl_->grip_loads.weak(), impl_->alternation.found(), impl_->device_notices,
          impl_->device_messages};
}

const GripLoad& Simulation::grip_load(std::size_t gripper) const {
  return impl_->grip_loads.load(gripper);
}

void Simulation::watch_deadlines(bool watch) {
  impl_->watch_deadlines = watch;
}
double Simulation::trajectory_end_s(std::size_t robot) const {
  return impl_->reference_motions[robot].trajectory_end_s();
}

void Simulation::read_contacts(std::vector<ContactSample>& samples) const {
  impl_->refresh_motion();
  impl_->contacts.read(impl_->system().motion(), samples);
}

void Simulation::read_contact_peaks(std::vector<ContactPeak>& peaks) const {
  impl_->refresh_motion();
  impl_->contacts.read_peaks(impl_->system().motion(), peaks);
}

void Simulation::watch_contact_peaks(bool watch) {
  impl_->contacts.watch_peaks(watch);
}

ContactCallCounts Simulation::contact_counts() const {
  return impl_->contacts.counts();
}

ContactInteraction::Size Simulation::contact_size() const {
  return impl_->contacts.size();
}

void Simulation::set_executor(Executor* executor, std::uint64_t least_calls) {
  impl_->executor = executor;
  impl_->least_calls = least_calls;
  impl_->contacts.set_executor(executor);
  impl_->interaction.set_executor(executor, least_calls);
}

void Simulation::set_stage_clock(double (*now_s)()) {
  impl_->clock = now_s;
  impl_->plant.set_clock(now_s);
}

const SimulationStatistics& Simulation::statistics() const {
  SimulationStatistics& s = impl_->statistics;
  s.steps = impl_->step_index;
  s.derivative_evaluations = impl_->system().evaluations();
  s.broad_phase_tests = impl_->interaction.counts().broad_phase_tests;
  s.mpr_calls = impl_->interaction.counts().mpr_calls;
  s.mpr_skipped = impl_->interaction.counts().mpr_skipped;
  s.partner_searches = impl_->interaction.partner_searches();
  const ComponentInteraction::StageTimes& times = impl_->interaction.stage_times();
  s.broad_phase_s = times.broad_phase_s;
  s.mpr_s = times.mpr_s;
  s.partner_search_s = times.partner_search_s;
  s.forces_s = impl_->system().forces_s();
  if (impl_->monitor) {
    s.clearance_pairs = impl_->monitor->counts().pairs_asked;
    s.clearance_distances = impl_->monitor->counts().distances;
  }
  s.solver = impl_->plant.integrator().statistics();
  return s;
}

std::string Simulation::set_level_of_detail(int process, int level) {
  Impl& s = *impl_;
  std::vector<int> levels;
  for (std::size_t r = 0; r < s.model->robots.size(); ++r) levels.push_back(s.plant.level(r));
  for (std::size_t p = 0; p < s.model->description.processes.size(); ++p) {
    if (process >= 0 && static_cast<std::size_t>(process) != p) continue;
    for (const int robot : s.model->description.processes[p].robots)
      levels[static_cast<std::size_t>(robot)] = level;
  }
  if (level == 3 && !s.model->contact.enabled)
    return "surface contact was not prepared: the scenario has no section 'contact' and no process that "
           "begins at level 3";
  for (std::size_t r = 0; r < levels.size(); ++r) {
    if (levels[r] > 1 && !s.plant.can_be_dynamic(r))
      return s.model->description.robots[r].name + " can only be kinematic: " + s.model->no_dynamics[r];
  }
  std::vector<int> process_levels = s.process_levels;
  for (std::size_t p = 0; p < process_levels.size(); ++p)
    if (process < 0 || static_cast<std::size_t>(process) == p) process_levels[p] = level;
  const int highest =
      process_levels.empty() ? level : *std::max_element(process_levels.begin(), process_levels.end());
  if (highest < 3) {
    bool refused = false;
    const std::string remark = step_remark(*s.model, highest == 2, refused);
    if (refused) return remark;
  }
  s.process_levels = process_levels;
  const bool was_good = s.fault.empty();
  s.guard([&] { s.regroup(levels); });
  s.motion_is_current = false;
  return was_good ? s.fault : std::string();
}

const SolverParameters& Simulation::solver() const {
  return impl_->plant.solver();
}

int Simulation::level_of_detail(std::size_t robot) const {
  return impl_->plant.level(robot);
}

int Simulation::process_level(std::size_t process) const {
  return impl_->process_levels[process];
}

}  // namespace takt
