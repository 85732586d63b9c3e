#pragma once
// The plant of the block cell at LoD 2 outside a simulation, with Parts put into the grippers: for tests and
// benchmarks that need the system of equations itself.
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/scenario/scenario_builder.h"
#include "server/simulation/step/cell_plant.h"

namespace takt::test {

struct HeldPart {
  std::size_t part = 0, gripper = 0;
  Pose X_GB;  ///< in the frame of the palm
};

class BlockPlant {
 public:
  explicit BlockPlant(const std::vector<HeldPart>& held, const std::string& algorithm = "partner_search") {
    ScenarioOptions options;
    options.level_of_detail = 2;
    options.overrides = {"interaction.algorithm=" + algorithm};
    const auto loaded = load_cell(std::string(TAKT_CONFIG_DIR) + "/scenarios/block_assembly.yaml", options);
    auto edited = std::make_shared<CellModel>(*loaded);
    const ComponentInteraction nobody(loaded->components, loaded->pairs, loaded->interaction);
    CellPlant empty(*loaded, nobody, nullptr);
    empty.system().update_motion(0.0, empty.state());
    for (const HeldPart& each : held) {
      const auto palm = static_cast<std::size_t>(loaded->grippers[each.gripper].parameters.palm);
      edited->parts[each.part].X_WB_initial = empty.system().motion().bodies[palm].X_WB * each.X_GB;
    }
    model = edited;
    interaction.emplace(model->components, model->pairs, model->interaction);
    plant.emplace(*model, *interaction, nullptr);
    system().update_motion(0.0, x());
    interaction->update_poses(system().motion(), nullptr);
    std::vector<GraspState> grasps;
    for (std::size_t g = 0; g < model->grippers.size(); ++g) {
      std::vector<int> parts;
      for (const HeldPart& each : held)
        if (each.gripper == g) parts.push_back(model->parts[each.part].body);
      std::sort(parts.begin(), parts.end());
      grasps.push_back(
          {model->grippers[g].parameters.palm, parts, Vec3(-0.2, -0.2, 0.0), Vec3(0.2, 0.2, 0.4)});
    }
    interaction->update_connections(system().motion(), grasps, nullptr);
  }
  /// P, C, O and B put together, by their places on the table at the end of the scenario, in Gripper1.
  static std::vector<HeldPart> assembly() {
    const Pose X_BG{Mat3::Identity(), Vec3(0.0, 0.0, -0.15)};
    // P C O B; in B's frame, which is turned by 90 degrees at the end.
    const auto at = [&](double x, double z) {
      return X_BG.inverse() * Pose{Mat3::Identity(), Vec3(x, 0.0, z)};
    };
    return {{0, 0, at(0.055, 0.05)}, {1, 0, at(-0.06, 0.02)}, {2, 0, at(0.04, 0.02)}, {3, 0, at(0.0, 0.0)}};
  }
  OdeSystem& system() { return plant->system(); }
  std::vector<double>& x() { return plant->state(); }
  /// All axes to and fro by 0.2 rad once a second, for this number of command periods. False if the solver
  /// fails.
  bool swing(int periods) {
    for (int i = 0; i < periods; ++i) {
      for (KinematicRobot& robot : plant->robots()) {
        JointArray q{}, qd{};
        const double phase = 2.0 * M_PI * (t + 0.008);
        for (std::size_t j = 0; j < 6; ++j) {
          q[j] = robot.parameters().q_initial[j] + 0.1 * (1.0 - std::cos(phase));
          qd[j] = 0.1 * 2.0 * M_PI * std::sin(phase);
        }
        robot.set_point(t, 0.008, q.data(), qd.data());
      }
      for (int s = 0; s < 8; ++s, t += 0.001) {
        system().update_motion(t, x());
        if (!plant->integrator().advance(system(), t, 0.001, x())) return false;
      }
    }
    return true;
  }

  std::shared_ptr<const CellModel> model;
  std::optional<ComponentInteraction> interaction;
  std::optional<CellPlant> plant;
  double t = 0.0;
};

}  // namespace takt::test
