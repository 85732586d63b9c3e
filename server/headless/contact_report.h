#pragma once
// Surface contacts in report and CSV (level of detail 3).
#include <nlohmann/json_fwd.hpp>
#include <ostream>

#include "server/headless/headless_run.h"
#include "server/simulation/model/cell_model.h"

namespace takt {

/// Number of pairs with pressure at an instant, and the wrench of each.
nlohmann::ordered_json contacts_json(const CellDescription& cell, const Snapshot& state);

/// The same at the end of a run; for each pair the largest normal force with its time (at the ends of steps);
/// calls of the contact algorithm as in Table 5.4.
nlohmann::ordered_json contacts_json(const CellDescription& cell, const HeadlessResult& result);

/// Columns of each pair that may act: normal and friction force (N), area (m2), largest pressure (Pa) and
/// largest penetration (m); zero while a pair does not press.
void write_contact_header(std::ostream& out, const CellModel& model);
void write_contacts(std::ostream& out, const CellModel& model, const ContactsSample& contacts);

}  // namespace takt
