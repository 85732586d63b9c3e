#pragma once
// What requests that are replayed do to a simulation between two steps (@request changes "bits"), for the step loop and
// for replay alike. All names are those of the cell. Empty if done, else why not, as a sentence.
#include <string>

#include "takt_requests.h"

namespace takt {

class Simulation;

std::string apply(const requests::SetLevelOfDetail& request, Simulation& simulation);
std::string apply(const requests::SetEntityState& request, Simulation& simulation);
std::string apply(const requests::Attach& request, Simulation& simulation);
std::string apply(const requests::Detach& request, Simulation& simulation);

}  // namespace takt
