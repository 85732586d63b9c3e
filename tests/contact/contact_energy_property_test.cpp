// Without friction and damping the wrench of a pair is minus the gradient of one energy of the relative pose,
// for any meshes; damping and friction only dissipate energy.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "server/geometry/mesh/import.h"
#include "tests/support/contact_pairs.h"
#include "tests/support/effort.h"
#include "tests/support/random_shapes.h"

namespace takt {
namespace {

using test::at_rest;
using test::evaluate;
using test::Random;
using test::surface;
using Vec6 = Eigen::Matrix<double, 6, 1>;

ContactLaw elastic_law() {
  ContactParameters parameters;
  parameters.friction = 0.0;
  parameters.areal_damping_N_s_per_m3 = 0.0;
  return contact_law(parameters);
}

struct EnergyScene {
  const char* name;
  TriangleMesh base, target;
  Pose touching;
  double shift_m, turn_rad;  ///< how far motions go
};

const std::vector<EnergyScene>& energy_scenes() {
  static const std::vector<EnergyScene> made = [] {
    const auto part = [](const char* name) {
      return import_solid(std::string(TAKT_CONFIG_DIR "/meshes/") + name + ".obj");
    };
    const TriangleMesh plate = test::lattice_box({0.2, 0.2, 0.02}, std::array<int, 3>{1, 1, 1});
    const Mat3 on_edge = Eigen::AngleAxisd(0.25 * std::numbers::pi, Vec3::UnitY()).toRotationMatrix();
    const Mat3 upright = Eigen::AngleAxisd(0.5 * std::numbers::pi, Vec3::UnitY()).toRotationMatrix();
    std::vector<EnergyScene> list;
    list.push_back({"cube on its edge",
                    test::lattice_box({0.04, 0.04, 0.04}, 0.01),
                    plate,
                    {on_edge, Vec3(0.0, 0.0, 0.01 + 0.02 * std::numbers::sqrt2 - 2e-3)},
                    2e-3,
                    0.1});
    list.push_back({"cube over the rim of a plate",
                    test::lattice_box({0.04, 0.04, 0.04}, 0.007),
                    plate,
                    {Mat3::Identity(), Vec3(0.1, 0.02, 0.03 - 5e-4)},
                    8e-3,
                    0.05});
    list.push_back({"cube at a corner of a plate",
                    test::lattice_box({0.04, 0.04, 0.04}, 0.013),
                    plate,
                    {Mat3::Identity(), Vec3(0.11, 0.11, 0.01)},
                    1e-2,
                    0.5});
    list.push_back({"C in the pocket of B",
                    part("C"),
                    part("B"),
                    {Mat3::Identity(), Vec3(-0.06, 0.0, 0.02 - 1e-4)},
                    8e-4,
                    5e-3});
    list.push_back({"peg in its hole",
                    part("contact/peg_100um"),
                    part("contact/hole"),
                    {Mat3::Identity(), Vec3(0.0, 0.0, 0.012)},
                    4e-4,
                    5e-3});
    list.push_back({"peg on the rim of its hole",
                    part("contact/peg_100um"),
                    part("contact/hole"),
                    {Mat3::Identity(), Vec3(0.002, 0.0, 0.0285)},
                    2e-3,
                    0.1});
    list.push_back({"hole on the peg",
                    part("contact/hole"),
                    part("contact/peg_100um"),
                    {Mat3::Identity(), Vec3(0.0, 0.0, -0.012)},
                    4e-4,
                    5e-3});
    list.push_back({"ring on its hook",
                    part("contact/ring"),
                    part("contact/hook"),
                    {upright, Vec3(0.015, 0.0, -0.0288)},
                    1e-3,
                    0.1});
    return list;
  }();
  return made;
}

Pose turned(const Pose& X, const Vec3& shift, const Vec3& turn) {
  const double angle = turn.norm();
  const Mat3 R = angle > 0.0 ? Mat3(Eigen::AngleAxisd(angle, Vec3(turn / angle)).toRotationMatrix())
                             : Mat3(Mat3::Identity());
  return {R * X.R, X.p + shift};
}

TEST(ContactEnergy, TheWrenchIsTheNegativeGradientOfTheEnergy) {
  for (const EnergyScene& s : energy_scenes()) {
    PolygonalContact contact(surface(s.base), surface(s.target), elastic_law());
    Random random(17);
    int touched = 0, smooth = 0;
    for (int i = 0; i < 60; ++i) {
      const Pose X = turned(s.touching, random.uniform(0.0, s.shift_m) * random.direction(),
                            random.uniform(0.0, s.turn_rad) * random.direction());
      const ContactResult r = evaluate(contact, {X, {}});
      if (r.elements == 0) continue;
      ++touched;
      const Vec6 F = test::stacked(r.F_B_T);
      // Differences of two sizes: where they differ, an element changes from one face to another in between.
      const auto gradient = [&](double step) {
        Vec6 g;
        for (int k = 0; k < 6; ++k) {
          const auto energy = [&](double by) {
            const RelativeMotion at = test::displaced({X, {}}, by * Vec6::Unit(k));
            return evaluate(contact, at).elastic_energy_J;
          };
          g[k] = (energy(step) - energy(-step)) / (2.0 * step);
        }
        return g;
      };
      const Vec6 coarse = gradient(2e-8), fine = gradient(1e-8);
      if ((coarse - fine).norm() > 1e-6 * fine.norm()) continue;
      ++smooth;
      EXPECT_LT((F + fine).norm(), 3e-6 * F.norm()) << s.name << " pose " << i;
    }
    EXPECT_GT(touched, 30) << s.name;
    EXPECT_GT(smooth, 15) << s.name;
  }
}

TEST(ContactEnergy, ClosedLoopsOfAMotionDoNoWork) {
  for (const EnergyScene& s : energy_scenes()) {
    for (const double edge_m : {0.0, 0.003}) {
      const auto base = surface(s.base, edge_m);
      if (base->element_count() > 7000) continue;
      PolygonalContact contact(base, surface(s.target), elastic_law());
      Random random(29);
      for (std::size_t loop = 0; loop < test::effort(); ++loop) {
        // Sines of different frequencies and phases in all six coordinates.
        std::array<Vec3, 3> shift, turn;
        for (std::size_t k = 0; k < 3; ++k) {
          shift[k] = random.uniform(0.3, 1.0) / 3.0 * s.shift_m * random.direction();
          turn[k] = random.uniform(0.3, 1.0) / 3.0 * s.turn_rad * random.direction();
        }
        const auto pose = [&](double phase) {
          Vec3 a = Vec3::Zero(), w = Vec3::Zero();
          for (std::size_t k = 0; k < 3; ++k) {
            const double angle =
                2.0 * std::numbers::pi * (static_cast<double>(k + 1) * phase + 0.3 * static_cast<double>(k));
            a += std::sin(angle) * shift[k], w += std::cos(angle) * turn[k];
          }
          return turned(s.touching, a, w);
        };
        // Work by Simpson's rule; a piece is divided until the result is stable. If an element passes from
        // one face to another the force jumps: the pieces become very short there. Each pose is evaluated
        // once.
        double moved = 0.0, largest_J = 0.0;
        struct Instant {
          double phase;
          Pose X;
          Vec3 force, moment;  ///< on the base, about the origin of the target
        };
        const auto instant = [&](double phase) {
          const Pose X = pose(phase);
          const ContactResult r = evaluate(contact, {X, {}});
          largest_J = std::max(largest_J, r.elastic_energy_J);
          return Instant{phase, X, r.F_B_T.f, r.F_B_T.t - X.p.cross(r.F_B_T.f)};
        };
        const auto between = [&](const Instant& from, const Instant& to) {
          return instant(0.5 * (from.phase + to.phase));
        };
        const auto simpson = [](const Instant& from, const Instant& half, const Instant& to) {
          const Eigen::AngleAxisd rotation(Mat3(to.X.R * from.X.R.transpose()));
          const Vec3 w = rotation.angle() * rotation.axis(), a = to.X.p - from.X.p;
          const auto work_at = [&](const Instant& at) { return at.force.dot(a) + at.moment.dot(w); };
          return (work_at(from) + 4.0 * work_at(half) + work_at(to)) / 6.0;
        };
        const std::function<double(const Instant&, const Instant&, const Instant&, double, double)> divided =
            [&](const Instant& from, const Instant& half, const Instant& to, double whole, double tolerance) {
              const Instant early = between(from, half), late = between(half, to);
              const double first = simpson(from, early, half), second = simpson(half, late, to);
              if (std::abs(first + second - whole) <= tolerance || to.phase - from.phase < 1e-12)
                return first + second;
              return divided(from, early, half, first, 0.6 * tolerance) +
                     divided(half, late, to, second, 0.6 * tolerance);
            };
        const int pieces = base->element_count() > 2000 ? 500 : 6000;
        std::vector<Instant> ends{instant(0.0)}, halves;
        std::vector<double> whole;
        for (int i = 0; i < pieces; ++i) {
          ends.push_back(instant(static_cast<double>(i + 1) / pieces));
          const Instant& from = ends[ends.size() - 2];
          halves.push_back(between(from, ends.back()));
          whole.push_back(simpson(from, halves.back(), ends.back()));
          moved += std::abs(whole.back());
        }
        double work = 0.0;
        for (std::size_t i = 0; i < whole.size(); ++i)
          work += divided(ends[i], halves[i], ends[i + 1], whole[i], 1e-11 * moved);
        EXPECT_GT(largest_J, 0.0) << s.name;
        EXPECT_LT(std::abs(work), 1e-6 * moved) << s.name << " edge " << edge_m << " loop " << loop;
      }
    }
  }
}

TEST(ContactEnergy, ALevelPlateHasNoSidewaysForce) {
  const TriangleMesh plates[] = {test::lattice_box({0.3, 0.3, 0.05}, std::array<int, 3>{1, 1, 1}),
                                 test::lattice_box({0.3, 0.3, 0.05}, std::array<int, 3>{37, 41, 3})};
  for (const TriangleMesh& plate : plates)
    for (const int cells : {1, 2, 3, 5, 8, 13, 20, 40}) {
      const auto cube =
          surface(test::lattice_box({0.04, 0.04, 0.04}, std::array<int, 3>{cells, cells, cells}));
      PolygonalContact contact(cube, surface(plate), elastic_law());
      for (int degrees = 0; degrees <= 45; degrees += 5) {
        const double tilt = degrees * std::numbers::pi / 180.0;
        const Mat3 R = (Eigen::AngleAxisd(0.4, Vec3::UnitZ()) * Eigen::AngleAxisd(tilt, Vec3::UnitY()) *
                        Eigen::AngleAxisd(0.3 * tilt, Vec3::UnitX()))
                           .toRotationMatrix();
        // Pressed in until the centroids of the coarsest are in.
        double lowest = 0.0;
        for (const Vec3& v : test::lattice_box({0.04, 0.04, 0.04}, std::array<int, 3>{1, 1, 1}).vertices)
          lowest = std::min(lowest, (R * v).z());
        for (const double depth : {2e-4, 2e-3, 2e-2}) {
          const Vec3 f = evaluate(contact, at_rest({0.0031, -0.0017, 0.025 - lowest - depth}, R)).F_B_T.f;
          if (f.z() == 0.0) continue;
          EXPECT_LT(f.head<2>().norm(), 1e-9 * f.z()) << cells << " cells, " << degrees << " degrees";
        }
      }
    }
}

TEST(ContactEnergy, DampingAndFrictionOnlyTakeEnergyOut) {
  ContactParameters parameters;
  parameters.friction = 0.5;
  const ContactLaw law = contact_law(parameters);
  for (const EnergyScene& s : energy_scenes()) {
    const auto base = surface(s.base), target = surface(s.target);
    PolygonalContact real(base, target, law), elastic(base, target, elastic_law());
    Random random(41);
    for (int i = 0; i < 100; ++i) {
      const Pose X = turned(s.touching, random.uniform(0.0, s.shift_m) * random.direction(),
                            random.uniform(0.0, s.turn_rad) * random.direction());
      const Twist V{random.log_uniform(1e-5, 1.0) * random.direction(),
                    random.log_uniform(1e-4, 10.0) * random.direction()};
      const ContactResult r = evaluate(real, {X, V}), e = evaluate(elastic, {X, V});
      const auto power = [&](const Wrench& F) { return F.f.dot(V.v) + (F.t - X.p.cross(F.f)).dot(V.w); };
      EXPECT_LE(power(r.F_B_T) - power(e.F_B_T), 1e-9 * (std::abs(power(r.F_B_T)) + std::abs(power(e.F_B_T))))
          << s.name << " pose " << i;
    }
  }
}

}  // namespace
}  // namespace takt
