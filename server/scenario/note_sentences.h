#pragma once
// Import notes for people.
#include <string>
#include <vector>

#include "server/simulation/model/cell_model.h"

namespace takt {

/// The sentences of the notes, each once. Where several components have the same sentence but for their names, that of the first
/// one stands for all, and names the others.
std::vector<std::string> note_sentences(const std::vector<ImportNote>& notes);

}  // namespace takt
