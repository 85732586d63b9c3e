#include "server/simulation/step/explanation.h"

#include <algorithm>
#include <cstdio>
#include <span>
#include <utility>

#include "idl/common/text.h"
#include "plant_models/state_bytes.h"
#include "server/simulation/step/grasping.h"

namespace takt {

void PartnerHistory::reset() {
  std::fill(entries_.begin(), entries_.end(), Entry{});
  newest_stage_ = 0;
  newest_s_ = 0.0;
}

void PartnerHistory::note(double time_s, std::uint64_t step, std::span<const PartnerChange> changes) {
  ++newest_stage_;
  newest_s_ = time_s;
  for (const PartnerChange& change : changes) {
    entries_[static_cast<std::size_t>(change.part)] = {time_s, step, change.from, newest_stage_};
  }
}

void PartnerHistory::save(StateWriter& out) const {
  out.put(newest_stage_), out.put(newest_s_);
  for (const Entry& entry : entries_)
    out.put(entry.time_s), out.put(entry.step), out.put(entry.before), out.put(entry.stage);
}

void PartnerHistory::load(StateReader& in) {
  newest_stage_ = in.get<std::uint64_t>();
  newest_s_ = in.number("a time");
  for (Entry& entry : entries_) {
    entry.time_s = in.number("a time");
    entry.step = in.get<std::uint64_t>();
    entry.before = in.index(entries_.size(), "a partner before");
    entry.stage = in.get<std::uint64_t>();
  }
}

namespace {

/// Component that decides the result of part_state().
int reason_of_state(const std::vector<Component>& components, const ContactGraph& graph, int component,
                    int partner, PartState state) {
  if (state == PartState::grasped || state == PartState::placed) return partner;
  if (state != PartState::assembled) return -1;
  const int hierarchy = components[static_cast<std::size_t>(component)].hierarchy;
  for (const int other : graph.neighbours[static_cast<std::size_t>(component)]) {
    const Component& c = components[static_cast<std::size_t>(other)];
    if (c.type == ComponentType::part && c.hierarchy != hierarchy) return other;
  }
  return -1;
}

void list_contacts(const ComponentInteraction& interaction, Explanation& e) {
  std::vector<std::pair<int, int>> pairs;
  if (e.decision.partner >= 0 && !e.sequences.sequences.empty()) {
    const std::vector<int>& sequence = e.sequences.sequences.front();
    for (std::size_t i = 1; i < sequence.size(); ++i) pairs.emplace_back(sequence[i - 1], sequence[i]);
  }
  const auto first = pairs.empty() ? std::pair(-1, -1) : pairs.front();
  for (const int other : interaction.graph().neighbours[static_cast<std::size_t>(e.component)]) {
    if (std::pair(e.component, other) != first) pairs.emplace_back(e.component, other);
  }
  e.contact_count = pairs.size();
  pairs.resize(std::min(pairs.size(), Explanation::kMaxContacts));
  int budget = Explanation::kMaxDistances;
  for (const auto& [a, b] : pairs) {
    e.contacts.push_back({a, b, contact_depth(interaction.collision_world(), a, b, budget)});
  }
}

PartnerDecision decide(const ComponentInteraction& interaction, int component, int partner,
                       const PartnerHistory& history) {
  if (interaction.attached_to(component) != -1) return {partner, PartnerRule::attached, 1, -1, 0};
  if (interaction.algorithm() == InteractionAlgorithm::partner_search)
    return decide_partner(interaction.graph(), component, history.before_newest(component, partner));
  PartnerDecision decision;
  decision.partner = partner;
  if (partner < 0) return decision;
  decision.rule = interaction.algorithm() == InteractionAlgorithm::substitute_force
                      ? PartnerRule::every_contact
                      : PartnerRule::one_support;
  decision.contacts = 1;
  return decision;
}

}  // namespace

Explanation explain_component(const std::vector<Component>& components,
                              const ComponentInteraction& interaction, const CellMotion& motion,
                              const PartnerHistory& history, int component) {
  const auto index = static_cast<std::size_t>(component);
  const int partner = interaction.partner(component);
  Explanation e;
  e.component = component;
  e.type = components[index].type;
  e.decided_at_s = history.newest_s();
  e.since = history.of(component);
  e.state = part_state(components, interaction.graph(), component, partner);
  e.state_because = reason_of_state(components, interaction.graph(), component, partner, e.state);
  if (e.type == ComponentType::part) {
    e.decision = decide(interaction, component, partner, history);
    e.sequences = list_sequences(interaction.graph(), component, partner, {});
  }
  for (const PairConnection& pair : interaction.connections_of(component)) {
    e.connections.push_back({pair.connection.partner, interaction.pair_wrench(pair, motion),
                             pair.connection.feed_forward_W, pair.connection.softening});
  }
  for (std::size_t i = 0; i < components.size(); ++i) {
    if (interaction.partner(static_cast<int>(i)) != component) continue;
    if (++e.held_count <= Explanation::kMaxHeld) e.held.push_back(static_cast<int>(i));
  }
  list_contacts(interaction, e);
  return e;
}

namespace {

std::string seconds(double t) {
  return fixed_text(t, 3) + " s";
}

std::string counted(std::uint64_t n, const char* one, const char* many) {
  return std::to_string(n) + " " + (n == 1 ? one : many);
}

std::string with_article(ComponentType type) {
  return type == ComponentType::part ? "a Part" : type == ComponentType::gripper ? "a Gripper" : "a Ground";
}

class Sentences {
 public:
  Sentences(const Explanation& e, const CellDescription& cell) : e_(e), cell_(cell) {}

