// Collision checking reaches clients as events.
#include <gtest/gtest.h>

#include "tests/support/dds_service.h"

namespace takt {
namespace {

std::shared_ptr<CellModel> checked_model() {
  // Table9 stands in the forearm of Robot1 as it is at the start.
  const auto file = test::write_service_scenario();
  std::ofstream(file, std::ios::app)
      << "collision_checking:\n"
         "  limits: [{pair: [Robot2/forearm_link, Table1], min_clearance_m: 2.0}]\n"
         "  ignore: [['Robot1/*', 'Robot1/*'], ['Robot2/*', 'Robot2/*']]\n";
  ScenarioOptions options;
  options.overrides = {"grounds.Table9={mesh: " + std::string(TAKT_CONFIG_DIR) +
                       "/meshes/table.obj, convex: objects, pose: {position_m: [-0.75, 0, 1.5]}}"};
  auto model = std::make_shared<CellModel>(*load_cell(file, options));
  std::filesystem::remove(file);
  return model;
}

TEST(CollisionEvents, EventsHavePairDepthPositionAndTime) {
  RunLoopOptions options;
  options.pace = Pace::free;
  options.state = SimulationState::paused;
  const auto model = checked_model();
  // The same cell by itself, for the expected events.
  Simulation alone(model);
  ASSERT_TRUE(alone.step({}));
  const std::vector<CollisionEvent> expected(alone.events().collision_events.begin(),
                                             alone.events().collision_events.end());

  test::DdsService service(options, model);
  test::RawCellClient client;
  ASSERT_EQ(client.request("step", {{"steps", "3"}}).result, 1);
  std::size_t collisions = 0, clearances = 0;
  for (const CollisionEvent& event : expected) {
    const std::string a = model->description.checked_bodies[static_cast<std::size_t>(event.a)];
    const std::string b = model->description.checked_bodies[static_cast<std::size_t>(event.b)];
    const bool overlap = event.kind == CollisionEvent::Kind::collision;
    ++(overlap ? collisions : clearances);
    char depth[80];
    std::snprintf(depth, sizeof depth, "%.3f mm%s at (%.4f, %.4f, %.4f) m", 1e3 * std::abs(event.distance_m),
                  overlap ? "" : " apart", event.p_W.x(), event.p_W.y(), event.p_W.z());
    test::msg::Event reported;
    ASSERT_TRUE(client.wait_for_event(overlap ? "collision" : "clearance", a, depth, &reported))
        << a << ' ' << b;
    EXPECT_NE(reported.message.find(a + " and " + b), std::string::npos);
    EXPECT_EQ(reported.severity, overlap ? Severity::error : Severity::warning);
    EXPECT_EQ(reported.step, 0U);
    EXPECT_EQ(reported.stamp.sec, 0);
  }
  EXPECT_GE(collisions, 1U);
  EXPECT_EQ(clearances, 1U);
  EXPECT_EQ(client.count_events("collision"), collisions) << "reported once, not in every step";
}

}  // namespace
}  // namespace takt
