#pragma once
// Pairs in surface contact by name, as people and clients call them.
#include <span>
#include <string>
#include <vector>

#include "server/contact/surface/contact_model.h"
#include "server/simulation/model/cell_description.h"

namespace takt {

/// BASE-TARGET.
std::string contact_pair_name(const CellDescription& cell, const ContactPairModel& pair);

/// Pairs (indices of the model's, ascending) whose name, BASE-TARGET or TARGET-BASE, fits one of the
/// patterns: `*` stands for any characters. `unknown` receives the patterns that fit no pair.
std::vector<std::size_t> find_contact_pairs(const ContactModel& model, const CellDescription& cell,
                                            std::span<const std::string> patterns,
                                            std::vector<std::string>* unknown = nullptr);

}  // namespace takt
