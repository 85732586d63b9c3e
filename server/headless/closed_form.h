#pragma once
// Closed forms of reference values, as Lua: an expression, or lines that end with return.
#include <map>
#include <string>

namespace takt {

/// The finite number that the text gives; `names` are its variables besides the libraries math, string and table. Throws
/// ScenarioError, which begins with `place`.
double closed_form(const std::string& text, const std::map<std::string, double>& names,
                   const std::string& place);

}  // namespace takt
