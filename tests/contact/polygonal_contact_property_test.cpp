// Laws that contact between any two meshes obeys.
#include "server/contact/surface/polygonal_contact.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>

#include "server/geometry/mesh/import.h"
#include "tests/support/contact_pairs.h"
#include "tests/support/effort.h"
#include "tests/support/random_shapes.h"

namespace takt {
namespace {

using test::at_rest;
using test::evaluate;
using test::frictionless_law;
using test::Random;
using test::stacked;
using test::surface;
using Vec6 = Eigen::Matrix<double, 6, 1>;

std::shared_ptr<const ContactSurface> part(const char* name) {
  return surface(import_solid(std::string(TAKT_CONFIG_DIR "/meshes/") + name + ".obj"));
}

ContactLaw law_of(FrictionLaw friction_law) {
  ContactParameters parameters;
  parameters.friction_law = friction_law;
  return contact_law(parameters);
}

struct Scene {
  const char* name;
  std::shared_ptr<const ContactSurface> base, target;
  Pose touching;  ///< slightly pressed
};

const std::vector<Scene>& scenes() {
  static const std::vector<Scene> made = [] {
    const auto B = part("B"), C = part("C"), O = part("O"), P = part("P"), jaw = part("gripper_jaw");
    std::vector<Scene> list;
    list.push_back({"C in the pocket of B", C, B, {Mat3::Identity(), Vec3(-0.06, 0.0, 0.02 - 3e-6)}});
    list.push_back(
        {"P at the wall of O", P, O, {Mat3::Identity(), Vec3(0.015 + 0.0005 + 3e-6, 0.0, 0.03 - 3e-6)}});
    list.push_back({"jaw on C", jaw, C, {Mat3::Identity(), Vec3(0.0, 0.0395 - 3e-6, -0.04)}});
    list.push_back({"B on the table", B, part("table"), {Mat3::Identity(), Vec3(0.1, 0.0, -3e-6)}});
    // The ring's tube lies in the hook's, at a right angle.
    Pose hung;
    hung.R = Eigen::AngleAxisd(0.5 * std::numbers::pi, Vec3::UnitX()).toRotationMatrix();
    hung.p = Vec3(0.03 + 0.03 - 2.0 * 0.006 + 0.0003, 0.0, 0.0);
    list.push_back({"ring in ring", surface(test::torus(0.03, 0.006, 96, 32)),
                    surface(test::torus(0.03, 0.006, 96, 32)), hung});
    list.push_back({"ball in a socket",
                    surface(test::ball(0.02, 4)),
                    surface(test::hollow(test::lattice_box({0.06, 0.06, 0.06}, 0.01), test::ball(0.0205, 4))),
                    {Mat3::Identity(), Vec3(0.0, 0.0003, -0.0006)}});
    return list;
  }();
  return made;
}

Pose nudged(const Pose& X, Random& random, double shift_m, double turn_rad) {
  const Mat3 turn =
      Eigen::AngleAxisd(random.uniform(-turn_rad, turn_rad), random.direction()).toRotationMatrix();
  return {turn * X.R, X.p + random.uniform(0.0, shift_m) * random.direction()};
}

Twist some_twist(Random& random, double v, double w) {
  return {random.uniform(0.0, v) * random.direction(), random.uniform(0.0, w) * random.direction()};
}

TEST(PolygonalContactLaws, EveryPairOfMeshesTouches) {
  for (const Scene& s : scenes()) {
    PolygonalContact contact(s.base, s.target, law_of(FrictionLaw::regularised));
    EXPECT_GT(evaluate(contact, {s.touching, {}}).elements, 0) << s.name;
  }
}

TEST(PolygonalContactLaws, ForcesDoNotDependOnEarlierQueries) {
  // One object along a path, its candidate lists kept, against a new one at every pose: the same bits.
  for (const FrictionLaw friction_law : {FrictionLaw::regularised, FrictionLaw::stick})
    for (const Scene& s : scenes()) {
      Random random(11);
      PolygonalContact kept(s.base, s.target, law_of(friction_law));
      Pose X = s.touching;
      int touched = 0;
      const int poses = s.base->element_count() > 5000 ? 40 : 120;
      for (int i = 0; i < poses; ++i) {
        // Steps of all sizes, now and then back to the beginning.
        X = i % 20 == 0 ? s.touching
                        : nudged(X, random, random.log_uniform(1e-8, 2e-3), random.log_uniform(1e-7, 2e-2));
        const RelativeMotion motion{X, some_twist(random, 0.1, 1.0)};
        PolygonalContact fresh(s.base, s.target, law_of(friction_law));
        fresh.restore(kept.save());
        ContactResult a, b;
        ContactJacobian ja, jb;
        const Linearisation linearisation = i % 2 == 0 ? Linearisation::tangent : Linearisation::secant;
        kept.evaluate(motion, linearisation, a, ja);
        fresh.evaluate(motion, linearisation, b, jb);
        ASSERT_EQ(stacked(a.F_B_T), stacked(b.F_B_T)) << s.name << " pose " << i;
        ASSERT_EQ(a.area_m2, b.area_m2);
        ASSERT_EQ(a.elements, b.elements);
        ASSERT_EQ(ja.K, jb.K) << s.name << " pose " << i;
        ASSERT_EQ(ja.D, jb.D);
        touched += a.elements > 0 ? 1 : 0;
        if (i % 3 == 0) kept.accept(motion);
      }
      EXPECT_GT(touched, poses / 4) << s.name;
      EXPECT_LT(kept.counts().rebuilds, kept.counts().evaluations);
    }
}

TEST(PolygonalContactLaws, OneListServesManyStepsWithTheAdaptedBound) {
  const Scene& s = scenes()[0];
  Random random(5);
  PolygonalContact kept(s.base, s.target, law_of(FrictionLaw::regularised));
  for (int i = 0; i < 3000; ++i) {
    const RelativeMotion motion{nudged(s.touching, random, 5e-6, 1e-6), {}};
    const ContactResult a = evaluate(kept, motion);
    if (i % 250 != 0) continue;
    PolygonalContact fresh(s.base, s.target, law_of(FrictionLaw::regularised));
    ASSERT_EQ(stacked(a.F_B_T), stacked(evaluate(fresh, motion).F_B_T)) << i;
  }
  EXPECT_LT(kept.counts().rebuilds, 10u);
}

TEST(PolygonalContactLaws, ForcesAreFrameInvariant) {
  // Both meshes drawn in other frames: the wrench is the same one.
  Random random(3);
  const TriangleMesh ball = test::ball(0.02, 4), block = test::lattice_box({0.1, 0.1, 0.05}, 0.02);
  const Pose X{random.rotation(), Vec3(0.003, 0.004, 0.025 + 0.02 - 2e-4)};
  const Twist V = some_twist(random, 0.05, 2.0);
  PolygonalContact plain(surface(ball), surface(block), law_of(FrictionLaw::regularised));
  const ContactResult expected = evaluate(plain, {X, V});
  ASSERT_GT(expected.elements, 5);
  for (int i = 0; i < 20; ++i) {
    const Pose X_TU{random.rotation(), random.uniform(0.0, 0.3) * random.direction()};
    const Pose X_BC{random.rotation(), random.uniform(0.0, 0.3) * random.direction()};
    PolygonalContact contact(surface(test::moved(ball, X_BC.inverse())),
                             surface(test::moved(block, X_TU.inverse())), law_of(FrictionLaw::regularised));
    const Pose X_UT = X_TU.inverse();
    const RelativeMotion motion{X_UT * X * X_BC, {X_UT.R * V.at(X.R * X_BC.p), X_UT.R * V.w}};
    const ContactResult r = evaluate(contact, motion);
    const Vec3 f = X_TU.R * r.F_B_T.f, t = X_TU.R * r.F_B_T.t + X_TU.p.cross(f);
    EXPECT_LT((f - expected.F_B_T.f).norm(), 1e-9 * expected.F_B_T.f.norm());
    EXPECT_LT((t - expected.F_B_T.t).norm(), 1e-9 * expected.F_B_T.f.norm());
  }
}

TEST(PolygonalContactLaws, BaseAndTargetMayBeSwapped) {
  struct Case {
    const char* name;
    TriangleMesh a, b;
    Pose X_BA;
  };
  // Conforming contact of unrelated meshes.
  const Case cases[] = {
      {"ball in a socket",
       test::ball(0.02, 6),
       test::hollow(test::lattice_box({0.06, 0.06, 0.06}, 0.01),
                    test::moved(test::ball(0.0202, 6),
                                {Eigen::AngleAxisd(0.4, Vec3(1.0, 2.0, 0.5).normalized()).toRotationMatrix(),
                                 Vec3::Zero()})),
       {Mat3::Identity(), Vec3(1e-4, 2e-4, -3e-4)}},
      {"block on block",
       test::lattice_box({0.06, 0.05, 0.03}, 0.0011),
       test::lattice_box({0.08, 0.07, 0.03}, 0.0017),
       {Eigen::AngleAxisd(0.3, Vec3::UnitZ()).toRotationMatrix(), Vec3(0.004, 0.003, 0.03 - 1e-5)}},
      {"block over the rim",
       test::lattice_box({0.06, 0.05, 0.03}, 0.0011),
       test::lattice_box({0.08, 0.07, 0.03}, 0.0017),
       {Eigen::AngleAxisd(0.3, Vec3::UnitZ()).toRotationMatrix(), Vec3(0.034, 0.003, 0.03 - 1e-5)}}};
  for (const Case& c : cases) {
    const auto a = surface(c.a), b = surface(c.b);
    PolygonalContact one(a, b, frictionless_law()), two(b, a, frictionless_law());
    const ContactResult r1 = evaluate(one, {c.X_BA, {}}), r2 = evaluate(two, {c.X_BA.inverse(), {}});
    // On a, about the origin of b, axes of b, from both.
    const Vec3 f = -(c.X_BA.R * r2.F_B_T.f);
    const Vec3 t = -(c.X_BA.R * r2.F_B_T.t) + c.X_BA.p.cross(f);
    EXPECT_GT(r1.F_B_T.f.norm(), 1.0) << c.name;
    EXPECT_LT((f - r1.F_B_T.f).norm(), 0.02 * r1.F_B_T.f.norm()) << c.name;
    EXPECT_LT((t - r1.F_B_T.t).norm(), 0.02 * 0.06 * r1.F_B_T.f.norm()) << c.name;
  }
}

TEST(PolygonalContactLaws, RefinedMeshesConverge) {
  // A tilted punch over the rim of a block: elements partly over the edge, others in the wedge that opens.
  const TriangleMesh punch = test::lattice_box({0.04, 0.04, 0.02}, std::array<int, 3>{1, 1, 1});
  const auto block = surface(test::lattice_box({0.1, 0.06, 0.05}, 0.02));
  const Mat3 R = Eigen::AngleAxisd(3e-4, Vec3(1.0, 2.0, 0.4).normalized()).toRotationMatrix();
  const auto finest = surface(punch, 0.0004);
  const auto error_of = [&](double edge) {
    PolygonalContact contact(surface(punch, edge), block, frictionless_law());
    PolygonalContact reference(finest, block, frictionless_law());
    // Over many places: where the rim cuts the elements is luck.
    double sum = 0.0;
    for (int i = 0; i < 20; ++i) {
      const RelativeMotion motion = at_rest({0.043 - 0.0005 * i, 0.001, 0.035 - 1e-5}, R);
      const Vec6 exact = stacked(evaluate(reference, motion).F_B_T);
      sum += (stacked(evaluate(contact, motion).F_B_T) - exact).norm() / exact.norm();
    }
    return sum / 20.0;
  };
  double last = 1e9;
  for (const double edge : {0.008, 0.004, 0.002, 0.001}) {
    const double error = error_of(edge);
    EXPECT_LT(error, 0.7 * last) << edge;
    last = error;
  }
  EXPECT_LT(last, 0.01);
}

/// Differences of the wrench along each direction of displacement and velocity.
void expect_derivative(PolygonalContact& contact, const RelativeMotion& motion, double tolerance,
                       const char* name) {
  ContactResult r;
  ContactJacobian j;
  contact.evaluate(motion, Linearisation::tangent, r, j);
  ASSERT_GT(r.elements, 0) << name;
  Mat6 K, D;
  for (int k = 0; k < 6; ++k) {
    const double step = 1e-9;
    const Vec6 d = step * Vec6::Unit(k);
    K.col(k) = (stacked(evaluate(contact, test::displaced(motion, d)).F_B_T) -
                stacked(evaluate(contact, test::displaced(motion, -d)).F_B_T)) /
               (2.0 * step);
    const double dv = 1e-7;
    const auto with = [&](double by) {
      RelativeMotion m = motion;
      const Vec3 w = by * Vec6::Unit(k).tail<3>();
      m.V_TB_T.w += w;
      m.V_TB_T.v += by * Vec6::Unit(k).head<3>() + w.cross(m.X_TB.p);
      return stacked(evaluate(contact, m).F_B_T);
    };
    D.col(k) = (with(dv) - with(-dv)) / (2.0 * dv);
  }
  EXPECT_LT((j.K - K).norm(), tolerance * K.norm()) << name << "\n" << j.K << "\n\n" << K;
  EXPECT_LT((j.D - D).norm(), tolerance * D.norm()) << name << "\n" << j.D << "\n\n" << D;
}

TEST(PolygonalContactLaws, TheTangentIsTheDerivativeOfTheForce) {
  const auto block = surface(test::lattice_box({0.1, 0.06, 0.05}, 0.02));
  const auto punch = surface(test::lattice_box({0.04, 0.04, 0.02}, 0.005)),
             ball = surface(test::ball(0.02, 5));
  const auto socket =
      surface(test::hollow(test::lattice_box({0.06, 0.06, 0.06}, 0.01), test::ball(0.0205, 3)));
  const Mat3 tilt = Eigen::AngleAxisd(1e-4, Vec3(1.0, 2.0, 0.3).normalized()).toRotationMatrix();
  const Twist sliding{Vec3(0.02, -0.01, -1e-3), Vec3(0.1, -0.2, 0.3)};
  const Twist slow{Vec3(2e-4, -1e-4, -1e-4), Vec3(1e-3, -2e-3, 3e-3)};
  const RelativeMotion flat{{tilt, Vec3(0.003, 0.002, 0.035 - 2e-5)}, {}},
      over_rim{{tilt, Vec3(0.0337, 0.002, 0.035 - 2e-5)}, {}};
  const RelativeMotion round{{Mat3::Identity(), Vec3(0.001, 0.002, 0.045 - 3e-4)}, {}};
  const RelativeMotion inside{{Mat3::Identity(), Vec3(0.0, 3e-4, -7e-4)}, {}};
  const auto moving = [](RelativeMotion m, const Twist& V) {
    m.V_TB_T = V;
    return m;
  };
  PolygonalContact smooth(punch, block, frictionless_law()),
      rough(punch, block, law_of(FrictionLaw::regularised));
  expect_derivative(smooth, flat, 1e-6, "flat");
  expect_derivative(smooth, moving(flat, sliding), 1e-6, "flat, moving");
  expect_derivative(smooth, moving(over_rim, slow), 1e-5, "over the rim");
  expect_derivative(rough, moving(flat, sliding), 1e-3, "sliding");
  expect_derivative(rough, moving(flat, slow), 1e-3, "slow");
  PolygonalContact rolling(ball, block, law_of(FrictionLaw::regularised)),
      held(ball, socket, law_of(FrictionLaw::regularised));
  expect_derivative(rolling, moving(round, slow), 2e-3, "ball");
  expect_derivative(held, moving(inside, slow), 2e-3, "ball in a socket");
  // Thin contact: damping grows with penetration.
  RelativeMotion thin = flat;
  thin.X_TB.R.setIdentity();
  thin.X_TB.p.z() = 0.035 - 1e-6;
  expect_derivative(smooth, moving(thin, slow), 1e-5, "thin");
  // Stick: sticking, then slipping.
  PolygonalContact tied(punch, block, law_of(FrictionLaw::stick));
  tied.accept(flat);
  RelativeMotion stretched = moving(flat, {Vec3(1e-5, 0.0, -1e-5), Vec3::Zero()});
  stretched.X_TB.p.x() += 1e-6;
  expect_derivative(tied, stretched, 1e-3, "sticking");
  stretched.X_TB.p.y() += 2e-5;
  expect_derivative(tied, stretched, 1e-3, "slipping");
}

TEST(PolygonalContactLaws, TheSecantIsSymmetricAndNeverAddsEnergy) {
  for (const FrictionLaw friction_law : {FrictionLaw::regularised, FrictionLaw::stick})
    for (const Scene& s : scenes()) {
      Random random(7);
      PolygonalContact contact(s.base, s.target, law_of(friction_law));
      contact.accept({s.touching, {}});
      for (int i = 0; i < 5; ++i) {
        ContactResult r;
        ContactJacobian j;
        contact.evaluate({nudged(s.touching, random, 2e-6, 1e-6), some_twist(random, 0.02, 0.2)},
                         Linearisation::secant, r, j);
        for (const Mat6& m : {j.K, j.D}) {
          EXPECT_LE((m - m.transpose()).norm(), 1e-12 * m.norm());
          Eigen::SelfAdjointEigenSolver<Mat6> eigen(m, Eigen::EigenvaluesOnly);
          EXPECT_LE(eigen.eigenvalues().maxCoeff(), 1e-9 * m.norm()) << s.name;
        }
      }
    }
}

TEST(PolygonalContactLaws, SecantAndTangentHaveTheSameNormalPartOnAFlatPunch) {
  const ContactLaw law = frictionless_law();
  PolygonalContact contact(surface(test::lattice_box({0.04, 0.04, 0.02}, 0.005)), surface(test::floor_mesh()),
                           law);
  ContactResult r;
  ContactJacobian j;
  contact.evaluate(at_rest({0.0, 0.0, 0.01 - 1e-5}), Linearisation::secant, r, j);
  EXPECT_NEAR(j.K(2, 2), -law.stiffness_Pa_per_m * 0.0016, 1e-6 * law.stiffness_Pa_per_m * 0.0016);
  EXPECT_NEAR(j.D(2, 2), -law.areal_damping_N_s_per_m3 * 0.0016,
              1e-6 * law.areal_damping_N_s_per_m3 * 0.0016);
  EXPECT_NEAR(j.K(0, 0), 0.0, 1e-6);
}

TEST(PolygonalContactLaws, EnergyIsContinuousOverARim) {
  // A punch slides off a block under constant penetration. Within the penetration of the side its elements
  // return their energy by a push off the block: the released energy is the work of the sideways force.
  const auto punch = surface(test::lattice_box({0.03, 0.03, 0.02}, 0.005));
  const auto block = surface(test::lattice_box({0.1, 0.06, 0.05}, std::array<int, 3>{1, 1, 1}));
  const ContactLaw law = frictionless_law();
  for (const double angle : {0.0, 0.2}) {
    PolygonalContact contact(punch, block, law);
    const Mat3 R = Eigen::AngleAxisd(angle, Vec3::UnitZ()).toRotationMatrix();
    const double u = 1e-5, full = 0.5 * law.stiffness_Pa_per_m * 9e-4 * u * u, step = 1e-6;
    ContactResult last = evaluate(contact, at_rest({0.025, 0.0, 0.035 - u}, R));
    EXPECT_NEAR(last.elastic_energy_J, full, 1e-6 * full);
    double largest = 0.0, work = 0.0;
    for (int i = 1; i <= 55000; ++i) {
      const ContactResult r = evaluate(contact, at_rest({0.025 + i * step, 0.0, 0.035 - u}, R));
      largest = std::max(largest, std::abs(r.elastic_energy_J - last.elastic_energy_J));
      work += 0.5 * (r.F_B_T.f.x() + last.F_B_T.f.x()) * step;
      last = r;
    }
    // A column of 12 of the 72 elements leaves within u.
    EXPECT_LT(largest, 12.0 / 72.0 * full * 2.0 * step / u) << angle;
    EXPECT_EQ(last.elastic_energy_J, 0.0);
    EXPECT_NEAR(work, full, 0.02 * full) << angle;
  }
}

TEST(PolygonalContactLaws, EveryResultIsFinite) {
  Random random(23);
  const ContactLaw laws[] = {law_of(FrictionLaw::regularised), law_of(FrictionLaw::stick)};
  std::vector<PolygonalContact> contacts;
  std::vector<const Scene*> from;
  for (const Scene& s : scenes())
    for (const ContactLaw& law : laws) {
      if (s.base->element_count() > 5000) continue;
      contacts.emplace_back(s.base, s.target, law);
      from.push_back(&s);
    }
  // Close to each other so that lists are used again: groups of poses around one.
  const int groups = 200;
  const int least = 10'000 * static_cast<int>(test::effort());
  const int poses = least / (groups * static_cast<int>(contacts.size())) + 1;
  int touched = 0, total = 0;
  for (std::size_t c = 0; c < contacts.size(); ++c)
    for (int g = 0; g < groups; ++g) {
      Pose X = from[c]->touching;
      if (g % 3 != 0) X = {random.rotation(), random.log_uniform(1e-4, 0.3) * random.direction()};
      if (g % 17 == 0) X.p *= 1e6;
      for (int i = 0; i < poses; ++i, ++total) {
        const RelativeMotion motion{nudged(X, random, 2e-4, 1e-3), some_twist(random, 2.0, 20.0)};
        ContactResult r;
        ContactJacobian j;
        contacts[c].evaluate(motion, i % 2 == 0 ? Linearisation::tangent : Linearisation::secant, r, j);
        if (i % 5 == 0) contacts[c].accept(motion);
        ASSERT_TRUE(
            stacked(r.F_B_T).allFinite() && j.K.allFinite() && j.D.allFinite() && r.p_TC.allFinite() &&
            std::isfinite(r.area_m2 + r.largest_pressure_Pa + r.largest_penetration_m + r.friction_force_N));
        touched += r.elements > 0 ? 1 : 0;
      }
    }
  EXPECT_GE(total, least);
  EXPECT_GT(touched, total / 5);
}

TEST(PolygonalContactLaws, APoseThatIsNotFiniteIsNoContact) {
  const Scene& s = scenes()[0];
  PolygonalContact contact(s.base, s.target, law_of(FrictionLaw::regularised));
  RelativeMotion motion{s.touching, {}};
  motion.X_TB.p.x() = std::nan("");
  EXPECT_EQ(evaluate(contact, motion).elements, 0);
  motion.X_TB.p.x() = INFINITY;
  EXPECT_EQ(evaluate(contact, motion).elements, 0);
  EXPECT_GT(evaluate(contact, {s.touching, {}}).elements, 0);
}

TEST(PolygonalContactLaws, APegWithAMicrometreOfClearanceTouchesItsWallsOnly) {
  // A square peg in a pocket of a block, 1 um on every side; the pocket is a hollow that its top face closes.
  const TriangleMesh hole = test::lattice_box({0.02 + 2e-6, 0.02 + 2e-6, 0.04}, 0.004);
  const auto block = surface(test::hollow(test::lattice_box({0.06, 0.06, 0.06}, 0.01), hole));
  const auto peg = surface(test::lattice_box({0.02, 0.02, 0.03}, 0.0025));
  const ContactLaw law = law_of(FrictionLaw::regularised);
  PolygonalContact contact(peg, block, law);
  EXPECT_EQ(evaluate(contact, at_rest({0.0, 0.0, 0.0})).elements, 0);
  EXPECT_EQ(evaluate(contact, at_rest({9.9e-7, -9.9e-7, 0.0})).elements, 0);
  // 1 um into a wall.
  const double force = law.stiffness_Pa_per_m * 0.02 * 0.03 * 1e-6;
  const ContactResult r = evaluate(contact, at_rest({2e-6, 0.0, 0.001}));
  EXPECT_NEAR(r.F_B_T.f.x(), -force, 1e-6 * force);
  EXPECT_NEAR(r.F_B_T.f.tail<2>().norm(), 0.0, 1e-9 * force);
}

TEST(PolygonalContactLaws, InterlockedRingsHoldEachOther) {
  // Pulled apart the force grows against the pull; free in between and far away.
  const Scene& s = scenes()[4];
  PolygonalContact contact(s.base, s.target, frictionless_law());
  const auto pulled = [&](double by) {
    Pose X = s.touching;
    X.p.x() += by;
    return evaluate(contact, {X, {}});
  };
  EXPECT_EQ(pulled(-0.01).elements, 0);
  EXPECT_EQ(pulled(0.2).elements, 0);
  const double f1 = pulled(0.0).F_B_T.f.x(), f2 = pulled(2e-4).F_B_T.f.x();
  EXPECT_LT(f1, -0.1);
  EXPECT_LT(f2, 1.5 * f1);
}

}  // namespace
}  // namespace takt
