#include "server/headless/csv_writer.h"

#include <stdexcept>

#include "idl/common/lockstep.h"
#include "server/simulation/model/cell_model.h"

namespace takt {

CsvWriter::CsvWriter(const std::filesystem::path& file, const Simulation& simulation, double period_s)
    : file_(file),
      out_(file),
      snapshot_(simulation.make_snapshot()),
      instants_(simulation.description()),
      period_s_(period_s) {
  if (!out_) throw std::runtime_error(file.string() + ": cannot be written");
}

nlohmann::json CsvWriter::pairs_json(const Simulation& simulation) const {
  const auto pressing = snapshot_.contacts.pressing();
  auto next = pressing.begin();  // in the order of the pairs
  nlohmann::json pairs;
  for (const ContactPairModel& pair : simulation.model().contact.pairs) {
    ContactSample sample;
    sample.base = pair.base;
    sample.target = pair.target;
    if (next != pressing.end() && next->base == pair.base && next->target == pair.target) sample = *next++;
    if (pair.force == PairForce::substitute) continue;
    nlohmann::json contact = instants_.of(sample);
    const std::string name = contact["base"].get<std::string>() + "-" + contact["target"].get<std::string>();
    for (const char* of_name : {"base", "target"}) contact.erase(of_name);
    pairs[name] = std::move(contact);
  }
  return pairs;
}

void CsvWriter::record(const Simulation& simulation) {
  const double step_s = simulation.description().step_s;
  if (simulation.step_index() != period_boundary_step(next_, period_s_, step_s)) return;
  while (period_boundary_step(next_, period_s_, step_s) <= simulation.step_index()) ++next_;
  simulation.read_snapshot(snapshot_);
  nlohmann::json instant = instants_.of(snapshot_);
  if (snapshot_.contacts.acting) instant["contacts"]["contacts"] = pairs_json(simulation);
  out_ << table_.lines(instant);
}

void CsvWriter::close() {
  out_.close();
  if (!out_) throw std::runtime_error(file_.string() + ": writing failed (disk full?)");
}

}  // namespace takt
