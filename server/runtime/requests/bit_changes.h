#pragma once
// Execution of replayed requests (@request changes "bits") on a simulation between two steps, shared by the
// step loop and the replay. All names are those of the cell.
#include <string>
#include <variant>

#include "takt_event_table.h"
#include "takt_requests.h"

namespace takt {

class Simulation;

/// A change without an event, as those of commands.
struct QuietChange {
  std::string sentence;
};
/// The event of a change, a change without one, or a sentence with the reason why nothing was changed.
using BitChange = std::variant<events::OfLoop, QuietChange, std::string>;

BitChange apply(const requests::SetLevelOfDetail& request, Simulation& simulation);
BitChange apply(const requests::SetEntityState& request, Simulation& simulation);
BitChange apply(const requests::Attach& request, Simulation& simulation);
BitChange apply(const requests::Detach& request, Simulation& simulation);
BitChange apply(const requests::ForceSignal& request, Simulation& simulation);
BitChange apply(const requests::ReleaseSignal& request, Simulation& simulation);
BitChange apply(const requests::SetInputs& request, Simulation& simulation);

}  // namespace takt
