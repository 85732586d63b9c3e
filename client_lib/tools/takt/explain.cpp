// takt explain: why a Part is held as it is.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "client_lib/tools/takt/commands.h"
#include "idl/common/text.h"

namespace takt::tool {
namespace {

using takt_msgs::msg::Vector3;

constexpr double kTouching_m = 5e-8;             // what four decimals of a millimetre do not show
constexpr std::size_t kSequencesForPeople = 20;  // --json has all that came

/// "O (part 3)": name, type, and for a Part its hierarchy.
std::string labelled(const PartExplanation& e, const std::string& name) {
  const auto found = std::ranges::find(e.components, name, &requests::ExplainedComponent::name);
  if (found == e.components.end()) return name;
  return name + " (" + std::string(to_string(found->type)) +
         (found->hierarchy ? " " + std::to_string(*found->hierarchy) : std::string()) + ")";
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
    std::string line;
    for (const std::string& name : e.sequences[i].components)
      line += (line.empty() ? "" : " > ") + labelled(e, name);
    std::printf("  %s%s\n", line.c_str(), i == 0 && e.partner ? "   <- chosen" : "");
  }
  print_rest(e.sequence_count, listed);
}

void print_contacts(const PartExplanation& e) {
  if (e.contacts.empty()) return;
  std::printf("Contacts, as of %.3f s:\n", e.decided_at);
  for (const auto& c : e.contacts) {
    std::printf("  %s - %s: ", c.a.c_str(), c.b.c_str());
    if (!c.measured) {
      std::printf("%s\n", c.surface_contact ? "their surfaces do not press" : "not measured");
    } else {
      if (std::abs(c.distance) < kTouching_m)
        std::printf("just touching");
      else
        std::printf("%.4f mm %s", 1e3 * std::abs(c.distance), c.distance < 0.0 ? "deep" : "apart");
      std::printf(" at (%.4f, %.4f, %.4f) m\n", c.position.x, c.position.y, c.position.z);
    }
  }
  print_rest(e.contact_count, e.contacts.size());
}

void print_connections(const PartExplanation& e) {
  for (const auto& c : e.connections) {
    std::printf(
        "Force of %s on it: %.4f N (%.4f, %.4f, %.4f), of which %.4f N carry weight; moment %.4f N m\n",
        c.target.c_str(), length(c.force), c.force.x, c.force.y, c.force.z, length(c.feed_forward),
        length(c.moment));
    if (c.softening < 1.0)
      std::printf("  nothing holds %s: constants reduced to %.3g of their values\n", c.target.c_str(),
                  c.softening);
  }
}

void print_pressing(const PartExplanation& e) {
  for (const auto& p : e.pressing) {
    std::printf(
        "%s presses: %.4f N normal, %.4f N friction, in all (%.4f, %.4f, %.4f) N; %.2f mm2, %.3f um deep at "
        "(%.4f, %.4f, %.4f) m\n",
        p.by.c_str(), p.normal_force, p.friction_force, p.force.x, p.force.y, p.force.z, 1e6 * p.area,
        1e6 * p.largest_penetration, p.center_of_pressure.x, p.center_of_pressure.y, p.center_of_pressure.z);
  }
}

}  // namespace

int explain(const Common& common, const std::string& part) {
  const PartExplanation e = Session(common)->explain_part(part);
  if (common.json) {
    print_json(recording::values_json(arguments_of<requests::ExplainPartResponse>(e)), 2);
    return 0;
  }
  std::printf("At %.3f s (step %llu): %s\n", e.time, static_cast<unsigned long long>(e.step),
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
