#include "server/scenario/scenario_writer.h"

#include "server/fields/fields.h"

namespace takt {

namespace {

/// Puts lists and small mappings of values on one line. True if the node is on one line.
bool choose_style(YAML::Node node) {
  if (node.IsScalar() || node.IsNull()) return true;
  bool flat = node.IsSequence() || node.size() <= 4;
  for (const auto& entry : node) {
    const YAML::Node& child = node.IsMap() ? entry.second : static_cast<const YAML::Node&>(entry);
    flat = choose_style(child) && flat && !child.IsMap();
  }
  node.SetStyle(flat ? YAML::EmitterStyle::Flow : YAML::EmitterStyle::Block);
  return flat;
}

}  // namespace

std::string write_scenario(const Scenario& scenario, const std::filesystem::path& directory) {
  Fields f(directory);
  f.note_defaults([&] {
    Scenario usual;
    describe(f, usual);
  });
  Scenario written = scenario;
  describe(f, written);
  const YAML::Node root = f.take_written();
  choose_style(root);
  YAML::Emitter out;
  out << root;
  return std::string(out.c_str()) + "\n";
}

KeyInfo scenario_info() {
  Fields f;
  Scenario usual;
  describe(f, usual);
  return f.take_info();
}

}  // namespace takt
