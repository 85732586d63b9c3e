#pragma once
// What report and CSV say of surface contacts (level of detail 3).
#include <nlohmann/json_fwd.hpp>
#include <ostream>

#include "server/headless/headless_run.h"
#include "server/simulation/model/cell_model.h"

namespace takt {

/// How many pairs press at an instant, and what each of them exerts.
nlohmann::ordered_json contacts_json(const CellDescription& cell, const Snapshot& state);

/// The same at the end of a run; of each pair that ever pressed the largest normal force with its time (at
/// the ends of steps); calls of the contact algorithm as in Table 5.4.
nlohmann::ordered_json contacts_json(const CellDescription& cell, const HeadlessResult& result);

/// Columns of each pair that may act: normal and friction force (N), area (m2), largest pressure (Pa) and
/// largest penetration (m); zero while a pair does not press.
void write_contact_header(std::ostream& out, const CellModel& model);
void write_contacts(std::ostream& out, const CellModel& model, const ContactsSample& contacts);

}  // namespace takt
