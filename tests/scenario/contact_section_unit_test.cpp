// The section `contact` of a scenario: what it says is what the cell gets, and each wrong value is refused
// with its key, what was found and what is allowed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "server/scenario/scenario_builder.h"
#include "server/scenario/scenario_reader.h"

namespace takt {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const std::filesystem::path kDropFile =
    std::filesystem::path(TAKT_CONFIG_DIR) / "scenarios" / "contact" / "drop.yaml";

Scenario with(const std::vector<std::string>& overrides) {
  ScenarioOptions options;
  options.overrides = overrides;
  return read_scenario(kDropFile, options);
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
  const SleepingParameters by_default = with({}).contact.sleeping;
  const Scenario scenario =
      with({"contact.sleeping={enabled: " + std::string(by_default.enabled ? "false" : "true") +
            ", speed_m_per_s: 2.5e-6, after_s: 0.125}"});
  EXPECT_EQ(scenario.contact.sleeping.enabled, !by_default.enabled);
  const auto cell = build_cell(scenario);
  EXPECT_EQ(cell->contact.sleeping.enabled, !by_default.enabled);
  EXPECT_EQ(cell->contact.sleeping.speed_m_per_s, 2.5e-6);
  EXPECT_EQ(cell->contact.sleeping.after_s, 0.125);
}

TEST(ContactSection, LaterPairsAddToEarlierOnes) {
  const Scenario scenario =
      with({"contact.pairs=[{pair: [\"*\", \"*\"], friction: 0.3, friction_law: stick}, {pair: [\"*\", "
            "\"*\"], friction: 0.7, interaction: substitute}]"});
  ASSERT_EQ(scenario.contact.pairs.size(), 2U);
  EXPECT_EQ(scenario.contact.pairs[0].stated.friction, 0.3);
  EXPECT_EQ(scenario.contact.pairs[0].stated.friction_law, FrictionLaw::stick);
  EXPECT_FALSE(scenario.contact.pairs[0].interaction.has_value());
  EXPECT_EQ(scenario.contact.pairs[1].stated.friction, 0.7);
  EXPECT_FALSE(scenario.contact.pairs[1].stated.friction_law.has_value());
  EXPECT_EQ(scenario.contact.pairs[1].interaction, PairForce::substitute);
}

TEST(ContactSection, EveryInvalidValueIsNamed) {
  struct Case {
    const char *override_text, *key, *found, *allowed;
  };
  const Case cases[] = {
      {"contact.sleeping.speed_m_per_s=0", "contact.sleeping.speed_m_per_s", "0", "m/s"},
      {"contact.sleeping.speed_m_per_s=fast", "contact.sleeping.speed_m_per_s", "fast", "number"},
      {"contact.sleeping.after_s=-1", "contact.sleeping.after_s", "-1", "s"},
      {"contact.sleeping.enabled=perhaps", "contact.sleeping.enabled", "perhaps", "true"},
      {"contact.sleeping.depth=1", "depth", "", "speed_m_per_s"},
      {"contact.defaults.youngs_modulus_Pa=0", "contact.defaults.youngs_modulus_Pa", "0", "Pa"},
      {"contact.defaults.poisson_ratio=0.5", "contact.defaults.poisson_ratio", "0.5", "0.499"},
      {"contact.defaults.friction=-0.1", "contact.defaults.friction", "-0.1", "0"},
      {"contact.defaults.friction=.nan", "contact.defaults.friction", "nan", ""},
      {"contact.defaults.friction_law=glue", "contact.defaults.friction_law", "glue", "stick"},
      {"contact.grippers.layer_depth_m=0", "contact.grippers.layer_depth_m", "0", "m"},
      {"contact.element_edge_m=-1e-3", "contact.element_edge_m", "-", "m"},
      {"contact.optimize_calls=2", "contact.optimize_calls", "2", "true"},
      {"contact.pairs=none", "contact.pairs", "none", "list"},
      {"contact.pairs=[{pair: [A]}]", "pair", "", "two names"},
      {"contact.pairs=[{pair: [A, B], interaction: magic}]", "interaction", "magic", "substitute"},
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
