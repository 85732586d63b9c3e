#pragma once
// The keys of a scenario file, for editors (JSON Schema, draft 2020-12) and for users (Markdown). Both are
// made from the tables of fields that read the files, and committed as config/scenarios/scenario.schema.json
// and docs/scenario_reference.md, which a test compares with these texts.
#include <string>

namespace takt {

std::string scenario_schema();
std::string scenario_reference();

}  // namespace takt
