// What a program looks at is that of the whole state, field by field; what it does not look at is not read.
#include "server/headless/program_view.h"

#include <gtest/gtest.h>

#include "server/headless/in_process_controller.h"
#include "server/messages/instant_messages.h"
#include "server/scenario/scenario_builder.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

using controller::part_of;
using controller::StatePart;

Simulation block_cell(int level) {
  ScenarioOptions options;
  options.level_of_detail = level;
  return Simulation(load_cell(std::string(TAKT_CONFIG_DIR) + "/scenarios/block_assembly.yaml", options));
}

/// Reads each field of each element alone, at an instant at which nothing else has been read.
template <typename Element>
void expect_equal_fields(const Simulation& simulation, std::string_view list,
                         const std::vector<Element>& whole,
                         std::vector<Element> takt_msgs::msg::CellState::*member) {
  for (std::size_t i = 0; i < whole.size(); ++i) {
    for (const FieldInfo& asked : message_info<Element>().fields) {
      ProgramView view(simulation);
      for (int k = 0; k < 2; ++k) view.look_at(simulation);
      const Element& seen = (view.read(part_of(list, asked.name), i).*member)[i];
      for_each_field(seen, [&](const FieldInfo& field, const auto& value) {
        if (field.name != asked.name) return;
        for_each_field(whole[i], [&](const FieldInfo& other, const auto& expected) {
          if constexpr (std::is_same_v<decltype(value), decltype(expected)>) {
            if (other.name == field.name) {
              EXPECT_EQ(value, expected) << list << ' ' << i << ' ' << field.name;
            }
          }
        });
      });
    }
  }
}

TEST(ProgramView, EachFieldIsThatOfTheWholeState) {
  for (const int level : {1, 2}) {
    Simulation simulation = block_cell(level);
    for (int i = 0; i < 5; ++i) ASSERT_TRUE(simulation.step({}));
    takt_msgs::msg::CellState whole = make_state_message(simulation.description());
    fill(whole, simulation.description(), simulation.make_snapshot());
    using State = takt_msgs::msg::CellState;
    expect_equal_fields(simulation, "components", whole.components, &State::components);
    expect_equal_fields(simulation, "robots", whole.robots, &State::robots);
    expect_equal_fields(simulation, "grippers", whole.grippers, &State::grippers);
    expect_equal_fields(simulation, "applied", whole.applied, &State::applied);
    ProgramView view(simulation);
    view.look_at(simulation);
    EXPECT_EQ(view.read(StatePart::instant, 0).state_hash, whole.state_hash);
    EXPECT_EQ(view.read(StatePart::all, 0), whole);
  }
}

TEST(ProgramView, TheNextInstantIsReadAgain) {
  Simulation simulation = block_cell(1);
  ProgramView view(simulation);
  for (int i = 0; i < 3; ++i) {
    view.look_at(simulation);
    const auto part = static_cast<std::size_t>(simulation.description().find_component("P"));
    EXPECT_EQ(view.read(StatePart::component, part).components[part].position.z,
              simulation.make_snapshot().components[part].p_WB.z());
    EXPECT_EQ(view.read(StatePart::instant, 0).step, simulation.step_index());
    ASSERT_TRUE(simulation.step({}));
  }
  EXPECT_EQ(view.whole_reads(), 0U);
}

std::uint64_t whole_reads_of(const std::string& look) {
  const test::TemporaryDirectory directory;
  directory.write("look.lua",
                  "routine('Robot1', function(r) for i = 1, 3 do " + look + " r:wait(0.008) end end)\n");
  Simulation simulation = block_cell(1);
  InProcessController controller((directory / "look.lua").string(), simulation);
  for (int i = 0; i < 40; ++i) EXPECT_TRUE(simulation.step(controller.commands(simulation)));
  EXPECT_TRUE(controller.finished());
  return controller.whole_reads();
}

TEST(ProgramView, AProgramReadsForcesOnlyWhereItLooksAtThem) {
  EXPECT_EQ(whole_reads_of(""), 0U);
  EXPECT_EQ(whole_reads_of("local z = cell.components.P.position.z + cell.time + #cell.components"), 0U);
  EXPECT_EQ(whole_reads_of("local z = cell.components.P.pose, cell.robots.Robot1.tcp"), 0U);
  EXPECT_EQ(whole_reads_of("local f = cell.components.P.force.z + cell.components.C.torque.x"), 3U);
}

TEST(ProgramView, TheLoadsOfAnInstantAreThoseOfItsSnapshot) {
  Simulation simulation = block_cell(2);
  Snapshot loads = simulation.make_snapshot();
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(simulation.step({}));
  const Snapshot whole = simulation.make_snapshot();
  simulation.read_loads(loads);
  EXPECT_EQ(loads.step, whole.step);
  EXPECT_EQ(loads.state_hash, whole.state_hash);
  for (std::size_t i = 0; i < whole.components.size(); ++i) {
    EXPECT_EQ(loads.components[i].partner, whole.components[i].partner);
    if (whole.components[i].partner < 0) continue;
    EXPECT_EQ(loads.components[i].F_Bo_W.f, whole.components[i].F_Bo_W.f);
    EXPECT_EQ(loads.components[i].F_Bo_W.t, whole.components[i].F_Bo_W.t);
  }
  for (std::size_t i = 0; i < whole.robots.size(); ++i) {
    EXPECT_EQ(loads.robots[i].velocity, whole.robots[i].velocity);
    EXPECT_EQ(loads.robots[i].effort, whole.robots[i].effort);
    EXPECT_EQ(loads.robots[i].flange_load_W.f, whole.robots[i].flange_load_W.f);
    EXPECT_EQ(loads.robots[i].power.electrical_energy_J, whole.robots[i].power.electrical_energy_J);
  }
}

}  // namespace
}  // namespace takt