  std::string fixed() const {
    std::string text =
        name(e_.component) + " is " + with_article(e_.type) + "; what holds Parts is not held. ";
    if (e_.held_count == 0) return text + "It holds no Part.";
    text += "It holds ";
    const std::size_t listed = std::min<std::size_t>(e_.held.size(), 5);
    text += join(std::span(e_.held).first(listed), ", ", [this](int part) { return name(part); });
    if (e_.held_count > listed) text += " and " + std::to_string(e_.held_count - listed) + " more";
    return text + ".";
  }

  /// Empty where surface contact does not act.
  std::string pressing() const {
    if (!e_.surface_contact) return {};
    std::string text = " At level of detail 3 ";
    if (e_.pressing.empty()) return text + "nothing presses upon it now.";
    const std::size_t listed = std::min<std::size_t>(e_.pressing.size(), 5);
    for (std::size_t i = 0; i < listed; ++i) {
      const ContactSample& pair = e_.pressing[i];
      char force[32];
      std::snprintf(force, sizeof(force), " (%.4g N)", pair.result.normal_force_N);
      text += (i == 0 ? "" : ", ") + name(pair.base == e_.component ? pair.target : pair.base) + force;
    }
    if (e_.pressing.size() > listed) text += " and " + std::to_string(e_.pressing.size() - listed) + " more";
    text += e_.pressing.size() == 1 ? " presses upon it." : " press upon it.";
    if (e_.type != ComponentType::part || e_.decision.partner < 0) return text;
    if (type(e_.decision.partner) == ComponentType::gripper)
      text +=
          " A Gripper counts as the holder of Parts in contact while its command is to hold and both its "
          "jaws are"
          " pressed upon; these forces alone carry the Part.";
    else
      text += " These forces alone carry it; the partner is the end of the sequence of contacts.";
    return text;
  }

  std::string part() const {
    std::string text = name(e_.component) + " is " + std::string(to_string(e_.state)) + ": " + state() + ". ";
    const std::string time =
        e_.since.step == 0 && e_.since.before < 0
            ? "since the start"
            : "since " + seconds(e_.since.time_s) + " (step " + std::to_string(e_.since.step) +
                  ", before: " + (e_.since.before < 0 ? "nothing" : name(e_.since.before)) + ")";
    if (e_.decision.partner < 0) return text + "Nothing holds it " + time + ": " + rule() + ".";
    return text + name(e_.decision.partner) + " holds it " + time + ": " + rule() + ".";
  }

 private:
  const std::string& name(int component) const {
    return cell_.components[static_cast<std::size_t>(component)].name;
  }
  ComponentType type(int component) const {
    return cell_.components[static_cast<std::size_t>(component)].type;
  }

  std::string state() const {
    switch (e_.state) {
      case PartState::grasped:
        return "the Gripper " + name(e_.state_because) + " holds it";
      case PartState::assembled:
        return "it touches the Part " + name(e_.state_because) +
               " of another hierarchy, and no Gripper holds it";
      case PartState::placed:
        return "the Ground " + name(e_.state_because) +
               " holds it, and it touches no Part of another hierarchy";
      case PartState::parked:
        return "it is parked, outside of the cell, until a source brings it in";
      case PartState::free:
      case PartState::fixed:
        break;
    }
    return "neither a Gripper nor a Ground holds it, and it touches no Part of another hierarchy";
  }

  std::string rule() const {
    const PartnerDecision& d = e_.decision;
    const std::string all = "of " + counted(e_.sequences.count, "sequence", "sequences") + " of contacts ";
    const auto away = [](int contacts) {
      return counted(static_cast<std::uint64_t>(contacts), "contact", "contacts");
    };
    switch (d.rule) {
      case PartnerRule::nothing_reachable:
        return "no contact leads from it to a Gripper, a Ground or a Part of higher hierarchy";
      case PartnerRule::only_end:
        return e_.sequences.count == 1
                   ? "the only sequence of contacts (" + away(d.contacts) + ") ends there"
                   : "all " + counted(e_.sequences.count, "sequence", "sequences") + " of contacts end there";
      case PartnerRule::end_type:
        return all + "one that ends in " + with_article(type(d.partner)) +
               " comes before those that end in " + with_article(type(d.rival)) + " (" + name(d.rival) + ")";
      case PartnerRule::shorter_sequence:
        return all + "the shortest ends there (" + away(d.contacts) + "); " + name(d.rival) +
               ", of the same type, is " + away(d.rival_contacts) + " away";
      case PartnerRule::present_partner:
        return all + "one to " + name(d.rival) + " is as good (" + away(d.contacts) +
               "), and then the present partner stays";
      case PartnerRule::every_contact:
        return "the algorithm substitute_force connects all that touches (" +
               counted(e_.connections.size(), "connection", "connections") +
               " with it as Base), and this one carries it";
      case PartnerRule::one_support:
        return "the algorithm extended_substitute_force holds a Part by its Gripper, else by its Ground, "
               "else by the Parts it touches (" +
               counted(e_.connections.size(), "connection", "connections") + " with it as Base)";
      case PartnerRule::attached:
        return "the Part was attached on request, whatever it touches, until it is detached";
      case PartnerRule::lower_id:
        break;
    }
    return all + "one to " + name(d.rival) + " is as good (" + away(d.contacts) +
           "), neither was the partner before, and then the first in the description of the cell is taken";
  }

  const Explanation& e_;
  const CellDescription& cell_;
};

}  // namespace

std::string describe(const Explanation& explanation, const CellDescription& cell) {
  const Sentences sentences(explanation, cell);
  return (explanation.type == ComponentType::part ? sentences.part() : sentences.fixed()) +
         sentences.pressing();
}

}  // namespace takt
