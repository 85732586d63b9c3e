// bench_contact: one contact pair at a time, poses of the block scenario: elements, microseconds per
// evaluation with and without K and D with valid candidate lists, nanoseconds per element with force,
// construction of the lists, and a pair with separate boxes. Then the scenes of config/scenarios/contact by
// several solvers beside Bullet. Arguments: pairs or scenes for one of the two; large: a peg and a hole with
// 100 000 triangles each, too; poses [COUNT]: random poses of all pairs of the scenes, exit code 1 if any
// result is not finite.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "server/contact/surface/polygonal_contact.h"
#include "server/geometry/mesh/import.h"
#include "tests/performance/contact_scenes_bench.h"
#include "tests/performance/processor_time.h"
#include "tests/support/contact_meshes.h"

namespace {

using namespace takt;
using bench::processor_s;

std::shared_ptr<const ContactSurface> surface(const TriangleMesh& mesh, double edge_m = 0.0) {
  return std::make_shared<ContactSurface>(mesh, ContactSurfaceOptions{edge_m});
}

struct Pair {
  std::string name;
  std::shared_ptr<const ContactSurface> base, target;
  Pose X_TB;
  std::shared_ptr<const DistanceField> field{};
};

/// Least of several rounds, in seconds per call.
template <typename Call>
double per_call(int calls, const Call& call) {
  double least = 1e9;
  for (int round = 0; round < 60; ++round) {
    const double begin = processor_s();
    for (int i = 0; i < calls; ++i) call(i);
    least = std::min(least, (processor_s() - begin) / calls);
  }
  return least;
}

/// Small motions that keep the candidate lists.
std::vector<RelativeMotion> motions(const Pose& X_TB) {
  std::vector<RelativeMotion> result;
  for (int i = 0; i < 64; ++i) {
    RelativeMotion m{X_TB, {}};
    m.X_TB.p += 1e-7 * Vec3(i % 3, i % 5, i % 7 - 3);
    m.V_TB_T = {Vec3(1e-3 * (i % 5), 2e-4, -1e-4 * (i % 3)), Vec3(1e-3, 0.0, 2e-3 * (i % 4))};
    result.push_back(m);
  }
  return result;
}

void measure(const Pair& pair, FrictionLaw friction_law) {
  ContactParameters parameters;
  parameters.friction_law = friction_law;
  PolygonalContact contact(pair.base, pair.target, contact_law(parameters), pair.field);
  const auto path = motions(pair.X_TB);
  ContactResult result;
  ContactJacobian jacobian;
  double sink = 0.0;
  contact.evaluate(path[0], result);
  contact.accept(path[0]);
  for (int i = 0; i < 1000; ++i) contact.evaluate(path[static_cast<std::size_t>(i) % 64], result);
  const auto before = contact.counts();
  const double forces = per_call(500, [&](int i) {
    contact.evaluate(path[static_cast<std::size_t>(i) % 64], result);
    sink += result.F_B_T.f.x();
  });
  const double elements = static_cast<double>(contact.counts().elements - before.elements) /
                          static_cast<double>(contact.counts().evaluations - before.evaluations);
  const double secant = per_call(500, [&](int i) {
    contact.evaluate(path[static_cast<std::size_t>(i) % 64], Linearisation::secant, result, jacobian);
    sink += jacobian.K(0, 0);
  });
  const double tangent = per_call(500, [&](int i) {
    contact.evaluate(path[static_cast<std::size_t>(i) % 64], Linearisation::tangent, result, jacobian);
    sink += jacobian.K(0, 0);
  });
  const double rebuild = per_call(1, [&](int) {
    contact.reset();
    contact.evaluate(path[0], result);
    sink += result.F_B_T.f.x();
  });
  std::printf("%-28s %-7s %6zu %8.1f %9.3f %8.2f %9.3f %6.2f %9.3f %6.2f %10.1f%s\n", pair.name.c_str(),
              friction_law == FrictionLaw::stick ? "stick" : "(2.21)", pair.base->element_count(), elements,
              1e6 * forces, elements > 0.0 ? 1e9 * forces / elements : 0.0, 1e6 * secant, secant / forces,
              1e6 * tangent, tangent / forces, 1e6 * rebuild, sink == 1.0 ? " " : "");
}

void contact_pairs() {
  const std::filesystem::path meshes = std::filesystem::path(TAKT_CONFIG_DIR) / "meshes";
  const auto part = [&](const char* name) {
    return surface(import_solid(meshes / (std::string(name) + ".obj")));
  };
  const auto B = part("B"), C = part("C"), O = part("O"), P = part("P"), jaw = part("gripper_jaw"),
             table = part("table");
  const auto punch = surface(test::lattice_box({0.035, 0.035, 0.02}, std::array<int, 3>{7, 7, 4}));
  const auto ball = surface(test::ball(0.02, 5));
  const auto socket =
      surface(test::hollow(test::lattice_box({0.06, 0.06, 0.06}, 0.005), test::ball(0.0201, 5)));
  const double u = 2e-6;
  std::vector<Pair> pairs;
  pairs.push_back({"punch of 98 on table", punch, table, {Mat3::Identity(), Vec3(0.0, 0.0, 0.01 - u)}});
  pairs.push_back({"B on table", B, table, {Mat3::Identity(), Vec3(0.1, 0.0, -u)}});
  pairs.push_back({"C in pocket of B", C, B, {Mat3::Identity(), Vec3(-0.06, 0.0, 0.02 - u)}});
  pairs.push_back({"P in O", P, O, {Mat3::Identity(), Vec3(0.015 + 0.0005 + u, 0.0, 0.03 - u)}});
  pairs.push_back({"jaw on C", jaw, C, {Mat3::Identity(), Vec3(0.0, 0.0395 - u, -0.04)}});
  pairs.push_back({"ball in socket", ball, socket, {Mat3::Identity(), Vec3(0.0, 0.0, -0.0001 - 1e-5)}});
  pairs.push_back({"C hovers in pocket of B", C, B, {Mat3::Identity(), Vec3(-0.06, 0.0, 0.02 + 5e-4)}});
  // The same pairs by the distance field of the Target.
  for (const std::size_t i : {std::size_t{0}, std::size_t{5}}) {
    Pair pair = pairs[i];
    pair.name += ", field";
    pair.field = std::make_shared<const DistanceField>(pair.target, default_field_spacing_m(*pair.target));
    pairs.push_back(pair);
  }
  std::printf("%-28s %-7s %6s %8s %9s %8s %9s %6s %9s %6s %10s\n", "pair", "law", "base", "elements",
              "forces us", "ns/elem", "secant us", "ratio", "tangent", "ratio", "rebuild us");
  for (const Pair& pair : pairs) measure(pair, FrictionLaw::regularised);
  measure(pairs[0], FrictionLaw::stick);
  measure(pairs[1], FrictionLaw::stick);

  PolygonalContact contact(C, B, contact_law({}));
  ContactResult result;
  double sink = 0.0;
  RelativeMotion apart;
  const double boxes = per_call(20000, [&](int i) {
    apart.X_TB.p = Vec3(0.5, 0.0, 1e-6 * i);
    contact.evaluate(apart, result);
    sink += result.area_m2;
  });
  std::printf("boxes apart: %.1f ns%s\n", 1e9 * boxes, sink == 1.0 ? " " : "");
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  if (what == "poses") return bench::contact_poses(argc > 2 ? std::atoi(argv[2]) : 1'000'000);
  if (!what.empty() && what != "pairs" && what != "scenes" && what != "large") {
    std::fprintf(stderr, "bench_contact: found '%s'; allowed: pairs, scenes, large, poses [COUNT]\n",
                 what.c_str());
    return 2;
  }
  if (what != "scenes" && what != "large") contact_pairs();
  try {
    if (what != "pairs") bench::contact_scenes(what == "large");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_contact: %s\n", error.what());
    return 2;
  }
  return 0;
}
