#include "server/scenario/wires.h"

#include <algorithm>
#include <charconv>
#include <sstream>

namespace takt {

void WireRule::read(const FieldValue& value, std::vector<ScenarioWire>& wires) {
  if (value.node.IsNull()) return;
  if (!value.node.IsMap()) value.fail(describe_node(value.node), allowed());
  for (const auto& entry : value.node) {
    if (!entry.first.IsScalar()) value.fail(describe_node(entry.first), "the name of an input");
    const std::string to = entry.first.Scalar();
    const FieldValue at{value.source, entry.second, value.path + "." + to};
    ScenarioWire& wire = wires.emplace_back();
    wire.to = to;
    wire.place = at.place();
    Text::read(at, wire.text);
  }
}

YAML::Node WireRule::write(const std::vector<ScenarioWire>& wires) {
  YAML::Node result(YAML::NodeType::Map);
  for (const ScenarioWire& wire : wires) result[wire.to] = wire.text;
  return result;
}

KeyInfo WireRule::info() {
  KeyInfo any = Text::info();
  any.key = "*";
  any.doc =
      "SIGNAL, not SIGNAL, SIGNAL > NUMBER, SIGNAL < NUMBER, NUMBER * SIGNAL, or NUMBER * SIGNAL + NUMBER; "
      "names are "
      "NAME.SIGNAL.";
  return {.kind = KeyInfo::Kind::section, .items = {any}};
}

namespace {

[[noreturn]] void fail(const ScenarioWire& wire, const std::string& found, const std::string& allowed) {
  throw ScenarioError(wire.place + ": found " + found + "; allowed: " + allowed);
}

std::optional<double> number_of(const std::string& word) {
  double number = 0.0;
  const char* end = word.data() + word.size();
  const auto [rest, error] = std::from_chars(word.data(), end, number);
  return error == std::errc() && rest == end ? std::optional(number) : std::nullopt;
}

/// The words of the text. Returns the name of the source.
std::string parse(const ScenarioWire& stated, SignalWire& wire) {
  constexpr const char* kForms =
      "SIGNAL, not SIGNAL, SIGNAL > NUMBER, SIGNAL < NUMBER, NUMBER * SIGNAL, or NUMBER * SIGNAL + NUMBER, "
      "with spaces";
  std::istringstream text(stated.text);
  std::vector<std::string> words;
  for (std::string word; text >> word;) words.push_back(word);
  if (words.size() > 1 && words.front() == "not") {
    wire.invert = true;
    words.erase(words.begin());
  }
  if (words.size() == 1) return words[0];
  if (words.size() == 5 && !wire.invert && words[1] == "*" && words[3] == "+") {
    const auto offset = number_of(words[4]);
    if (!offset) fail(stated, "'" + words[4] + "'", "a number after +");
    wire.offset = *offset;
    words.resize(3);
  }
  if (words.size() != 3) fail(stated, "'" + stated.text + "'", kForms);
  if (words[1] == "*" && !wire.invert) {
    const auto factor = number_of(words[0]);
    if (!factor) fail(stated, "'" + words[0] + "'", "a number before *");
    wire.factor = *factor;
    return words[2];
  }
  if (words[1] != ">" && words[1] != "<") fail(stated, "'" + stated.text + "'", kForms);
  const auto threshold = number_of(words[2]);
  if (!threshold) fail(stated, "'" + words[2] + "'", "a number after " + words[1]);
  wire.test = words[1] == ">" ? SignalWire::Test::above : SignalWire::Test::below;
  wire.threshold = *threshold;
  return words[0];
}

SignalRef signal_of(const ScenarioWire& wire, const std::string& name, const CellDescription& cell) {
  const auto found = find_signal(cell, name);
  if (!found) fail(wire, "'" + name + "'", signals_there(cell, name));
  return *found;
}

void check_types(const ScenarioWire& stated, const SignalWire& wire, const CellDescription& cell) {
  const SignalType from = describe_signal(cell, wire.from).type, to = describe_signal(cell, wire.to).type;
  const bool tested = wire.test != SignalWire::Test::none;
  const std::string source = signal_name(cell, wire.from);
  if (tested && from == SignalType::boolean)
    fail(stated, "'" + stated.text + "'", source + " or not " + source + ", which is boolean");
  if (wire.invert && !tested && from != SignalType::boolean)
    fail(stated, "'" + stated.text + "'", "not with a boolean signal, or with a comparison");
  const SignalType value = tested                                     ? SignalType::boolean
                           : wire.factor != 1.0 || wire.offset != 0.0 ? SignalType::real
                                                                      : from;
  if (to == SignalType::boolean && value != SignalType::boolean)
    fail(stated, "'" + stated.text + "', a number",
         "a boolean signal, or a comparison, for the boolean " + stated.to);
  if (to == SignalType::integer && value == SignalType::real)
    fail(stated, "'" + stated.text + "', a real number", "whole numbers for " + stated.to);
}

}  // namespace

void add_wires(const std::vector<ScenarioWire>& stated, CellDescription& cell) {
  std::vector<SignalWire> wires;
  for (const ScenarioWire& one : stated) {
    SignalWire& wire = wires.emplace_back();
    wire.text = one.text;
    wire.to = signal_of(one, one.to, cell);
    wire.from = signal_of(one, parse(one, wire), cell);
    if (!describe_signal(cell, wire.to).commanded)
      fail(one, "'" + one.to + "', which can only be read", "an input, i.e. a signal that can be commanded");
    check_types(one, wire, cell);
    for (std::size_t i = 0; i + 1 < wires.size(); ++i) {
      if (wires[i].to == wire.to) fail(one, "'" + one.to + "' again", "one wire for each input");
      if (wires[i].to.device == wire.to.device &&
          signal_owner(cell, wire.to.device).kind == SignalOwnerKind::gripper)
        fail(one, "'" + one.to + "' besides '" + stated[i].to + "'", "one wired input for each gripper");
    }
  }
  // A wire is ready when no wire that is left drives its source.
  std::vector<std::size_t> left(wires.size());
  for (std::size_t i = 0; i < left.size(); ++i) left[i] = i;
  while (!left.empty()) {
    const auto ready = std::find_if(left.begin(), left.end(), [&](std::size_t i) {
      return std::none_of(left.begin(), left.end(),
                          [&](std::size_t k) { return wires[k].to == wires[i].from; });
    });
    if (ready == left.end()) {
      std::string circle;
      for (const std::size_t i : left) circle += (circle.empty() ? "" : ", ") + stated[i].to;
      fail(stated[left.front()], "wires that drive each other in a circle (" + circle + ")",
           "inputs that follow reported signals in the end");
    }
    cell.wires.push_back(wires[*ready]);
    left.erase(ready);
  }
}

}  // namespace takt
