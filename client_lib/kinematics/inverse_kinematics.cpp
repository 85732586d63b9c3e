#include "client_lib/kinematics/inverse_kinematics.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace takt {

namespace {

using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

constexpr int kMaxIterations = 100;
constexpr double kMaxStep = 0.5;         // rad or m, of any joint in one iteration
constexpr double kUndampedBelow = 1e-2;  // error (m and rad together) from which Newton converges by itself
constexpr double kDamping = 0.1;         // times the squared error, on the diagonal of J J^T
constexpr double kSmallestPivot = 1e-7;  // of the Jacobian's LU factors, relative to the largest

struct FlangeError {
  Vec6 e;  ///< rows 0-2 metres, rows 3-5 rotation vector
  double position_m = 0.0;
  double rotation_rad = 0.0;
  double squared() const { return position_m * position_m + rotation_rad * rotation_rad; }
  bool reached() const {
    return position_m <= kIkPositionTolerance_m && rotation_rad <= kIkRotationTolerance_rad;
  }
};

FlangeError flange_error(const Pose& target, const Pose& actual) {
  FlangeError error;
  error.e.head<3>() = target.p - actual.p;
  error.e.tail<3>() = rotation_vector(target.R * actual.R.transpose());
  error.position_m = error.e.head<3>().norm();
  error.rotation_rad = error.e.tail<3>().norm();
  return error;
}

/// The smallest solution of J x = b without damping. False where J has not full rank.
bool solve_undamped(const ArmJacobian& J, const Vec6& b, double* x) {
  Eigen::Map<Eigen::VectorXd> solution(x, J.cols());
  // For more than six joints J J^T is factored, whose pivots are those of J squared.
  const bool square = J.cols() == 6;
  Mat6 A;
  if (square) {
    A = J;
  } else {
    A.noalias() = J * J.transpose();
  }
  const Eigen::PartialPivLU<Mat6> lu(A);
  const auto pivots = lu.matrixLU().diagonal().cwiseAbs();
  const double smallest = square ? kSmallestPivot : kSmallestPivot * kSmallestPivot;
  if (!(pivots.minCoeff() > smallest * pivots.maxCoeff())) return false;
  const Vec6 y = lu.solve(b);
  if (square) {
    solution = y;
  } else {
    solution.noalias() = J.transpose() * y;
  }
  return true;
}

void solve_damped(const ArmJacobian& J, const Vec6& b, double damping, double* x) {
  Mat6 A;
  A.noalias() = J * J.transpose();
  A.diagonal().array() += damping;
  const Vec6 y = A.ldlt().solve(b);
  Eigen::Map<Eigen::VectorXd>(x, J.cols()).noalias() = J.transpose() * y;
}

void step_within_limits(const ArmModel& arm, const JointArray& step, JointArray& q) {
  double largest = 0.0;
  for (int i = 0; i < arm.joint_count(); ++i) {
    largest = std::max(largest, std::abs(step[static_cast<size_t>(i)]));
  }
  const double scale = largest > kMaxStep ? kMaxStep / largest : 1.0;
  for (int i = 0; i < arm.joint_count(); ++i) {
    const auto j = static_cast<size_t>(i);
    q[j] = std::clamp(q[j] + scale * step[j], arm.joints[j].lower, arm.joints[j].upper);
  }
}

/// Turns every revolute joint by whole turns to where it is nearest to the seed, as far as its limits allow.
void turn_towards(const ArmModel& arm, const JointArray& seed, JointArray& q) {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  for (int i = 0; i < arm.joint_count(); ++i) {
    const auto j = static_cast<size_t>(i);
    if (arm.joints[j].type != JointType::revolute) continue;
    double turns = std::round((seed[j] - q[j]) / kTurn);
    const double towards_zero = turns > 0.0 ? -1.0 : 1.0;
    while (turns != 0.0) {
      const double candidate = q[j] + turns * kTurn;
      if (candidate >= arm.joints[j].lower && candidate <= arm.joints[j].upper) {
        q[j] = candidate;
        break;
      }
      turns += towards_zero;
    }
  }
}

double travel(const ArmModel& arm, const JointArray& from, const JointArray& to) {
  double largest = 0.0;
  for (int i = 0; i < arm.joint_count(); ++i) {
    const auto j = static_cast<size_t>(i);
    largest = std::max(largest, std::abs(to[j] - from[j]));
  }
  return largest;
}

/// Number `index` (from 1) of a sequence in [0, 1) that fills it evenly, another one for each base (van der
/// Corput).
double radical_inverse(int index, int base) {
  double result = 0.0;
  double digit = 1.0 / base;
  for (int i = index; i > 0; i /= base, digit /= base) result += digit * (i % base);
  return result;
}

}  // namespace

