#pragma once
// The report of a verification: JSON, a page for a browser, a table for a terminal.
#include <nlohmann/json_fwd.hpp>
#include <ostream>

#include "server/headless/verification.h"

namespace takt {

const char* to_string(VerificationVerdict verdict);

/// Verdict first; of each scene code verification, solution verification, inputs, comparison, files.
nlohmann::ordered_json verification_json(const Verification& verification);
/// The same as a page for a browser, from the JSON report.
void write_verification_page(std::ostream& out, const nlohmann::ordered_json& report);
/// One line for each scene, and the sentences of what is bad.
void print_verification(std::ostream& out, const Verification& verification);

}  // namespace takt
