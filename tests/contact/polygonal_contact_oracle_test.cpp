// Forces of the Polygonal Contact Model against closed forms.
#include "server/contact/surface/polygonal_contact.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/contact_pairs.h"

namespace takt {
namespace {

using test::at_rest;
using test::evaluate;
using test::frictionless_law;
using test::stacked;
using test::surface;

constexpr double kSide = 0.04, kHeight = 0.03;

TriangleMesh punch() {
  return test::lattice_box({kSide, kSide, kHeight}, 0.005);
}

/// Its bottom at -u.
RelativeMotion pressed(double u) {
  return at_rest({0.013, -0.021, 0.5 * kHeight - u});
}

TEST(PolygonalContact, TheForceOfAFlatPunchIsStiffnessTimesAreaTimesPenetration) {
  const ContactLaw law = contact_law({});
  // (2.17): nu = 0.3 gives K = 0.7 / (1.3 * 0.4) E.
  ASSERT_NEAR(law.stiffness_Pa_per_m, 0.7 / 0.52 * 1e6 / 0.001, 1.0);
  PolygonalContact contact(surface(punch()), surface(test::floor_mesh()), law);
  // Down to where the centroids of the sides come in, 1.7 mm above the bottom.
  for (const double u : {1e-7, 2e-6, 1e-4, 1.5e-3}) {
    const ContactResult r = evaluate(contact, pressed(u));
    const double force = law.stiffness_Pa_per_m * kSide * kSide * u;
    EXPECT_NEAR(r.F_B_T.f.z(), force, 1e-6 * force) << u;
    EXPECT_NEAR(r.F_B_T.f.head<2>().norm(), 0.0, 1e-9 * force);
    EXPECT_EQ(r.elements, 128);
    EXPECT_NEAR(r.area_m2, kSide * kSide, 1e-12);
    EXPECT_NEAR(r.normal_force_N, force, 1e-6 * force);
    EXPECT_NEAR(r.largest_penetration_m, u, 1e-9 * u + 1e-16);
    EXPECT_NEAR(r.largest_pressure_Pa, law.stiffness_Pa_per_m * u, 1e-6 * law.stiffness_Pa_per_m * u);
    EXPECT_LT((r.p_TC - Vec3(0.013, -0.021, -u)).norm(), 1e-12);
    // The moment about the origin of T is that of a force through the middle of the punch.
    EXPECT_LT((r.F_B_T.t - Vec3(0.013, -0.021, 0.0).cross(r.F_B_T.f)).norm(), 1e-9 * force);
  }
  EXPECT_EQ(evaluate(contact, pressed(-1e-9)).elements, 0);
  EXPECT_EQ(evaluate(contact, pressed(-0.2)).elements, 0);
}

TEST(PolygonalContact, APunchAsLargeAsItsTargetKeepsItsAreaOnAverage) {
  // Both sides end at the same place.
  const auto top = test::lattice_box({kSide, kSide, kHeight}, 0.01);
  const ContactLaw law = frictionless_law();
  PolygonalContact contact(surface(punch()), surface(top), law);
  const double u = 1e-5, full = law.stiffness_Pa_per_m * kSide * kSide * u;
  const ContactResult flush = evaluate(contact, at_rest({0.0, 0.0, kHeight - u}));
  EXPECT_NEAR(flush.F_B_T.f.z(), full, 0.03 * full);
  // Over all offsets within one element: the covered part of the punch.
  double sum = 0.0, covered = 0.0;
  const int steps = 200;
  for (int i = 0; i < steps; ++i) {
    const double shift = 0.01 + 0.005 * (i + 0.5) / steps;
    sum += evaluate(contact, at_rest({shift, 0.0, kHeight - u})).F_B_T.f.z();
    covered += full * (kSide - shift) / kSide;
  }
  EXPECT_NEAR(sum, covered, 0.02 * covered);
}

TEST(PolygonalContact, ABallOnALayerConvergesToTheClosedForm) {
  // Winkler: p = K/b (delta - r^2 / 2R) gives F = pi K R delta^2 / b for delta << R (Johnson 1985, 4.3).
  const double radius = 0.05, delta = 0.0005;
  const ContactLaw law = frictionless_law();
  const double force = std::numbers::pi * law.stiffness_Pa_per_m * radius * delta * delta;
  double last = 1e9;
  for (const double edge : {0.004, 0.002, 0.001}) {
    PolygonalContact contact(surface(test::ball(radius, edge > 0.003    ? 5
                                                        : edge > 0.0015 ? 6
                                                                        : 7)),
                             surface(test::floor_mesh()), law);
    // The facets lie inside the sphere; the mean over turns removes the luck of where they end.
    double sum = 0.0;
    for (int i = 0; i < 10; ++i) {
      const Mat3 R =
          Eigen::AngleAxisd(0.1 + 0.2 * i, Vec3(1.0, 0.3 * i, 0.5).normalized()).toRotationMatrix();
      sum += evaluate(contact, at_rest({0.0, 0.0, radius - delta}, R)).F_B_T.f.z();
    }
    const double error = std::abs(sum / 10.0 / force - 1.0);
    EXPECT_LT(error, 0.6 * last) << edge;
    last = error;
  }
  EXPECT_LT(last, 0.02);
}

TEST(PolygonalContact, ABallAsTargetGivesTheSameForce) {
  const double radius = 0.05, delta = 0.0005;
  const ContactLaw law = frictionless_law();
  const double force = std::numbers::pi * law.stiffness_Pa_per_m * radius * delta * delta;
  PolygonalContact contact(surface(test::moved(test::lattice_box({0.04, 0.04, 0.02}, 0.0005),
                                               {Mat3::Identity(), Vec3(0.0, 0.0, -0.01)})),
                           surface(test::ball(radius, 7)), law);
  const ContactResult r = evaluate(contact, at_rest({0.0001, 0.0002, -(radius - delta)}));
  EXPECT_NEAR(r.F_B_T.f.z(), -force, 0.02 * force);
}

TEST(PolygonalContact, DampingGrowsWithPenetrationAndNeverPulls) {
  // (2.19), (2.20)
  const ContactLaw law = frictionless_law();
  PolygonalContact contact(surface(punch()), surface(test::floor_mesh()), law);
  const double area = kSide * kSide;
  for (const double u : {0.2 * law.damping_depth_m, law.damping_depth_m, 5.0 * law.damping_depth_m})
    for (const double approach : {-1.0, -0.1, -1e-3, 0.0, 1e-3, 0.1, 1.0}) {
      RelativeMotion motion = pressed(u);
      motion.V_TB_T.v.z() = -approach;
      const double elastic = law.stiffness_Pa_per_m * area * u;
      const double damping =
          law.areal_damping_N_s_per_m3 * area * approach * std::min(1.0, u / law.damping_depth_m);
      const double force = std::max(0.0, elastic + damping);
      const ContactResult r = evaluate(contact, motion);
      EXPECT_NEAR(r.F_B_T.f.z(), force, 1e-6 * (elastic + std::abs(damping))) << u << " " << approach;
      EXPECT_EQ(r.elements, force > 0.0 ? 128 : 0);
    }
}

TEST(PolygonalContact, FrictionIsRegularised) {
  // (2.21)
  const ContactLaw law = contact_law({});
  PolygonalContact contact(surface(punch()), surface(test::floor_mesh()), law);
  const double u = 1e-5, normal = law.stiffness_Pa_per_m * kSide * kSide * u,
               v_eps = law.friction_velocity_m_per_s;
  const Vec3 along = Vec3(3.0, -4.0, 0.0) / 5.0;
  for (const double share : {0.0, 1e-6, 0.25, 0.5, 0.999, 1.0, 1.001, 10.0, 1000.0}) {
    RelativeMotion motion = pressed(u);
    motion.V_TB_T.v = share * v_eps * along;
    const double expected = law.friction * normal * (share < 1.0 ? share * (2.0 - share) : 1.0);
    const ContactResult r = evaluate(contact, motion);
    EXPECT_LT((r.F_B_T.f - Vec3(0.0, 0.0, normal) + expected * along).norm(), 1e-6 * normal) << share;
    EXPECT_NEAR(r.friction_force_N, expected, 1e-6 * normal);
  }
}

TEST(PolygonalContact, ATurningPunchHasTheMomentOfFriction) {
  // Every point slides: M = mu p times the integral of r over the square, a^3 (sqrt(2) + asinh(1)) / 6.
  const ContactLaw law = contact_law({});
  PolygonalContact contact(surface(test::lattice_box({kSide, kSide, kHeight}, 0.001)),
                           surface(test::floor_mesh()), law);
  const double u = 1e-5;
  RelativeMotion motion = at_rest({0.0, 0.0, 0.5 * kHeight - u});
  motion.V_TB_T.w.z() = 100.0;
  const double integral = kSide * kSide * kSide * (std::numbers::sqrt2 + std::asinh(1.0)) / 6.0;
  const double moment = law.friction * law.stiffness_Pa_per_m * u * integral;
  EXPECT_NEAR(evaluate(contact, motion).F_B_T.t.z(), -moment, 2e-3 * moment);
}

ContactLaw stick_law() {
  ContactParameters parameters;
  parameters.friction_law = FrictionLaw::stick;
  return contact_law(parameters);
}

TEST(PolygonalContact, StickingFrictionIsASpringUpToTheLimit) {
  const ContactLaw law = stick_law();
  PolygonalContact contact(surface(punch()), surface(test::floor_mesh()), law);
  const double u = 1e-5, area = kSide * kSide, normal = law.stiffness_Pa_per_m * area * u;
  const double k = law.tangential_stiffness_Pa_per_m * area, limit = law.friction * normal;
  const RelativeMotion start = pressed(u);
  // No stored anchors: no spring force.
  EXPECT_LT(evaluate(contact, start).friction_force_N, 1e-9 * normal);
  EXPECT_TRUE(contact.accept(start));
  const double slip = limit / k;  // stretch at the limit
  for (const double share : {0.1, 0.9, 1.1, 3.0}) {
    RelativeMotion motion = start;
    motion.X_TB.p.x() += share * slip;
    const ContactResult r = evaluate(contact, motion);
    EXPECT_NEAR(r.F_B_T.f.x(), -std::min(share, 1.0) * limit, 1e-6 * limit) << share;
    EXPECT_EQ(stacked(r.F_B_T), stacked(evaluate(contact, motion).F_B_T)) << "not pure between accepts";
  }
  // Damping while it sticks.
  RelativeMotion moving = start;
  moving.V_TB_T.v.y() = 1e-6;
  EXPECT_NEAR(evaluate(contact, moving).F_B_T.f.y(), -law.tangential_damping_N_s_per_m3 * area * 1e-6,
              1e-9 * limit);

  // Dragged three times as far as it holds, the spring stays at the limit; on the way back it unloads.
  RelativeMotion dragged = start;
  dragged.X_TB.p.x() += 3.0 * slip;
  EXPECT_TRUE(contact.accept(dragged));
  EXPECT_NEAR(evaluate(contact, dragged).F_B_T.f.x(), -limit, 1e-6 * limit);
  dragged.X_TB.p.x() -= 0.5 * slip;
  EXPECT_NEAR(evaluate(contact, dragged).F_B_T.f.x(), -0.5 * limit, 1e-6 * limit);
  dragged.X_TB.p.x() -= 0.5 * slip;
  EXPECT_NEAR(evaluate(contact, dragged).F_B_T.f.x(), 0.0, 1e-6 * limit);

  // Lifted off and put back: forgotten.
  EXPECT_FALSE(contact.accept(pressed(-1e-3)));
  RelativeMotion back = start;
  back.X_TB.p.x() += 0.5 * slip;
  EXPECT_LT(std::abs(evaluate(contact, back).F_B_T.f.x()), 1e-9 * normal);
}

// Until they are tied, elements have the friction of (2.21): none of an impact within a communication step is lost.
TEST(PolygonalContact, ElementsWithoutASpringHaveRegularisedFriction) {
  ContactParameters parameters;
  parameters.friction_law = FrictionLaw::regularised;
  PolygonalContact untied(surface(punch()), surface(test::floor_mesh()), stick_law());
  PolygonalContact regularised(surface(punch()), surface(test::floor_mesh()), contact_law(parameters));
  for (const double share : {0.0, 0.3, 1.0, 1000.0}) {
    RelativeMotion motion = pressed(1e-5);
    motion.V_TB_T.v = {0.6 * share * parameters.friction_velocity_m_per_s,
                       0.8 * share * parameters.friction_velocity_m_per_s, -1e-4};
    motion.V_TB_T.w.z() = 0.01 * share;
    EXPECT_EQ(stacked(evaluate(untied, motion).F_B_T), stacked(evaluate(regularised, motion).F_B_T)) << share;
    for (const Linearisation of_friction : {Linearisation::secant, Linearisation::tangent}) {
      ContactResult result;
      ContactJacobian a, b;
      untied.evaluate(motion, of_friction, result, a);
      regularised.evaluate(motion, of_friction, result, b);
      EXPECT_LE((a.D - b.D).cwiseAbs().maxCoeff(), 1e-12 * b.D.cwiseAbs().maxCoeff()) << share;
      EXPECT_LE((a.K - b.K).cwiseAbs().maxCoeff(), 1e-12 * b.K.cwiseAbs().maxCoeff()) << share;
    }
  }
}

TEST(PolygonalContact, SpringsBelowTheLimitNeverCreep) {
  PolygonalContact contact(surface(punch()), surface(test::floor_mesh()), stick_law());
  const RelativeMotion start = pressed(1e-5);
  contact.accept(start);
  const std::vector<double> before = contact.save();
  EXPECT_EQ(before.size(), 4u * 128u);
  RelativeMotion motion = start;
  motion.X_TB.p.x() += 1e-6;
  for (int i = 0; i < 1000; ++i) {
    motion.X_TB.p.z() = start.X_TB.p.z() + 1e-6 * std::sin(0.1 * i);
    ASSERT_TRUE(contact.accept(motion));
  }
  EXPECT_EQ(contact.save(), before);
}

TEST(PolygonalContact, SavedSpringsContinueWithTheSameBits) {
  const auto base = surface(punch()), target = surface(test::floor_mesh());
  PolygonalContact contact(base, target, stick_law());
  RelativeMotion motion = pressed(1e-5);
  motion.X_TB.R = Eigen::AngleAxisd(1e-5, Vec3::UnitX()).toRotationMatrix();
  contact.accept(motion);
  motion.X_TB.p.x() += 2e-6;
  contact.accept(motion);
  motion.X_TB.p.y() += 1e-6;
  PolygonalContact other(base, target, stick_law());
  EXPECT_NE(stacked(evaluate(contact, motion).F_B_T), stacked(evaluate(other, motion).F_B_T));
  other.restore(contact.save());
  EXPECT_EQ(stacked(evaluate(contact, motion).F_B_T), stacked(evaluate(other, motion).F_B_T));
  EXPECT_EQ(contact.save(), other.save());
}

TEST(PolygonalContact, PressuresAddUpToTheForce) {
  const ContactLaw law = frictionless_law();
  PolygonalContact contact(surface(test::ball(0.05, 5)), surface(test::floor_mesh()), law);
  const RelativeMotion motion = at_rest({0.0, 0.0, 0.0495});
  const ContactResult r = evaluate(contact, motion);
  double force = 0.0, area = 0.0, largest = 0.0;
  const auto pressures = contact.pressures(motion);
  for (const ElementPressure& p : pressures) {
    force += p.area_m2 * p.pressure_Pa;
    area += p.area_m2;
    largest = std::max(largest, p.pressure_Pa);
    EXPECT_NEAR(p.pressure_Pa, law.stiffness_Pa_per_m * p.penetration_m, 1e-6 * p.pressure_Pa);
  }
  EXPECT_EQ(static_cast<int>(pressures.size()), r.elements);
  EXPECT_NEAR(force, r.normal_force_N, 1e-9 * force);
  EXPECT_NEAR(area, r.area_m2, 1e-9 * area);
  EXPECT_NEAR(largest, r.largest_pressure_Pa, 1e-9 * largest);
}

TEST(RelativeMotion, TheRelativeMotionIsThatOfTheTwoBodies) {
  const Pose X_WT{Eigen::AngleAxisd(0.7, Vec3(1.0, 2.0, 3.0).normalized()).toRotationMatrix(),
                  Vec3(0.3, -0.2, 0.5)};
  const Pose X_TB{Eigen::AngleAxisd(-1.1, Vec3(2.0, -1.0, 0.5).normalized()).toRotationMatrix(),
                  Vec3(0.1, 0.4, -0.3)};
  const Twist V_WT{Vec3(0.1, 0.2, -0.4), Vec3(0.5, -1.0, 0.3)};
  const Twist V_TB_T{Vec3(0.7, -0.1, 0.2), Vec3(-0.4, 0.6, 0.9)};
  const Pose X_WB = X_WT * X_TB;
  const Twist V_WB{V_WT.at(X_WT.R * X_TB.p) + X_WT.R * V_TB_T.v, V_WT.w + X_WT.R * V_TB_T.w};
  const RelativeMotion motion = relative_motion(X_WB, V_WB, X_WT, V_WT);
  EXPECT_LT((motion.X_TB.R - X_TB.R).norm() + (motion.X_TB.p - X_TB.p).norm(), 1e-14);
  EXPECT_LT((motion.V_TB_T.v - V_TB_T.v).norm() + (motion.V_TB_T.w - V_TB_T.w).norm(), 1e-14);
}

}  // namespace
}  // namespace takt
