#include <algorithm>
#include <utility>

#include "idl/common/glob.h"
#include "idl/common/text.h"
#include "server/geometry/mesh/diagnostic.h"
#include "server/geometry/mesh/solid_overlap.h"
#include "server/scenario/cell_builders.h"

namespace takt {

namespace {

struct StandingBody {
  int component = -1;
  Pose X_WB;
  Aabb box;
  double thickness_m = 0.0;
  bool is_part = false;
};

bool meant(const Scenario& scenario, const CellModel& cell, int a, int b) {
  const std::string& name_a = cell.components[static_cast<std::size_t>(a)].name;
  const std::string& name_b = cell.components[static_cast<std::size_t>(b)].name;
  const auto named = [&](const std::array<std::string, 2>& pair) { return glob_match(pair, name_a, name_b); };
  const auto joined = [&](const std::pair<int, int>& pair) {
    return std::minmax(pair.first, pair.second) == std::minmax(a, b);
  };
  return std::any_of(scenario.allow_overlap.begin(), scenario.allow_overlap.end(), named) ||
         std::any_of(cell.joined.begin(), cell.joined.end(), joined);
}

}  // namespace

void find_start_overlaps(const Scenario& scenario, const SharedMeshes& meshes, CellModel& cell) {
  std::vector<StandingBody> all;
  const auto add = [&](int component, const Pose& X_WB, bool is_part) {
    const BodyBox box = meshes[static_cast<std::size_t>(component)]->box();
    all.push_back({component, X_WB, box.at(X_WB, 0.0), 2.0 * box.half_B.minCoeff(), is_part});
  };
  for (const RigidBodyParameters& part : cell.parts) add(part.body, part.X_WB_initial, true);
  for (const GroundModel& ground : cell.grounds) add(ground.component, ground.X_WB, false);
  const auto probe = [&](int component) -> const SolidProbe& {
    return *meshes[static_cast<std::size_t>(component)]->probe();
  };
  for (std::size_t i = 0; i < all.size() && all[i].is_part; ++i) {
    for (std::size_t j = i + 1; j < all.size(); ++j) {
      const StandingBody &a = all[i], &b = all[j];
      const double fit_m = scenario.contact_margin_m + kLargestFit * std::min(a.thickness_m, b.thickness_m);
      const Vec3 common = a.box.upper.cwiseMin(b.box.upper) - a.box.lower.cwiseMax(b.box.lower);
      if (!(common.minCoeff() > fit_m) || meant(scenario, cell, a.component, b.component)) continue;
      const SolidOverlap overlap =
          solid_overlap(probe(a.component), a.X_WB, probe(b.component), b.X_WB, fit_m);
      if (!(overlap.depth_m > 0.0)) continue;
      const std::string& part = cell.components[static_cast<std::size_t>(a.component)].name;
      const std::string& other = cell.components[static_cast<std::size_t>(b.component)].name;
      std::string sentence = part;
      sentence.append(" starts inside ").append(other).append(", ");
      sentence.append(number_text(1e3 * overlap.depth_m, 4)).append(" mm deep at ");
      sentence.append(place_text(overlap.p_W)).append(". Correct parts.").append(part);
      sentence.append(".pose.position_m or the mesh; where the fit is meant, set world.allow_overlap: [[");
      sentence.append(part).append(", ").append(other).append("]].");
      StartOverlap found{a.component, b.component, std::move(sentence)};
      cell.import_notes.push_back({part, found.sentence, {}});
      cell.start_overlaps.push_back(std::move(found));
    }
  }
}

}  // namespace takt
