// takt explain: why a Part is held as it is.
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "client_lib/recording/json_text.h"
#include "client_lib/tools/takt/commands.h"
#include "idl/common/text.h"

namespace takt::tool {
namespace {

using client::ComponentType;
using client::PartExplanation;
using client::Vector3;

constexpr double kTouching_m = 5e-8;             // what four decimals of a millimetre do not show
constexpr std::size_t kSequencesForPeople = 20;  // --json has all that came

/// "O (part 3)": name, type, and for a Part its hierarchy.
std::string labelled(const PartExplanation& e, const std::string& name) {
  const auto found = e.components.find(name);
  if (found == e.components.end()) return name;
  const auto& [type, hierarchy] = found->second;
  return name + " (" + std::string(to_string(type)) +
         (type == ComponentType::part ? " " + std::to_string(hierarchy) : std::string()) + ")";
}

double length(const Vector3& v) {
  return std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z);
}

/// How many are not in a list.
void print_rest(std::uint64_t count, std::size_t listed) {
  if (count > listed) std::printf("  and %llu more\n", static_cast<unsigned long long>(count - listed));
}

void print_sequences(const PartExplanation& e) {
  if (e.sequences.empty()) return;
  std::printf("Sequences (%llu), the hierarchy of Parts rising:\n",
              static_cast<unsigned long long>(e.sequence_count));
  const std::size_t listed = std::min(e.sequences.size(), kSequencesForPeople);
  for (std::size_t i = 0; i < listed; ++i) {
    const std::string line =
        join(e.sequences[i], " > ", [&](const std::string& name) { return labelled(e, name); });
    std::printf("  %s%s\n", line.c_str(), i == 0 && !e.partner.empty() ? "   <- chosen" : "");
  }
  print_rest(e.sequence_count, listed);
}

void print_contacts(const PartExplanation& e) {
  if (e.contacts.empty()) return;
  std::printf("Contacts, as of %.3f s:\n", e.decided_at_s);
  for (const PartExplanation::Contact& c : e.contacts) {
    std::printf("  %s - %s: ", c.a.c_str(), c.b.c_str());
    if (!c.measured) {
      std::printf("%s\n", c.by_surface ? "their surfaces do not press" : "not measured");
    } else {
      if (std::abs(c.distance_m) < kTouching_m)
        std::printf("just touching");
      else
        std::printf("%.4f mm %s", 1e3 * std::abs(c.distance_m), c.distance_m < 0.0 ? "deep" : "apart");
      std::printf(" at (%.4f, %.4f, %.4f) m\n", c.position_m.x, c.position_m.y, c.position_m.z);
    }
  }
  print_rest(e.contact_count, e.contacts.size());
}

void print_connections(const PartExplanation& e) {
  for (const PartExplanation::Connection& c : e.connections) {
    std::printf(
        "Force of %s on it: %.4f N (%.4f, %.4f, %.4f), of which %.4f N carry weight; moment %.4f N m\n",
        c.target.c_str(), length(c.force_N), c.force_N.x, c.force_N.y, c.force_N.z, length(c.feed_forward_N),
        length(c.moment_Nm));
    if (c.softening < 1.0)
      std::printf("  nothing holds %s: constants reduced to %.3g of their values\n", c.target.c_str(),
                  c.softening);
  }
}

void print_pressing(const PartExplanation& e) {
  for (const PartExplanation::Pressing& p : e.pressing) {
    std::printf(
        "%s presses: %.4f N normal, %.4f N friction, in all (%.4f, %.4f, %.4f) N; %.2f mm2, %.3f um deep at "
        "(%.4f, %.4f, %.4f) m\n",
        p.by.c_str(), p.normal_force_N, p.friction_force_N, p.force_N.x, p.force_N.y, p.force_N.z,
        1e6 * p.area_m2, 1e6 * p.largest_penetration_m, p.center_of_pressure_m.x, p.center_of_pressure_m.y,
        p.center_of_pressure_m.z);
  }
}

}  // namespace

int explain(const Common& common, const std::string& part) {
  const PartExplanation e = Session(common)->explain_part(part);
  if (common.json) {
    const auto document = recording::read_json(e.document);
    if (!document) throw std::runtime_error("The server's explanation of '" + part + "' is no JSON.");
    std::printf("%s\n", recording::json_text(*document, 2).c_str());
    return 0;
  }
  std::printf("At %.3f s (step %llu): %s\n", e.time_s, static_cast<unsigned long long>(e.step),
              e.explanation.c_str());
  print_sequences(e);
  print_contacts(e);
  print_connections(e);
  print_pressing(e);
  if (e.type == ComponentType::part && !e.held.empty()) {
    std::printf("It holds");
    for (const std::string& name : e.held) std::printf(" %s", name.c_str());
    std::printf("\n");
    print_rest(e.held_count, e.held.size());
  }
  return 0;
}

}  // namespace takt::tool
