#pragma once
// What can be written in a scenario file, for editors (JSON Schema, draft 2020-12) and for people (Markdown). Both are
// made of the tables of fields that read the files; committed as config/scenarios/scenario.schema.json and
// docs/scenario_reference.md, which a test compares with these texts.
#include <string>

namespace takt {

std::string scenario_schema();
std::string scenario_reference();

}  // namespace takt
