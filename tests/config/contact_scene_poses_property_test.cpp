// The result of a contact pair of the scene library depends on pose and twist alone, and is finite for any
// poses.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <random>
#include <string>

#include "server/contact/surface/polygonal_contact.h"
#include "server/scenario/scenario_builder.h"
#include "tests/support/effort.h"

namespace takt {
namespace {

namespace fs = std::filesystem;

Vec3 random_vector(std::mt19937_64& random, double size) {
  std::uniform_real_distribution<double> uniform(-size, size);
  const double x = uniform(random), y = uniform(random), z = uniform(random);
  return {x, y, z};
}

Mat3 random_turn(std::mt19937_64& random, double angle_rad) {
  return Eigen::AngleAxisd(angle_rad, random_vector(random, 1.0).normalized()).toRotationMatrix();
}

TEST(ContactScenePoses, EarlierQueriesChangeNoBit) {
  std::mt19937_64 random(5);
  for (const auto& entry : fs::directory_iterator(fs::path(TAKT_CONFIG_DIR) / "scenarios" / "contact")) {
    // Others have the same shapes; making lists for the bolt takes a second.
    const std::string name = entry.path().stem().string();
    if (name != "hook_and_ring" && name != "drop" && name != "peg_in_hole_10um" && name != "sliding_block")
      continue;
    SCOPED_TRACE(entry.path());
    const auto cell = build_cell(read_scenario(entry.path()));
    std::vector<Pose> X_WB(cell->components.size());
    for (const GroundModel& ground : cell->grounds)
      X_WB[static_cast<std::size_t>(ground.component)] = ground.X_WB;
    for (const RigidBodyParameters& part : cell->parts)
      X_WB[static_cast<std::size_t>(part.body)] = part.X_WB_initial;
    for (const ContactPairModel& pair : cell->contact.pairs) {
      const auto base = static_cast<std::size_t>(pair.base), target = static_cast<std::size_t>(pair.target);
      if (cell->components[base].type == ComponentType::gripper ||
          cell->components[target].type == ComponentType::gripper)
        continue;
      PolygonalContact kept(cell->contact.surfaces[base], cell->contact.surfaces[target], pair.law,
                            cell->contact.field(pair.target, pair.depth));
      const Pose start = X_WB[target].inverse() * X_WB[base];
      RelativeMotion m{start, {}};
      ContactResult of_kept, of_new;
      // Mostly less than the bound of the candidate lists, so that they are used at many poses.
      const int poses = 200 * static_cast<int>(test::effort());
      for (int i = 0; i < poses; ++i) {
        const double size = std::pow(10.0, std::uniform_real_distribution<double>(-6.0, -3.0)(random));
        if (i % 20 == 0) m.X_TB = start;
        m.X_TB.p += random_vector(random, size);
        m.X_TB.R = random_turn(random, 5.0 * size) * m.X_TB.R;
        m.V_TB_T = {random_vector(random, 0.1), random_vector(random, 1.0)};
        kept.evaluate(m, of_kept);
        PolygonalContact fresh(cell->contact.surfaces[base], cell->contact.surfaces[target], pair.law,
                               cell->contact.field(pair.target, pair.depth));
        fresh.evaluate(m, of_new);
        ASSERT_EQ(of_kept.elements, of_new.elements) << i << " moved by " << size;
        ASSERT_TRUE(of_kept.F_B_T.f == of_new.F_B_T.f && of_kept.F_B_T.t == of_new.F_B_T.t) << i;
      }
    }
  }
}

}  // namespace
}  // namespace takt
