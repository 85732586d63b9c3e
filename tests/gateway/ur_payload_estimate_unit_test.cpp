// estimate_payload of URScript: wrenches of a known mass on a sensor with a constant error.
#include <gtest/gtest.h>

#include <numbers>
#include <vector>

#include "client_lib/gateway/ur/payload_estimate.h"

namespace takt::ur {
namespace {

const Vec3 kRestAcceleration(0.0, 0.0, 9.82);
constexpr double kMass_kg = 1.7;
const Vec3 kCenter_F(0.02, -0.03, 0.09);

WeighedPose weighed(const Vec3& axis, double angle) {
  const Mat3 R = Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
  const Vec3 weight = -kMass_kg * kRestAcceleration, error_f(3.0, -2.0, 5.0), error_t(0.3, 0.1, -0.4);
  return {R, {weight + R * error_f, (R * kCenter_F).cross(weight) + R * error_t}};
}

TEST(PayloadEstimate, IsExactForAConstantErrorOfTheSensor) {
  const std::vector<WeighedPose> poses{weighed({1, 0, 0}, 0.0), weighed({1, 0, 0}, 1.2),
                                       weighed({0, 1, 0}, 0.9), weighed({1, 1, 0.3}, 2.0),
                                       weighed({0, 1, 1}, -1.4)};
  const PayloadEstimate found = estimate_payload(poses, kRestAcceleration);
  EXPECT_NEAR(found.mass_kg, kMass_kg, 1e-12);
  EXPECT_LT((found.moment_F - kMass_kg * kCenter_F).norm(), 1e-12);
}

TEST(PayloadEstimate, RefusesPosesThatDoNotDetermineIt) {
  std::vector<WeighedPose> poses{weighed({1, 0, 0}, 0.0), weighed({1, 0, 0}, 1.2), weighed({0, 1, 0}, 0.9)};
  EXPECT_THROW((void)estimate_payload(poses, kRestAcceleration), std::invalid_argument);
  poses.push_back(weighed({0, 1, 0}, 0.9 + 0.9 * std::numbers::pi / 8));  // less than pi / (2 n)
  EXPECT_THROW((void)estimate_payload(poses, kRestAcceleration), std::invalid_argument);
  const std::vector<WeighedPose> about_the_weight{weighed({0, 0, 1}, 0.0), weighed({0, 0, 1}, 1.0),
                                                  weighed({0, 0, 1}, 2.0), weighed({0, 0, 1}, 3.0)};
  EXPECT_THROW((void)estimate_payload(about_the_weight, kRestAcceleration), std::invalid_argument);
}

}  // namespace
}  // namespace takt::ur
