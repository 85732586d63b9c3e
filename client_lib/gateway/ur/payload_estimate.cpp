#include "client_lib/gateway/ur/payload_estimate.h"

#include <Eigen/Dense>
#include <numbers>
#include <stdexcept>
#include <string>

namespace takt::ur {
namespace {

constexpr std::size_t kFewest = 4;

Mat3 cross_matrix(const Vec3& v) {
  Mat3 m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

void check(std::span<const WeighedPose> poses) {
  if (poses.size() < kFewest)
    throw std::invalid_argument("found " + std::to_string(poses.size()) + " poses; allowed: 4 or more");
  const double least = std::numbers::pi / (2.0 * static_cast<double>(poses.size()));
  for (std::size_t i = 0; i < poses.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (Eigen::AngleAxisd(Mat3(poses[i].R_BF.transpose() * poses[j].R_BF)).angle() < least)
        throw std::invalid_argument("the orientations of poses " + std::to_string(j) + " and " +
                                    std::to_string(i) + " differ by less than " + std::to_string(least) +
                                    " rad");
}

}  // namespace

// In the flange's axes, with g = R^T up: f = -m g + f0, t = -(m c) x g + t0.
PayloadEstimate estimate_payload(std::span<const WeighedPose> poses, const Vec3& up_B) {
  check(poses);
  const auto rows = static_cast<Eigen::Index>(3 * poses.size());
  Eigen::MatrixXd of_force(rows, 4), of_torque(rows, 6);
  Eigen::VectorXd force(rows), torque(rows);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(3 * i);
    const Mat3 R_FB = poses[i].R_BF.transpose();
    const Vec3 g = R_FB * up_B;
    of_force.block<3, 1>(row, 0) = -g;
    of_force.block<3, 3>(row, 1).setIdentity();
    of_torque.block<3, 3>(row, 0) = cross_matrix(g);
    of_torque.block<3, 3>(row, 3).setIdentity();
    force.segment<3>(row) = R_FB * poses[i].F_B.f;
    torque.segment<3>(row) = R_FB * poses[i].F_B.t;
  }
  // Turns about the weight alone leave the mass open: the solution of least norm is not it.
  const auto solved = [](const Eigen::MatrixXd& A, const Eigen::VectorXd& b) -> Eigen::VectorXd {
    const auto factors = A.completeOrthogonalDecomposition();
    if (factors.rank() < A.cols())
      throw std::invalid_argument("the poses turn the flange about one axis; allowed: turns about two");
    return factors.solve(b);
  };
  const Eigen::VectorXd f = solved(of_force, force), t = solved(of_torque, torque);
  return {f[0], t.head<3>()};
}

}  // namespace takt::ur
