#include "server/headless/program_view.h"

#include "server/messages/instant_messages.h"

namespace takt {

using controller::StatePart;

ProgramView::ProgramView(const Simulation& simulation)
    : snapshot_(simulation.make_snapshot()),
      state_(make_state_message(simulation.description())),
      read_at_(snapshot_.components.size(), 0) {}

void ProgramView::look_at(const Simulation& simulation) {
  simulation_ = &simulation;
  ++instant_;
  all_ = machines_ = false;
  simulation.read_instant(snapshot_);
  fill_instant(state_, snapshot_);
}

const takt_msgs::msg::CellState& ProgramView::read(StatePart part, std::size_t component) {
  if (all_ || part == StatePart::time || part == StatePart::instant) return state_;
  const CellDescription& cell = simulation_->description();
  if (part == StatePart::component && read_at_[component] != instant_) {
    simulation_->read_component(static_cast<int>(component), snapshot_.components[component]);
    fill(state_.components[component], snapshot_.components[component]);
    read_at_[component] = instant_;
  } else if (part == StatePart::machines && !machines_) {
    simulation_->read_machines(snapshot_);
    fill_machines(state_, cell, snapshot_);
    machines_ = true;
  } else if (part == StatePart::all) {
    simulation_->read_snapshot(snapshot_);
    fill(state_, cell, snapshot_);
    all_ = true;
    ++whole_reads_;
  }
  return state_;
}

}  // namespace takt
