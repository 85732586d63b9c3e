#pragma once
// The report of a run as one page for a browser: tables and plots, nothing outside of the file.
#include <nlohmann/json_fwd.hpp>
#include <ostream>

#include "server/headless/run_metrics.h"

namespace takt {

/// `report`: the JSON report; `curves`: of the run, thinned to what a picture can show.
void write_html_report(std::ostream& out, const nlohmann::ordered_json& report,
                       const std::vector<Curve>& curves);

}  // namespace takt
