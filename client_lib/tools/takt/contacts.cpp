// takt contacts: what presses upon what.
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "client_lib/recording/json_text.h"
#include "client_lib/tools/takt/commands.h"
#include "client_lib/tools/takt/follow.h"
#include "client_lib/tools/takt/vector_json.h"

namespace takt::tool {
namespace {

nlohmann::json json_of(const client::Contacts& contacts) {
  nlohmann::json list = nlohmann::json::array();
  for (const auto& c : contacts.contacts)
    list.push_back({{"base", c.base},
                    {"target", c.target},
                    {"force", c.force_N},
                    {"torque", c.torque_Nm},
                    {"center_of_pressure", c.center_of_pressure_m},
                    {"elements", c.elements},
                    {"area", c.area_m2},
                    {"normal_force", c.normal_force_N},
                    {"friction_force", c.friction_force_N},
                    {"largest_pressure", c.largest_pressure_Pa},
                    {"largest_penetration", c.largest_penetration_m}});
  return {{"time", contacts.time_s},
          {"step", contacts.step},
          {"epoch", contacts.epoch},
          {"contacts", std::move(list)},
          {"omitted", contacts.omitted}};
}

void print(const Common& common, const client::Contacts& contacts) {
  if (common.json) {
    std::printf("%s\n", recording::json_text(json_of(contacts)).c_str());
  } else if (contacts.contacts.empty()) {
    std::printf("%9.3f s  nothing presses\n", contacts.time_s);
  } else {
    int width = 4;
    for (const auto& c : contacts.contacts)
      width = std::max(width, static_cast<int>(c.base.size() + c.target.size() + 3));
    std::printf("%9.3f s  %-*s %12s %12s %11s %13s %10s\n", contacts.time_s, width, "pair", "normal N",
                "friction N", "area mm2", "pressure kPa", "depth um");
    for (const auto& c : contacts.contacts)
      std::printf("%11s  %-*s %12.4f %12.4f %11.2f %13.3f %10.3f\n", "", width,
                  (c.base + " - " + c.target).c_str(), c.normal_force_N, c.friction_force_N, 1e6 * c.area_m2,
                  1e-3 * c.largest_pressure_Pa, 1e6 * c.largest_penetration_m);
    if (contacts.omitted > 0)
      std::printf("%11s  and %llu more\n", "", static_cast<unsigned long long>(contacts.omitted));
  }
  std::fflush(stdout);
}

}  // namespace

int contacts(const Common& common, const FollowOptions& options) {
  Session session(common);
  Client& cell = *session;
  const auto processes = cell.status().processes;
  if (std::all_of(processes.begin(), processes.end(), [](const auto& p) { return p.level_of_detail < 3; }))
    throw std::runtime_error(
        "There is no surface contact: every process is below level of detail 3. 'takt lod 3' changes that.");
  return follow<client::Contacts>(
      common, options, "contacts",
      [&](const auto& predicate, client::Seconds timeout) {
        return cell.wait_for_contacts(predicate, timeout);
      },
      [&](const client::Contacts& sample) { print(common, sample); });
}

}  // namespace takt::tool
