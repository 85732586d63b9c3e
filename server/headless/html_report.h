#pragma once
// The report of a run as one page for a browser: tables and plots, without external files.
#include <nlohmann/json_fwd.hpp>
#include <ostream>
#include <string_view>

#include "server/headless/run_metrics.h"

namespace takt {

/// The verdict is first. `report`: the JSON report; `curves`: of the run, thinned to the resolution of the plots;
/// `png`: a picture of the cell, or empty.
void write_html_report(std::ostream& out, const nlohmann::ordered_json& report,
                       const std::vector<Curve>& curves, std::string_view png);

}  // namespace takt
