#pragma once
// Execution of replayed requests (@request changes "bits") on a simulation between two steps, shared by the
// step loop and the replay. All names are those of the cell. Empty on success, else a sentence with the
// reason.
#include <string>

#include "takt_requests.h"

namespace takt {

class Simulation;

std::string apply(const requests::SetLevelOfDetail& request, Simulation& simulation);
std::string apply(const requests::SetEntityState& request, Simulation& simulation);
std::string apply(const requests::Attach& request, Simulation& simulation);
std::string apply(const requests::Detach& request, Simulation& simulation);

}  // namespace takt
