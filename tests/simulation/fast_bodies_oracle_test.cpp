// Bodies strike each other. No body passes through another one, and none leaves faster than it came. An
// impact that the contact law cannot stop is a fault.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <sstream>

#include "tests/support/contact_meshes.h"
#include "tests/support/contact_scene.h"
#include "tests/support/effort.h"
#include "tests/support/random_shapes.h"

namespace takt::test {
namespace {

using ::testing::HasSubstr;

void write_obj(const TemporaryDirectory& directory, const std::string& name, const TriangleMesh& mesh) {
  std::ostringstream text;
  text.precision(17);
  for (const Vec3& v : mesh.vertices) text << "v " << v.x() << ' ' << v.y() << ' ' << v.z() << '\n';
  for (const auto& t : mesh.triangles) text << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
  directory.write(name + ".obj", text.str());
}

/// A cylinder of this many sides about z, its ends closed by fans.
TriangleMesh cylinder(double radius, double length, std::uint32_t sides) {
  TriangleMesh mesh;
  for (const double z : {-0.5 * length, 0.5 * length})
    for (std::uint32_t i = 0; i < sides; ++i) {
      const double a = 2.0 * std::numbers::pi * i / sides;
      mesh.vertices.emplace_back(radius * std::cos(a), radius * std::sin(a), z);
    }
  mesh.vertices.emplace_back(0.0, 0.0, -0.5 * length);
  mesh.vertices.emplace_back(0.0, 0.0, 0.5 * length);
  for (std::uint32_t i = 0; i < sides; ++i) {
    const std::uint32_t k = (i + 1) % sides;
    mesh.triangles.push_back({i, k, k + sides});
    mesh.triangles.push_back({i, k + sides, i + sides});
    mesh.triangles.push_back({2 * sides, k, i});
    mesh.triangles.push_back({2 * sides + 1, i + sides, k + sides});
  }
  return mesh;
}

struct Projectile {
  const char* name;
  TriangleMesh mesh;
  double mass_kg, half_height_m;
};

const std::vector<Projectile>& projectiles() {
  static const std::vector<Projectile> made{{"cube", lattice_box({0.02, 0.02, 0.02}, 0.005), 0.0628, 0.01},
                                            {"coin", cylinder(0.012, 0.002, 24), 0.0071, 0.001},
                                            {"ball", ball(0.005, 3), 0.0041, 0.005},
                                            {"rod", cylinder(0.003, 0.04, 16), 0.0089, 0.02}};
  return made;
}

TEST(FastBodies, NoBodyGoesThroughAPlate) {
  // The top of the plate is at z = 0; a body starts 3 mm above it.
  const char* const solvers[] = {"{method: rosenbrock, step_s: 0.008, tolerance: 1.0e-4}",
                                 "{method: rosenbrock, step_s: 0.001, tolerance: 1.0e-6}",
                                 "{method: cvode, step_s: 0.008, tolerance: 1.0e-6}",
                                 "{method: cvode, step_s: 0.001, tolerance: 1.0e-4}",
                                 "{method: esdirk, step_s: 0.008, tolerance: 1.0e-6}",
                                 "{method: implicit, step_s: 0.001}",
                                 "{method: implicit, step_s: 0.004}"};
  const TemporaryDirectory directory;
  // Each solver in turn; the long form has all of them in each case.
  const bool all_solvers = effort() > 1;
  std::size_t cases = 0, turn = 0;
  for (const Projectile& body : projectiles()) {
    write_obj(directory, body.name, body.mesh);
    for (const double thickness : {0.002, 0.005, 0.015, 0.05}) {
      write_obj(
          directory, "plate",
          moved(lattice_box({0.2, 0.2, thickness}, 0.02), {Mat3::Identity(), Vec3(0, 0, -0.5 * thickness)}));
      for (const double speed : {1.0, 2.0, 5.0, 10.0, 20.0})
        for (std::size_t k = 0; k < (all_solvers ? std::size(solvers) : 1); ++k) {
          const char* solver = solvers[turn++ % std::size(solvers)];
          SceneText text;
          text.solver = solver;
          std::ostringstream part;
          part << "  Body: {mesh: " << body.name << ".obj, mass_kg: " << body.mass_kg
               << ", hierarchy: 1, pose: {position_m: [0.003, 0.002, " << body.half_height_m + 0.003
               << "]}, twist: {velocity_m_per_s: [0, 0, " << -speed << "]}}";
          text.parts = part.str();
          text.grounds = "  Plate: {mesh: plate.obj}";
          const auto cell = load_scene(directory, text);
          Simulation simulation(cell);
          const std::string name = std::string(body.name) + " at " + std::to_string(speed) + " m/s on " +
                                   std::to_string(1e3 * thickness) + " mm, " + solver;
          bool going = true;
          while (going && simulation.time_s() < 0.003 / speed + 0.024) going = simulation.step({});
          ++cases;
          const auto sample =
              simulation.make_snapshot()
                  .components[static_cast<std::size_t>(cell->description.find_component("Body"))];
          EXPECT_TRUE(going) << name << ": " << simulation.fault();
          EXPECT_GT(sample.p_WB.z(), 0.0) << name << " went through";
          EXPECT_LT(sample.V_WB.v.norm(), 1.02 * std::hypot(speed, 0.5)) << name;
        }
    }
  }
  EXPECT_EQ(cases, all_solvers ? 560U : 80U);
}

TEST(FastBodies, ABodyThatNoLayerHoldsIsAFaultThatNamesIt) {
  // Five tonnes at 100 m/s.
  const TemporaryDirectory directory;
  write_obj(directory, "cube", lattice_box({0.02, 0.02, 0.02}, 0.005));
  write_obj(directory, "plate",
            moved(lattice_box({0.2, 0.2, 0.01}, 0.02), {Mat3::Identity(), Vec3(0, 0, -0.005)}));
  for (const char* solver :
       {"{method: rosenbrock, step_s: 0.001, tolerance: 1.0e-6}", "{method: implicit, step_s: 0.001}",
        "{method: cvode, step_s: 0.008, tolerance: 1.0e-6}"}) {
    SceneText text;
    text.solver = solver;
    text.parts =
        "  Body: {mesh: cube.obj, mass_kg: 5000, hierarchy: 1, pose: {position_m: [0, 0, 0.013]}, "
        "twist: {velocity_m_per_s: [0, 0, -100]}}";
    text.grounds = "  Plate: {mesh: plate.obj}";
    Simulation simulation(load_scene(directory, text));
    while (simulation.time_s() < 0.1 && simulation.step({})) {
    }
    EXPECT_THAT(simulation.fault(), HasSubstr("Body passes through Plate")) << solver;
    EXPECT_THAT(simulation.fault(), HasSubstr("m/s")) << solver;
    EXPECT_THAT(simulation.fault(), HasSubstr("a slower approach")) << solver;
  }
}

TEST(FastBodies, NoBodyBouncesHigherThanItFell) {
  // Meshes of the library, dropped at random from up to 60 mm upon a plate, without damping and friction or
  // with the defaults.
  const char* const laws[] = {"{defaults: {friction: 0, areal_damping_N_s_per_m3: 0}}",
                              "{defaults: {friction: 0.3}}"};
  const char* const names[] = {"block", "peg_100um", "slab", "press_peg", "bush", "sphere"};
  Random random(3);
  const int drops = 24 * static_cast<int>(effort());  // each mesh with each law twice
  for (int drop = 0; drop < drops; ++drop) {
    const TemporaryDirectory directory;
    SceneText text;
    text.solver = "{method: rosenbrock, step_s: 0.004, tolerance: 1.0e-6}";
    text.contact = laws[drop % 2];
    const Quat q(random.rotation());
    const double height = random.uniform(0.06, 0.1);
    std::ostringstream part;
    part.precision(17);
    part << "  Body: {mesh: " << library_mesh(names[drop % 6]) << ", mass_kg: 0.2, hierarchy: 1, pose: "
         << "{position_m: [0, 0, " << height << "], quaternion_xyzw: [" << q.x() << ", " << q.y() << ", "
         << q.z() << ", " << q.w() << "]}}";
    text.parts = part.str();
    text.grounds = "  Plate: {mesh: " + library_mesh("plate") + "}";
    const auto cell = load_scene(directory, text);
    Simulation simulation(cell);
    const auto energy_height = [&] {
      const auto sample = simulation.make_snapshot().components.front();
      const Vec3 w_B = sample.q_WB.conjugate() * sample.V_WB.w;
      const Component& c = cell->components.front();
      const Vec3 cm = sample.q_WB * c.p_BBcm;
      return (sample.p_WB + cm).z() +
             (0.5 * c.mass_kg * sample.V_WB.at(cm).squaredNorm() + 0.5 * w_B.dot(c.I_BBcm_B * w_B)) /
                 (c.mass_kg * kG);
    };
    const double begin = energy_height();
    double highest = begin;
    while (simulation.time_s() < 0.3) {
      ASSERT_TRUE(simulation.step({})) << simulation.fault();
      highest = std::max(highest, energy_height());
    }
    EXPECT_LT(highest - begin, 1e-4) << "drop " << drop << " of " << names[drop % 6];
  }
}

}  // namespace
}  // namespace takt::test
