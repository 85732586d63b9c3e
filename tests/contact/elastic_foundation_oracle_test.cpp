// Surface contact beside the elastic foundation of Simbody.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "server/geometry/mesh/import.h"
#include "tests/support/contact_pairs.h"
#include "tests/support/simbody/elastic_foundation.h"

namespace takt {
namespace {

using test::at_rest;
using test::evaluate;
using test::surface;

test::PlainMesh plain(const TriangleMesh& mesh) {
  test::PlainMesh result;
  for (const Vec3& v : mesh.vertices) result.vertices.push_back({v.x(), v.y(), v.z()});
  for (const auto& t : mesh.triangles) result.triangles.push_back({t[0], t[1], t[2]});
  return result;
}

/// On the base about the origin of T, axes of T.
Wrench of_simbody(const TriangleMesh& base, const TriangleMesh& target, const Pose& X_TB,
                  double stiffness_Pa_per_m) {
  test::PlainPose X{};
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 3; ++c) X.R[r][c] = X_TB.R(static_cast<int>(r), static_cast<int>(c));
    X.p[r] = X_TB.p[static_cast<int>(r)];
  }
  const auto F = test::elastic_foundation(plain(base), plain(target), X, stiffness_Pa_per_m);
  const Vec3 f(F[0], F[1], F[2]), t(F[3], F[4], F[5]);
  return {f, t + X_TB.p.cross(f)};
}

void expect_same(const char* name, const TriangleMesh& base, const TriangleMesh& target, const Pose& X_TB) {
  ContactParameters parameters;
  parameters.friction = parameters.areal_damping_N_s_per_m3 = 0.0;
  const ContactLaw law = contact_law(parameters);
  PolygonalContact contact(surface(base), surface(target), law);
  const Wrench ours = evaluate(contact, {X_TB, {}}).F_B_T;
  const Wrench theirs = of_simbody(base, target, X_TB, law.stiffness_Pa_per_m);
  ASSERT_GT(theirs.f.norm(), 0.0) << name;
  EXPECT_LT((ours.f - theirs.f).norm(), 0.01 * theirs.f.norm())
      << name << ": " << ours.f.transpose() << " and " << theirs.f.transpose();
  EXPECT_LT((ours.t - theirs.t).norm(), 0.01 * theirs.t.norm() + 1e-4 * theirs.f.norm())
      << name << ": " << ours.t.transpose() << " and " << theirs.t.transpose();
}

TEST(ElasticFoundation, SimbodyGivesTheSameWrenchOfABall) {
  const TriangleMesh plate = test::lattice_box({0.2, 0.2, 0.05}, 0.05);
  for (const double depth : {1e-4, 5e-4, 2e-3})
    expect_same("ball", test::ball(0.02, 4), plate, {Mat3::Identity(), Vec3(0.013, 0.007, 0.045 - depth)});
}

TEST(ElasticFoundation, SimbodyGivesTheSameWrenchOfATiltedBox) {
  const TriangleMesh plate = test::lattice_box({0.2, 0.2, 0.05}, 0.05);
  const TriangleMesh box = test::lattice_box({0.04, 0.04, 0.04}, 0.004);
  for (const double degrees : {0.5, 2.0, 10.0, 30.0, 45.0})
    for (const double depth : {5e-4, 3e-3}) {
      const double tilt = degrees * std::numbers::pi / 180.0;
      const Mat3 R = Eigen::AngleAxisd(tilt, Vec3::UnitY()).toRotationMatrix();
      const double lowest = 0.02 * (std::cos(tilt) + std::sin(tilt));
      if (depth < 0.004 * std::sin(tilt)) continue;  // no centroid is in
      expect_same("box", box, plate, {R, Vec3(0.013, 0.007, 0.025 + lowest - depth)});
    }
}

TEST(ElasticFoundation, SimbodyGivesTheSameWrenchOfAPegInItsHole) {
  const auto part = [](const char* name) {
    return import_solid(std::string(TAKT_CONFIG_DIR "/meshes/contact/") + name + ".obj");
  };
  // All of the peg is below the mouth of the hole, or it leans in the mouth.
  const TriangleMesh peg = part("peg_100um"), hole = part("hole");
  expect_same("peg at a wall", peg, hole, {Mat3::Identity(), Vec3(3e-4, 1e-4, 0.0061)});
  const Mat3 lean = Eigen::AngleAxisd(0.02, Vec3(0.3, 1.0, 0.0).normalized()).toRotationMatrix();
  expect_same("leaning peg", peg, hole, {lean, Vec3(2e-4, 0.0, 0.012)});
}

}  // namespace
}  // namespace takt
