// Contact by distance fields: forces in closed form, and the laws that every contact obeys.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>
#include <vector>

#include "server/contact/surface/polygonal_contact.h"
#include "tests/support/contact_pairs.h"
#include "tests/support/random_shapes.h"

namespace takt::test {
namespace {

using Vec6 = Eigen::Matrix<double, 6, 1>;
constexpr double kPi = std::numbers::pi;

ContactLaw elastic_law() {
  ContactParameters parameters;
  parameters.friction = parameters.areal_damping_N_s_per_m3 = 0.0;
  return contact_law(parameters);
}

std::shared_ptr<const DistanceField> field_of(const std::shared_ptr<const ContactSurface>& target,
                                              double spacing_m) {
  return std::make_shared<const DistanceField>(target, spacing_m);
}

struct FieldScene {
  const char* name;
  std::shared_ptr<const ContactSurface> base, target;
  std::shared_ptr<const DistanceField> field;
  Pose touching;
  double shift_m, turn_rad;
};

std::vector<FieldScene> make_field_scenes() {
  std::vector<FieldScene> list;
  const auto punch = surface(lattice_box({0.04, 0.04, 0.02}, 0.005)),
             block = surface(lattice_box({0.1, 0.06, 0.05}, 0.02)), round = surface(ball(0.02, 4));
  const auto socket = surface(hollow(lattice_box({0.06, 0.06, 0.06}, 0.01), ball(0.0205, 4)));
  const auto ring = surface(torus(0.03, 0.006, 96, 32));
  const Mat3 on_edge = Eigen::AngleAxisd(0.25 * kPi, Vec3::UnitY()).toRotationMatrix();
  Pose hung;
  hung.R = Eigen::AngleAxisd(0.5 * kPi, Vec3::UnitX()).toRotationMatrix();
  hung.p = Vec3(0.06 - 2.0 * 0.006 + 0.0003, 0.0, 0.0);
  const auto of_block = field_of(block, 0.002), of_ball = field_of(round, 0.001),
             of_socket = field_of(socket, 0.001), of_ring = field_of(ring, 0.0008);
  list.push_back({"punch on a block",
                  punch,
                  block,
                  of_block,
                  {Mat3::Identity(), Vec3(0.003, 0.002, 0.035 - 2e-4)},
                  1e-4,
                  0.02});
  list.push_back({"punch over the rim",
                  punch,
                  block,
                  of_block,
                  {Mat3::Identity(), Vec3(0.0437, 0.002, 0.035 - 3e-4)},
                  3e-3,
                  0.05});
  list.push_back({"punch on its edge",
                  punch,
                  block,
                  of_block,
                  {on_edge, Vec3(0.003, 0.002, 0.025 + 0.03 / std::numbers::sqrt2 - 2e-3)},
                  1e-3,
                  0.1});
  list.push_back({"ball on a block",
                  round,
                  block,
                  of_block,
                  {Mat3::Identity(), Vec3(0.001, 0.002, 0.045 - 5e-4)},
                  3e-4,
                  0.5});
  list.push_back({"block on a ball",
                  block,
                  round,
                  of_ball,
                  {Mat3::Identity(), Vec3(0.001, 0.002, 0.045 - 1e-3)},
                  5e-4,
                  0.05});
  list.push_back(
      {"ball in a socket", round, socket, of_socket, {Mat3::Identity(), Vec3(0.0, 3e-4, -9e-4)}, 2e-4, 0.5});
  list.push_back({"ring in ring", ring, ring, of_ring, hung, 1e-4, 0.02});
  return list;
}

const std::vector<FieldScene>& field_scenes() {
  static const std::vector<FieldScene> made = make_field_scenes();
  return made;
}

Pose nudged(const FieldScene& s, Random& random) {
  const Mat3 turn = Eigen::AngleAxisd(random.uniform(0.0, s.turn_rad), random.direction()).toRotationMatrix();
  return {turn * s.touching.R, s.touching.p + random.uniform(0.0, s.shift_m) * random.direction()};
}

TEST(FieldContactOracle, AFlatPunchHasStiffnessTimesAreaTimesPenetration) {
  const ContactLaw law = elastic_law();
  const auto punch = surface(lattice_box({0.04, 0.04, 0.03}, 0.005)), floor = surface(floor_mesh());
  const double area = 0.04 * 0.04;
  PolygonalContact contact(punch, floor, law, field_of(floor, 0.003));
  for (const double u : {1e-6, 1e-4, 1.5e-3}) {
    const ContactResult r = evaluate(contact, at_rest({0.013, -0.021, 0.015 - u}));
    const double force = law.stiffness_Pa_per_m * area * u;
    EXPECT_NEAR(r.F_B_T.f.z(), force, 1e-9 * law.stiffness_Pa_per_m * area) << u;
    EXPECT_LT(r.F_B_T.f.head<2>().norm(), 1e-6 * force);
    EXPECT_NEAR(r.area_m2, area, 1e-6 * area);
    EXPECT_NEAR(r.elastic_energy_J, 0.5 * force * u, 1e-9 * law.stiffness_Pa_per_m * area * u);
    EXPECT_NEAR(r.largest_penetration_m, u, 1e-9);
    EXPECT_LT((r.p_TC - Vec3(0.013, -0.021, -u)).norm(), 1e-6);
  }
}

TEST(FieldContactOracle, EitherOfTwoSlabsAsTheBaseGivesTheSameForceAlsoWhereTheLawIsHard) {
  const ContactLaw law = elastic_law();
  const auto small = surface(lattice_box({0.03, 0.03, 0.01}, std::array<int, 3>{10, 10, 1})),
             large = surface(lattice_box({0.08, 0.08, 0.012}, std::array<int, 3>{64, 64, 1}));
  PolygonalContact contact(small, large, law, field_of(large, 0.001)),
      swapped(large, small, law, field_of(small, 0.0005));
  for (const double u : {2e-5, 4e-4, 1.9e-3}) {
    const double force = 0.03 * 0.03 * elastic_layer(contact.law(), u).pressure_Pa;
    EXPECT_NEAR(evaluate(contact, at_rest({0.0025, 0.00125, 0.011 - u})).F_B_T.f.z(), force, 1e-4 * force)
        << u;
    // Deeper, elements at the rim of the smaller slab are nearer to its sides.
    if (u > 5e-4) continue;
    EXPECT_NEAR(evaluate(swapped, at_rest({-0.0025, -0.00125, -0.011 + u})).F_B_T.f.z(), -force, 0.08 * force)
        << u;
  }
}

TEST(FieldContactOracle, ABallOnALayerHasTheClosedForm) {
  // Winkler: p = k (delta - r^2 / 2R) gives F = pi k R delta^2 (Johnson 1985, 4.3). Corrections are of the order of delta / R.
  const double radius = 0.05, delta = 0.0005;
  const ContactLaw law = elastic_law();
  const double force = kPi * law.stiffness_Pa_per_m * radius * delta * delta;
  const auto round = surface(ball(radius, 6)), floor = surface(floor_mesh());
  const auto plate =
      surface(moved(lattice_box({0.04, 0.04, 0.02}, 0.0008), {Mat3::Identity(), Vec3(0.0, 0.0, -0.01)}));
  PolygonalContact on_floor(round, floor, law, field_of(floor, 0.003)),
      of_plate(plate, round, law, field_of(round, 0.001));
  double sum = 0.0;
  for (int i = 0; i < 10; ++i) {
    const Mat3 R = Eigen::AngleAxisd(0.1 + 0.2 * i, Vec3(1.0, 0.3 * i, 0.5).normalized()).toRotationMatrix();
    sum += 0.1 * evaluate(on_floor, at_rest({0.0, 0.0, radius - delta}, R)).F_B_T.f.z();
  }
  EXPECT_NEAR(sum, force, 0.04 * force);
  // F = pi k h delta^2 with the directions of a round Target, h = R - delta.
  const ContactResult r = evaluate(of_plate, at_rest({0.0001, 0.0002, -(radius - delta)}));
  EXPECT_NEAR(r.F_B_T.f.z(), -force * (1.0 - delta / radius), 0.03 * force);
}

TEST(FieldContactOracle, TheForceConvergesToThatOfTheTrianglesWithTheSpacing) {
  const double height = 0.02 - 0.0008;
  const auto plate =
      surface(moved(lattice_box({0.016, 0.016, 0.02}, 0.0002), {Mat3::Identity(), Vec3(0.0, 0.0, -0.01)}));
  const auto round = surface(ball(0.02, 6));
  PolygonalContact triangles(plate, round, elastic_law());
  double last = INFINITY;
  for (const double h : {0.008, 0.004, 0.002}) {
    PolygonalContact contact(plate, round, elastic_law(), field_of(round, h));
    double error = 0.0;
    for (int i = 0; i < 8; ++i) {
      const Mat3 R =
          Eigen::AngleAxisd(0.1 + 0.3 * i, Vec3(1.0, 0.3 * i, 0.5).normalized()).toRotationMatrix();
      const RelativeMotion motion = at_rest(R * Vec3(0.0, 0.0, -height), R);
      const Vec3 exact = evaluate(triangles, motion).F_B_T.f;
      error += (evaluate(contact, motion).F_B_T.f - exact).norm() / exact.norm() / 8.0;
    }
    RecordProperty("error_" + std::to_string(static_cast<int>(1e6 * h)) + "_um", std::to_string(error));
    EXPECT_LT(error, 0.3 * last) << h;
    last = error;
  }
  EXPECT_LT(last, 2e-3);
}

TEST(FieldContactOracle, FineMeshesPressAsTheirTriangles) {
  const ContactLaw law = elastic_law();
  const auto round = surface(ball(0.02, 6));
  const auto socket = surface(hollow(lattice_box({0.06, 0.06, 0.06}, 0.01), ball(0.0205, 6)));
  const auto ring = surface(torus(0.03, 0.006, 200, 80));
  const auto block = surface(lattice_box({0.1, 0.06, 0.05}, 0.01)),
             punch = surface(lattice_box({0.04, 0.04, 0.02}, 0.002));
  Pose hung;
  hung.R = Eigen::AngleAxisd(0.5 * kPi, Vec3::UnitX()).toRotationMatrix();
  hung.p = Vec3(0.06 - 2.0 * 0.006 + 0.0003, 0.0, 0.0);
  struct {
    const char* name;
    std::shared_ptr<const ContactSurface> base, target;
    Pose X;
    double spacing_m;
  } const pairs[] = {
      {"ball in a socket", round, socket, {Mat3::Identity(), Vec3(0.0, 3e-4, -9e-4)}, 0.0008},
      {"ring in ring", ring, ring, hung, 0.0005},
      {"ball on a block", round, block, {Mat3::Identity(), Vec3(0.001, 0.002, 0.045 - 5e-4)}, 0.002},
      {"tilted punch",
       punch,
       block,
       {Eigen::AngleAxisd(0.01, Vec3(1.0, 0.4, 0.0).normalized()).toRotationMatrix(),
        Vec3(0.001, 0.002, 0.035)},
       0.002},
  };
  for (const auto& p : pairs) {
    PolygonalContact triangles(p.base, p.target, law),
        field(p.base, p.target, law, field_of(p.target, p.spacing_m));
    const ContactResult a = evaluate(triangles, {p.X, {}}), b = evaluate(field, {p.X, {}});
    ASSERT_GT(a.elements, 0) << p.name;
    EXPECT_LT((a.F_B_T.f - b.F_B_T.f).norm(), 0.01 * a.F_B_T.f.norm()) << p.name;
    EXPECT_NEAR(a.elastic_energy_J, b.elastic_energy_J, 0.01 * a.elastic_energy_J) << p.name;
    EXPECT_LT((a.p_TC - b.p_TC).norm(), 2e-4) << p.name;
  }
}

TEST(FieldContactOracle, TheWrenchIsTheNegativeGradientOfTheEnergy) {
  for (const FieldScene& s : field_scenes()) {
    PolygonalContact contact(s.base, s.target, elastic_law(), s.field);
    Random random(17);
    int touched = 0;
    for (int i = 0; i < 25; ++i) {
      const Pose X = nudged(s, random);
      const ContactResult r = evaluate(contact, {X, {}});
      if (r.elements == 0) continue;
      ++touched;
      Vec6 gradient;
      for (int k = 0; k < 6; ++k) {
        constexpr double kStep = 1e-8;
        const auto energy = [&](double by) {
          return evaluate(contact, displaced({X, {}}, by * Vec6::Unit(k))).elastic_energy_J;
        };
        gradient[k] = (energy(kStep) - energy(-kStep)) / (2.0 * kStep);
      }
      const Vec6 F = stacked(r.F_B_T);
      EXPECT_LT((F + gradient).norm(), 1e-5 * F.norm()) << s.name << " pose " << i;
    }
    EXPECT_GT(touched, 15) << s.name;
  }
}

TEST(FieldContactOracle, TheTangentIsTheDerivativeOfTheForce) {
  for (const FieldScene& s : field_scenes())
    for (const bool damped : {false, true}) {
      ContactLaw law = elastic_law();
      if (damped) law.areal_damping_N_s_per_m3 = 2.5e5;
      PolygonalContact contact(s.base, s.target, law, s.field);
      Random random(31);
      for (int i = 0; i < 4; ++i) {
        RelativeMotion motion{nudged(s, random), {}};
        if (damped) motion.V_TB_T = {1e-3 * random.direction(), 1e-2 * random.direction()};
        ContactResult r;
        ContactJacobian j;
        contact.evaluate(motion, Linearisation::tangent, r, j);
        if (r.elements == 0) continue;
        Mat6 K;
        for (int k = 0; k < 6; ++k) {
          const Vec6 d = 1e-9 * Vec6::Unit(k);
          K.col(k) = (stacked(evaluate(contact, displaced(motion, d)).F_B_T) -
                      stacked(evaluate(contact, displaced(motion, -d)).F_B_T)) /
                     2e-9;
        }
        EXPECT_LT((j.K - K).norm(), 2e-3 * K.norm()) << s.name << " damped " << damped << "\n"
                                                     << j.K << "\n\n"
                                                     << K;
      }
    }
}

TEST(FieldContactOracle, TheSecantIsSymmetricAndNeverAddsEnergy) {
  for (const FrictionLaw friction_law : {FrictionLaw::regularised, FrictionLaw::stick})
    for (const FieldScene& s : field_scenes()) {
      ContactParameters parameters;
      parameters.friction_law = friction_law;
      PolygonalContact contact(s.base, s.target, contact_law(parameters), s.field);
      contact.accept({s.touching, {}});
      Random random(7);
      for (int i = 0; i < 4; ++i) {
        ContactResult r;
        ContactJacobian j;
        contact.evaluate({nudged(s, random), {0.02 * random.direction(), 0.2 * random.direction()}},
                         Linearisation::secant, r, j);
        for (const Mat6& m : {j.K, j.D}) {
          EXPECT_LE((m - m.transpose()).norm(), 1e-12 * m.norm());
          Eigen::SelfAdjointEigenSolver<Mat6> eigen(m, Eigen::EigenvaluesOnly);
          EXPECT_LE(eigen.eigenvalues().maxCoeff(), 1e-9 * m.norm()) << s.name;
        }
      }
    }
}

TEST(FieldContactOracle, DampingAndFrictionOnlyTakeEnergyOut) {
  ContactParameters parameters;
  parameters.friction = 0.5;
  for (const FieldScene& s : field_scenes()) {
    PolygonalContact real(s.base, s.target, contact_law(parameters), s.field),
        elastic(s.base, s.target, elastic_law(), s.field);
    Random random(41);
    for (int i = 0; i < 30; ++i) {
      const Pose X = nudged(s, random);
      const Twist V{random.log_uniform(1e-5, 1.0) * random.direction(),
                    random.log_uniform(1e-4, 10.0) * random.direction()};
      const ContactResult r = evaluate(real, {X, V}), e = evaluate(elastic, {X, V});
      const auto power = [&](const Wrench& F) { return F.f.dot(V.v) + (F.t - X.p.cross(F.f)).dot(V.w); };
      EXPECT_LE(power(r.F_B_T) - power(e.F_B_T), 1e-9 * (std::abs(power(r.F_B_T)) + std::abs(power(e.F_B_T))))
          << s.name;
    }
  }
}

/// Kinetic and elastic energy of a rigid ball that is thrown against a fixed ball without damping or friction: velocity
/// Verlet, which is of second order and does not drift where forces have a smooth potential.
double energy_drift(PolygonalContact& contact, Pose X, Vec3 v, double mass_kg, double step_s, int steps) {
  const auto force = [&](double& energy_J) {
    const ContactResult r = evaluate(contact, {X, {}});
    energy_J = r.elastic_energy_J;
    return r.F_B_T.f;
  };
  double elastic_J = 0.0, largest_J = 0.0;
  Vec3 f = force(elastic_J);
  const double start_J = 0.5 * mass_kg * v.squaredNorm() + elastic_J;
  for (int i = 0; i < steps; ++i) {
    v += 0.5 * step_s / mass_kg * f;
    X.p += step_s * v;
    f = force(elastic_J);
    v += 0.5 * step_s / mass_kg * f;
    largest_J = std::max(largest_J, elastic_J);
  }
  EXPECT_EQ(elastic_J, 0.0) << "still in contact";
  EXPECT_GT(largest_J, 0.1 * start_J) << "no bounce";
  return 0.5 * mass_kg * v.squaredNorm() / start_J - 1.0;
}

TEST(FieldContactOracle, AnElasticBounceKeepsTheEnergy) {
  const auto round = surface(ball(0.02, 4)), other = surface(ball(0.03, 4));
  PolygonalContact contact(round, other, elastic_law(), field_of(other, 0.0015));
  // Off centre, so that the direction turns on the way.
  const double drift = energy_drift(contact, {Mat3::Identity(), Vec3(0.012, 0.004, 0.0486)},
                                    {0.1, -0.2, -1.0}, 0.05, 1e-6, 9000);
  RecordProperty("drift_ppm", std::to_string(1e6 * drift));
  EXPECT_LT(std::abs(drift), 1e-5);
}

TEST(FieldContactOracle, ARoundBodyInARoundSeatHasNoTorqueWithoutFriction) {
  // Of a ball in a socket, and of a cylinder in a groove about its axis. Facets push beside the centre: smooth normals do so
  // less than triangles.
  const ContactLaw law = elastic_law();
  const auto round = surface(ball(0.02, 5));
  const auto socket = surface(hollow(lattice_box({0.06, 0.06, 0.06}, 0.01), ball(0.0205, 3)));
  const auto cylinder = surface(prism(0.02, 0.03, 360, false), 0.002);
  const auto groove = surface(hollow(lattice_box({0.06, 0.06, 0.06}, 0.01), prism(0.0205, 0.04, 48, false)));
  struct {
    const char* name;
    std::shared_ptr<const ContactSurface> base, target;
    Vec3 axis;
    double spacing_m;
  } const seats[] = {{"socket", round, socket, Vec3::Zero(), 0.004},
                     {"groove", cylinder, groove, Vec3::UnitZ(), 0.004}};
  for (const auto& seat : seats) {
    PolygonalContact triangles(seat.base, seat.target, law),
        field(seat.base, seat.target, law, field_of(seat.target, seat.spacing_m));
    double of_triangles = 0.0, of_field = 0.0;
    for (int i = 0; i < 24; ++i) {
      const double angle = 0.3 + 0.261 * i;
      const Vec3 p = 7e-4 * Vec3(std::cos(angle), std::sin(angle), 0.0);
      const auto lever = [&](PolygonalContact& contact) {
        const Wrench F = evaluate(contact, at_rest(p)).F_B_T;
        const Vec3 t = F.t - p.cross(F.f);
        EXPECT_GT(F.f.norm(), 1.0) << seat.name;
        return (seat.axis.norm() > 0.0 ? std::abs(seat.axis.dot(t)) : t.norm()) / F.f.norm();
      };
      of_triangles = std::max(of_triangles, lever(triangles));
      of_field = std::max(of_field, lever(field));
    }
    RecordProperty(std::string(seat.name) + "_lever_um", std::to_string(1e6 * of_triangles) + " triangles, " +
                                                             std::to_string(1e6 * of_field) + " field");
    EXPECT_LT(of_field, 0.5 * of_triangles) << seat.name;
    EXPECT_LT(of_field, 1e-3 * 0.02 * 5.0) << seat.name;
  }
}

TEST(FieldContactOracle, ForcesDoNotDependOnEarlierQueriesAndAreFinite) {
  for (const FrictionLaw friction_law : {FrictionLaw::regularised, FrictionLaw::stick})
    for (const FieldScene& s : field_scenes()) {
      ContactParameters parameters;
      parameters.friction_law = friction_law;
      const ContactLaw law = contact_law(parameters);
      PolygonalContact kept(s.base, s.target, law, s.field);
      Random random(11);
      for (int i = 0; i < 25; ++i) {
        RelativeMotion motion{nudged(s, random), {0.1 * random.direction(), random.direction()}};
        if (i % 5 == 4) motion.X_TB.p += random.log_uniform(1e-3, 0.1) * random.direction();
        PolygonalContact fresh(s.base, s.target, law, s.field);
        fresh.restore(kept.save());
        ContactResult a, b;
        ContactJacobian ja, jb;
        const Linearisation linearisation = i % 2 == 0 ? Linearisation::tangent : Linearisation::secant;
        kept.evaluate(motion, linearisation, a, ja);
        fresh.evaluate(motion, linearisation, b, jb);
        ASSERT_EQ(stacked(a.F_B_T), stacked(b.F_B_T)) << s.name << " pose " << i;
        ASSERT_EQ(ja.K, jb.K);
        ASSERT_EQ(ja.D, jb.D);
        ASSERT_TRUE(stacked(a.F_B_T).allFinite() && ja.K.allFinite() && ja.D.allFinite());
        if (i % 3 == 0) kept.accept(motion);
      }
    }
}

TEST(FieldContactOracle, SpringsOfTheStickLawHoldAPunchUpToFriction) {
  // Pushed sideways by d, all elements stick: F = k_t A d, up to mu F_n.
  ContactParameters parameters;
  parameters.friction_law = FrictionLaw::stick;
  parameters.areal_damping_N_s_per_m3 = 0.0;
  const ContactLaw law = contact_law(parameters);
  const auto punch = surface(lattice_box({0.04, 0.04, 0.03}, 0.005)), floor = surface(floor_mesh());
  PolygonalContact contact(punch, floor, law, field_of(floor, 0.003));
  const double u = 1e-5, area = 0.04 * 0.04, normal = law.stiffness_Pa_per_m * area * u;
  contact.accept(at_rest({0.0, 0.0, 0.015 - u}));
  for (const double d : {1e-7, 1e-6, 1e-4}) {
    const double expected = std::min(law.tangential_stiffness_Pa_per_m * area * d, law.friction * normal);
    EXPECT_NEAR(evaluate(contact, at_rest({d, 0.0, 0.015 - u})).F_B_T.f.x(), -expected, 2e-3 * expected) << d;
  }
}

}  // namespace
}  // namespace takt::test