Vec3 rotation_vector(const Mat3& R) {
  const Vec3 twice_sine(R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1));
  const double sine = 0.5 * twice_sine.norm();
  const double cosine = 0.5 * (R.trace() - 1.0);
  if (cosine < -0.9) {  // near half a turn the axis is better taken from the quaternion
    const Eigen::AngleAxisd turn{Quat(R)};
    return turn.axis() * turn.angle();
  }
  if (sine < 1e-9) return 0.5 * twice_sine;
  return twice_sine * (0.5 * std::atan2(sine, cosine) / sine);
}

IkSolution solve_ik_from(const ArmModel& arm, const Pose& X_RF, const JointArray& seed) {
  IkSolution best;
  double best_squared = std::numeric_limits<double>::infinity();
  JointArray q = seed;
  JointArray step{};
  ArmPoses poses;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    forward_kinematics(arm, q.data(), poses);
    const FlangeError error = flange_error(X_RF, poses.X_RF);
    if (error.squared() < best_squared) {
      best_squared = error.squared();
      best = {error.reached(), q, error.position_m, error.rotation_rad};
    } else if (best.found) {
      break;  // one more step has not made it better: this is what the numbers give
    }
    // A tenth of the tolerance, so that the tolerance holds whatever the rounding of a later check.
    if (error.position_m <= 0.1 * kIkPositionTolerance_m &&
        error.rotation_rad <= 0.1 * kIkRotationTolerance_rad)
      break;
    const ArmJacobian J = flange_jacobian(arm, poses);
    if (!(error.squared() < kUndampedBelow * kUndampedBelow) || !solve_undamped(J, error.e, step.data())) {
      solve_damped(J, error.e, kDamping * error.squared() + 1e-12, step.data());
    }
    step_within_limits(arm, step, q);
  }
  return best;
}

IkSolution solve_ik(const ArmModel& arm, const Pose& X_RF, const JointArray& seed) {
  IkSolution best = solve_ik_from(arm, X_RF, seed);
  if (best.found) {
    turn_towards(arm, seed, best.q);
    return best;
  }
  // Starts spread evenly over the joints' ranges, of which at most a turn around the seed is of use.
  constexpr int kStarts = 64;
  constexpr std::array<int, kMaxJoints> kBases{2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53};
  for (int start = 1; start <= kStarts; ++start) {
    JointArray q{};
    for (int i = 0; i < arm.joint_count(); ++i) {
      const auto j = static_cast<size_t>(i);
      const JointModel& joint = arm.joints[j];
      const bool revolute = joint.type == JointType::revolute;
      const double lower = revolute ? std::max(joint.lower, seed[j] - std::numbers::pi) : joint.lower;
      const double upper = revolute ? std::min(joint.upper, seed[j] + std::numbers::pi) : joint.upper;
      q[j] = lower + (upper - lower) * radical_inverse(start, kBases[j]);
    }
    IkSolution solution = solve_ik_from(arm, X_RF, q);
    if (solution.found) turn_towards(arm, seed, solution.q);
    const bool nearer =
        solution.found && (!best.found || travel(arm, seed, solution.q) < travel(arm, seed, best.q));
    const bool less_wrong = !solution.found && !best.found &&
                            solution.position_error_m + solution.rotation_error_rad <
                                best.position_error_m + best.rotation_error_rad;
    if (nearer || less_wrong) best = solution;
  }
  return best;
}

bool joint_velocities(const ArmModel& arm, const ArmPoses& poses, const Twist& V_RF, JointArray& qd) {
  Vec6 v;
  v << V_RF.v, V_RF.w;
  return solve_undamped(flange_jacobian(arm, poses), v, qd.data());
}

}  // namespace takt
