#pragma once
// Results of a headless run: a report as JSON and as a page.
#include <ostream>
#include <string>
#include <string_view>

#include "idl/common/ros_packages.h"
#include "server/headless/headless_run.h"
#include "server/simulation/model/cell_model.h"

namespace takt {

struct RunInfo {
  std::string solver;
  int level_of_detail = 1;
  Pace pace = Pace::free;
  std::vector<ConvexImport> convex_imports;
  std::vector<ImportNote> import_notes;
  PackageFolders packages{};  ///< of the robots' mesh files, for pictures
};

/// fault: the run ended early; failed: it does not meet a demand of the scenario; passed.
std::string_view verdict(const HeadlessResult& result);

/// JSON text of the report.
std::string report_json(const Scenario& scenario, const CellDescription& cell, const RunInfo& info,
                        const HeadlessResult& result);

/// The same as a page for a browser, with a picture and plots. For a run with metrics (HeadlessOptions::run_metrics).
void write_html(std::ostream& out, const Scenario& scenario, const CellDescription& cell, const RunInfo& info,
                const HeadlessResult& result);

/// Null where the scenario expects none.
const ExpectedPose* expected_pose(const Scenario& scenario, const std::string& part);

/// Largest distance of a Part from its expected place (m); 0 without expected places.
double max_position_error_m(const Scenario& scenario, const CellDescription& cell, const Snapshot& state);

}  // namespace takt
