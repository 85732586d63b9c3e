// The section `contact` of a scenario: the cell gets its values, and each wrong value is refused with its
// key, the value found and the values allowed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "server/scenario/scenario_builder.h"
#include "server/scenario/scenario_reader.h"
#include "tests/support/kept_scenarios.h"

namespace takt {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const std::filesystem::path kDropFile =
    std::filesystem::path(TAKT_CONFIG_DIR) / "scenarios" / "contact" / "drop.yaml";

Scenario with(const std::vector<std::string>& overrides) {
  ScenarioOptions options;
  options.overrides = overrides;
  std::ifstream file(kDropFile);
  const std::string text(std::istreambuf_iterator<char>(file), {});
  try {
    Scenario scenario = read_scenario(kDropFile, options);
    test::keep_scenario(text, overrides, "");
    return scenario;
  } catch (const ScenarioError& error) {
    test::keep_scenario(text, overrides, error.what());
    throw;
  }
}
std::string error(const std::vector<std::string>& overrides) {
  try {
    (void)with(overrides);
  } catch (const ScenarioError& e) {
    return e.what();
  }
  return {};
}

TEST(ContactSection, SleepingIsReadAndReachesTheCell) {
  const auto cell_with = [](const char* method) {
    return build_cell(with(
        {std::string("sleeping={method: ") + method + ", speed_m_per_s: 2.5e-6, time_to_sleep_s: 0.125}"}));
  };
  const auto threshold = cell_with("threshold"), exact = cell_with("exact"), never = cell_with("never");
  EXPECT_TRUE(threshold->contact.sleeping.enabled && threshold->interaction.exact_sleeping);
  EXPECT_FALSE(exact->contact.sleeping.enabled);
  EXPECT_TRUE(exact->interaction.exact_sleeping);
  EXPECT_FALSE(never->contact.sleeping.enabled || never->interaction.exact_sleeping);
  EXPECT_EQ(threshold->contact.sleeping.speed_m_per_s, 2.5e-6);
  EXPECT_EQ(threshold->contact.sleeping.time_to_sleep_s, 0.125);
  EXPECT_TRUE(build_cell(with({}))->contact.sleeping.enabled);
}

TEST(ContactSection, LaterPairsAddToEarlierOnes) {
  const Scenario scenario =
      with({"contact.pairs=[{pair: [\"*\", \"*\"], friction: 0.3, friction_law: stick}, {pair: [\"*\", "
            "\"*\"], friction: 0.7, force: holding_spring}]"});
  ASSERT_EQ(scenario.contact.pairs.size(), 2U);
  using P = ContactParameters;
  EXPECT_EQ(scenario.contact.pairs[0].stated.value(&P::friction), 0.3);
  EXPECT_EQ(scenario.contact.pairs[0].stated.value(&P::friction_law), FrictionLaw::stick);
  EXPECT_FALSE(scenario.contact.pairs[0].force.has_value());
  EXPECT_EQ(scenario.contact.pairs[1].stated.value(&P::friction), 0.7);
  EXPECT_FALSE(scenario.contact.pairs[1].stated.value(&P::friction_law).has_value());
  EXPECT_EQ(scenario.contact.pairs[1].force, PairForce::substitute);
}

TEST(ContactSection, DepthsAreChosenByDefaultsComponentsAndPairs) {
  const auto all = build_cell(with({}));
  EXPECT_TRUE(all->contact.fields.empty());
  for (const ContactPairModel& pair : all->contact.pairs) EXPECT_EQ(pair.depth, DepthSource::polygonal);

  const auto cell = build_cell(
      with({"contact.components={Sphere: {depth: distance_field}}",
            "contact.pairs=[{pair: [Box, Plate], depth: pressure_field}]", "contact.field_spacing_m=0.004"}));
  const auto id = [&](const char* name) { return cell->description.find_component(name); };
  int fields = 0;
  for (const ContactPairModel& pair : cell->contact.pairs) {
    const bool sphere = pair.base == id("Sphere") || pair.target == id("Sphere");
    EXPECT_EQ(pair.depth, sphere ? DepthSource::distance_field : DepthSource::pressure_field);
    const auto target = static_cast<std::size_t>(pair.target);
    ASSERT_NE(cell->contact.fields.at(target), nullptr);
    EXPECT_EQ(cell->contact.fields[target]->spacing_m(), 0.004);
    EXPECT_EQ(cell->contact.field(pair.target, pair.depth), cell->contact.fields[target]);
  }
  for (const auto& field : cell->contact.fields) fields += field != nullptr ? 1 : 0;
  std::vector<std::string> notes;
  for (const ImportNote& note : cell->import_notes)
    if (note.sentence.find("distance field") != std::string::npos) notes.push_back(note.sentence);
  EXPECT_EQ(notes.size(), static_cast<std::size_t>(fields));
  EXPECT_THAT(notes,
              ::testing::Each(AllOf(HasSubstr("nodes every 4 mm"), HasSubstr(" MB"), HasSubstr("at most"))));
}

TEST(ContactSection, LayersOfAPressureFieldAreThoseOfBothSides) {
  const auto cell =
      build_cell(with({"contact.defaults={depth: pressure_field}",
                       "contact.components={Plate: {youngs_modulus_Pa: 4.0e+5, layer_depth_m: 0.002}, "
                       "Sphere: {youngs_modulus_Pa: 3.0e+6}}"}));
  const double plate = layer_modulus(4e5, 0.3) / 0.002, sphere = layer_modulus(3e6, 0.3) / 0.001,
               box = layer_modulus(1e6, 0.3) / 0.001;
  const auto id = [&](const char* name) { return cell->description.find_component(name); };
  const auto layer = [&](int component) {
    return component == id("Plate") ? plate : component == id("Sphere") ? sphere : box;
  };
  for (const ContactPairModel& pair : cell->contact.pairs) {
    const double base = layer(pair.base), target = layer(pair.target), both = base * target / (base + target);
    EXPECT_NEAR(pair.law.stiffness_Pa_per_m, both, 1e-9 * both);
    EXPECT_NEAR(pair.law.tangential_stiffness_Pa_per_m, 0.8 * both, 1e-9 * both);
  }
}

TEST(ContactSection, AFieldThatDoesNotResolveItsBodySaysSo) {
  const auto notes = [](const std::vector<std::string>& overrides) {
    std::string all;
    for (const ImportNote& note : build_cell(with(overrides))->import_notes) all += note.sentence + "\n";
    return all;
  };
  EXPECT_THAT(notes({"contact.defaults={depth: distance_field}",
                     "contact.components={Plate: {field_spacing_m: 0.02}}"}),
              AllOf(HasSubstr("does not resolve"), HasSubstr("contact.components.Plate.field_spacing_m")));
  EXPECT_THAT(notes({"contact.defaults={depth: distance_field}"}),
              ::testing::Not(HasSubstr("does not resolve")));
  EXPECT_THAT(error({"contact.field_spacing_m=0"}), HasSubstr("field_spacing_m"));
  EXPECT_THAT(error({"contact.defaults={depth: voxels}"}),
              AllOf(HasSubstr("voxels"), HasSubstr("distance_field")));
  EXPECT_THROW(
      build_cell(with({"contact.defaults={depth: distance_field}", "contact.field_spacing_m=1.0e-7"})),
      ScenarioError);
}

TEST(ContactSection, EveryInvalidValueIsNamed) {
  struct Case {
    const char *override_text, *key, *found, *allowed;
  };
  const Case cases[] = {
      {"sleeping.speed_m_per_s=0", "sleeping.speed_m_per_s", "0", "m/s"},
      {"sleeping.speed_m_per_s=fast", "sleeping.speed_m_per_s", "fast", "number"},
      {"sleeping.time_to_sleep_s=-1", "sleeping.time_to_sleep_s", "-1", "s"},
      {"sleeping.method=perhaps", "sleeping.method", "perhaps", "threshold, exact, never"},
      {"sleeping.depth=1", "depth", "", "speed_m_per_s"},
      {"contact.defaults.youngs_modulus_Pa=0", "contact.defaults.youngs_modulus_Pa", "0", "Pa"},
      {"contact.defaults.poisson_ratio=0.5", "contact.defaults.poisson_ratio", "0.5", "0.499"},
      {"contact.defaults.friction=-0.1", "contact.defaults.friction", "-0.1", "0"},
      {"contact.defaults.friction=.nan", "contact.defaults.friction", "nan", ""},
      {"contact.defaults.friction_law=glue", "contact.defaults.friction_law", "glue", "stick"},
      {"contact.grippers.layer_depth_m=0", "contact.grippers.layer_depth_m", "0", "m"},
      {"contact.element_edge_m=-1e-3", "contact.element_edge_m", "-", "m"},
      {"contact.cache_unmoved_pairs=2", "contact.cache_unmoved_pairs", "2", "true"},
      {"contact.pairs=none", "contact.pairs", "none", "list"},
      {"contact.pairs=[{pair: [A]}]", "pair", "", "two names"},
      {"contact.pairs=[{pair: [A, B], force: magic}]", "force", "magic", "holding_spring"},
      {"contact.pairs=[{pair: [A, B], base: C}]", "base", "C", "one of the two names"},
      {"contact.pairs=[{pair: [A, B], colour: red}]", "colour", "", "friction"},
      {"contact.thickness=1", "thickness", "", "element_edge_m"},
  };
  for (const Case& wrong : cases) {
    EXPECT_THAT(error({wrong.override_text}),
                AllOf(HasSubstr(wrong.key), HasSubstr(wrong.found), HasSubstr(wrong.allowed)))
        << wrong.override_text;
  }
}

}  // namespace
}  // namespace takt
