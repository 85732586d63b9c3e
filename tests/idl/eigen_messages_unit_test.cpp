// Messages as types of Eigen and back: the effect of a rotation and a pose on a point, and unchanged bits.
#include "idl/common/eigen_messages.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace takt::test {
namespace {

/// A third of a turn about (1, 1, 1): x goes to y, y to z, z to x.
const takt_msgs::msg::Quaternion kThird{0.5, 0.5, 0.5, 0.5};
const takt_msgs::msg::RotationMatrix kThirdMatrix{0, 0, 1, 1, 0, 0, 0, 1, 0};

TEST(EigenMessages, RotationsTurnPoints) {
  const Eigen::Vector3d p(1.0, 2.0, 3.0), turned(3.0, 1.0, 2.0);
  EXPECT_LT((to_eigen(kThird) * p - turned).norm(), 1e-15);
  EXPECT_EQ(to_eigen(kThirdMatrix) * p, turned);
}

TEST(EigenMessages, APoseTurnsAndThenMoves) {
  const Eigen::Isometry3d X = to_eigen(takt_msgs::msg::Transform{{10.0, 20.0, 30.0}, kThirdMatrix});
  EXPECT_EQ(X * Eigen::Vector3d(1.0, 2.0, 3.0), Eigen::Vector3d(13.0, 21.0, 32.0));
  EXPECT_TRUE(to_eigen(takt_msgs::msg::Transform{}).isApprox(Eigen::Isometry3d::Identity(), 0.0));
}

TEST(EigenMessages, ThereAndBackKeepsEveryBit) {
  const takt_msgs::msg::Vector3 v{0.1, -0.2, 1.0 / 3.0};
  EXPECT_EQ(to_vector(to_eigen(v)), v);
  const double c = std::cos(0.3), s = std::sin(0.3);
  const takt_msgs::msg::Quaternion q{s / std::numbers::sqrt3, s / std::numbers::sqrt3,
                                     s / std::numbers::sqrt3, c};
  EXPECT_EQ(to_quaternion(to_eigen(q)), q);
  const takt_msgs::msg::Transform X{v, {c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0}};
  EXPECT_EQ(to_transform(to_eigen(X)), X);
}

}  // namespace
}  // namespace takt::test
