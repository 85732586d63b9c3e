// takt check: the present positions beside those a scenario expects at its end.
#include <cstdio>

#include "client_lib/tools/takt/commands.h"
#include "client_lib/tools/takt/sample_json.h"
#include "idl/common/eigen_messages.h"
#include "server/fields/expected_poses.h"

namespace takt::tool {
int check(const Common& common, const CheckOptions& options) {
  const ExpectedPoses expectation = read_expected(options.scenario_file);
  Session session(common);
  const Client& cell = *session;
  const State s = cell.state();
  bool all_hold = true;
  nlohmann::json document{{"time", s.time}, {"tolerance", expectation.tolerance_m}};
  if (!common.json)
    std::printf("At %.3f s, tolerance %g mm\n%-12s %32s   %32s   %10s %10s\n", s.time,
                1e3 * expectation.tolerance_m, "Part", "position [m]", "expected [m]", "error [mm]",
                "turn [°]");
  for (const auto& part : expectation.parts) {
    const auto& found = s.component(part.part);
    const Vec3& wanted = part.X_WB.p;
    const double error_m = (to_eigen(found.position) - wanted).norm();
    const double turn_rad = to_eigen(found.orientation).angularDistance(part.X_WB.quaternion());
    // A Part is as far off as its farthest point may be: the turn counts on a lever of 0.1 m.
    const bool holds = error_m <= expectation.tolerance_m && 0.1 * turn_rad <= expectation.tolerance_m;
    all_hold = all_hold && holds;
    if (common.json)
      document["parts"][part.part] = {{"position", recording::message_json(found.position, {})},
                                      {"expected_position", recording::message_json(to_vector(wanted), {})},
                                      {"position_error", error_m},
                                      {"orientation_error", turn_rad},
                                      {"ok", holds}};
    else
      std::printf("%-12s %10.6f %10.6f %10.6f   %10.6f %10.6f %10.6f   %10.4f %10.4f  %s\n",
                  part.part.c_str(), found.position.x, found.position.y, found.position.z, wanted.x(),
                  wanted.y(), wanted.z(), 1e3 * error_m, turn_rad * 180.0 / M_PI, holds ? "ok" : "NOT THERE");
  }
  document["ok"] = all_hold;
  if (common.json)
    print_json(document, 2);
  else
    std::printf("%s\n",
                all_hold ? "All Parts are where they should be." : "Not all Parts are where they should be.");
  return all_hold ? 0 : 1;
}

}  // namespace takt::tool
