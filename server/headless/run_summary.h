#pragma once
// What a run came to, for a person and as section "summary" of the report. Only of a run with metrics
// (HeadlessOptions::run_metrics).
#include <nlohmann/json_fwd.hpp>
#include <ostream>

#include "server/headless/headless_run.h"

namespace takt {

/// Section "summary":
///  - cycle_time: end of the program's last step, or null
///  - parts: end position, holder and, where the scenario expects a place, the distance from it
///  - loads: of each robot the joint with the largest used share of its limit, of each gripper the largest load
///  - largest_contact_force: by surface contact, or null
nlohmann::ordered_json run_summary_json(const Scenario& scenario, const CellDescription& cell,
                                        const HeadlessResult& result);

/// Events of severity warning and error.
nlohmann::ordered_json warnings_json(const HeadlessResult& result);

/// The same as lines and tables.
void print_summary(std::ostream& out, const Scenario& scenario, const CellDescription& cell,
                   const HeadlessResult& result);

}  // namespace takt
