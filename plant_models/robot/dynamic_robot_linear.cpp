// A robot reduced to the velocities of its joints: the drives' states are eliminated joint by joint.
#include <algorithm>
#include <cmath>
#include <utility>

#include "plant_models/robot/dynamic_robot_impl.h"

namespace takt {

namespace {
constexpr int kDriveStates = DriveJacobian::kMaxStates;
static_assert(VelocityForm::kMaxVelocities >= kMaxJoints);

/// In place, row by row: a small dense LU with partial pivoting.
bool factorise_small(double (*A)[kDriveStates], int n, int* pivots) {
  for (int k = 0; k < n; ++k) {
    int pivot = k;
    for (int i = k + 1; i < n; ++i)
      if (std::abs(A[i][k]) > std::abs(A[pivot][k])) pivot = i;
    if (!(std::abs(A[pivot][k]) > 0.0) || !std::isfinite(A[pivot][k])) return false;
    pivots[k] = pivot;
    if (pivot != k)
      for (int j = 0; j < n; ++j) std::swap(A[k][j], A[pivot][j]);
    for (int i = k + 1; i < n; ++i) {
      const double factor = A[i][k] /= A[k][k];
      if (factor == 0.0) continue;
      for (int j = k + 1; j < n; ++j) A[i][j] -= factor * A[k][j];
    }
  }
  return true;
}

void solve_small(const double (*A)[kDriveStates], int n, const int* pivots, double* b) {
  for (int k = 0; k < n; ++k) std::swap(b[k], b[pivots[k]]);
  for (int i = 1; i < n; ++i)
    for (int j = 0; j < i; ++j) b[i] -= A[i][j] * b[j];
  for (int i = n; i-- > 0;) {
    for (int j = i + 1; j < n; ++j) b[i] -= A[i][j] * b[j];
    b[i] /= A[i][i];
  }
}
}  // namespace

class DynamicRobot::Linear final : public VelocityForm {
 public:
  Linear(Impl& impl, int last_link) : m_(impl), palm_link_(last_link) {
    int jaw = impl.arm;
    for (const ParallelGripper* gripper : impl.grippers) {
      const ParallelGripperParameters& p = gripper->parameters();
      bodies_.push_back({p.palm, palm_link_});
      bodies_.push_back({p.jaws[0], jaw++});
      bodies_.push_back({p.jaws[1], jaw++});
    }
  }

  int velocity_count() const override { return m_.joints; }
  std::vector<int> bodies() const override {
    std::vector<int> result;
    for (const Body& body : bodies_) result.push_back(body.component);
    return result;
  }

  void linearise(double t, const double* x, const CellMotion& motion, std::span<const Wrench> wrenches,
                 double* M) override {
    const int n = m_.joints;
    Solution& s = m_.solution;
    m_.solve(t, x, motion, wrenches, s);
    m_.yielding = s.yields;
    m_.yielding_t = t;
    std::copy(x, x + m_.states, m_.yielding_x.begin());
    m_.tree.mass_matrix(mass_, m_.w);
    Eigen::Map<Eigen::MatrixXd>(M, n, n) = mass_;
    for (int i = 0; i < n; ++i) {
      const auto k = static_cast<size_t>(i);
      Joint& joint = joints_[k];
      const TreeJoint& model = m_.tree.model().joints[k];
      const Pose X_RL = m_.tree.link_pose(i, m_.w);
      joint.axis_W = m_.base.X_WR.R * (X_RL.R * model.joint.axis);
      joint.origin_W = m_.base.X_WR * X_RL.p;
      joint.revolute = model.joint.type != JointType::prismatic;
      joint.drive = {};
      m_.drive(i).jacobian(s.reference[k], x[i], x[n + i], m_.drive_states(x, i), joint.drive);
      joint.locked = s.output[k].locks_joint;
      joint.prescribed = s.output[k].prescribes_acceleration && !s.yields[k];
      joint.stop_dq = joint.stop_dqd = 0.0;
      if (joint.locked || joint.prescribed) continue;
      if (s.yields[k]) joint.drive.torque_dq = joint.drive.torque_dqd = 0.0;  // at the limit, and stays there
      add_stop(i, x, joint);
    }
  }

  void body_jacobian(int body, const Vec3& p_W, double* J) const override {
    const int n = m_.joints;
    Eigen::Map<Eigen::Matrix<double, 6, Eigen::Dynamic>> jacobian(J, 6, n);
    jacobian.setZero();
    int link = -1;
    for (const Body& each : bodies_)
      if (each.component == body) link = each.link;
    for (; link >= 0; link = m_.tree.model().joints[static_cast<size_t>(link)].parent) {
      const Joint& joint = joints_[static_cast<size_t>(link)];
      if (joint.revolute) {
        jacobian.col(link).head<3>() = joint.axis_W.cross(p_W - joint.origin_W);
        jacobian.col(link).tail<3>() = joint.axis_W;
      } else {
        jacobian.col(link).head<3>() = joint.axis_W;
      }
    }
  }

  // Of a drive: (a I - b Zz) y_z = r_z + b (Zq y_q + Zv u), a y_q = r_q + b u. So y_z = s + g u, and its
  // torque changes by T_q y_q + T_v u + T_z y_z.
  bool factorise(double a, double b, Row* rows) override {
    a_ = a, b_ = b;
    for (int i = 0; i < m_.joints; ++i) {
      Joint& joint = joints_[static_cast<size_t>(i)];
      const DriveJacobian& D = joint.drive;
      const int states = m_.drive(i).state_count();
      for (int r = 0; r < states; ++r) {
        for (int c = 0; c < states; ++c) joint.lu[r][c] = -b * D.dz_dz[r][c];
        joint.lu[r][r] += a;
        joint.g[r] = b * (D.dz_dqd[r] + b / a * D.dz_dq[r]);
      }
      if (!factorise_small(joint.lu, states, joint.pivots)) return false;
      solve_small(joint.lu, states, joint.pivots, joint.g);
      double torque = D.torque_dqd + b / a * D.torque_dq;
      for (int c = 0; c < states; ++c) torque += D.torque_dz[c] * joint.g[c];
      Row& row = rows[i];
      row.prescribed = joint.locked || joint.prescribed;
      if (joint.locked) {
        row.value = a;
      } else if (joint.prescribed) {
        row.value = a - b * torque;
      } else {
        row.value = -b * (torque + joint.stop_dqd + b / a * joint.stop_dq);
      }
    }
    return true;
  }

  // The gears between the jaws of a gripper.
  void add_couplings(double* matrix, std::size_t stride) const override {
    for (int left = m_.arm; left < m_.joints; left += 2) {
      const auto i = static_cast<size_t>(left);
      const double value = b_ * (m_.syncs[i].damping_N_s_per_m + b_ / a_ * m_.syncs[i].stiffness_N_per_m);
      for (const size_t row : {i, i + 1}) {
        if (joints_[row].locked || joints_[row].prescribed) continue;
        for (const size_t column : {i, i + 1})
          matrix[column * stride + row] += row == column ? value : -value;
      }
    }
  }

  void reduce(const double* r, double* d_r, double* r_u, double* right) override {
    const int n = m_.joints;
    for (int i = 0; i < n; ++i) {
      Joint& joint = joints_[static_cast<size_t>(i)];
      const DriveJacobian& D = joint.drive;
      const int states = m_.drive(i).state_count();
      const double y_q = r[i] / a_;
      const double* r_z = m_.drive_states(r, i);
      for (int c = 0; c < states; ++c) joint.s[c] = r_z[c] + b_ * D.dz_dq[c] * y_q;
      solve_small(joint.lu, states, joint.pivots, joint.s);
      double torque = D.torque_dq * y_q;
      for (int c = 0; c < states; ++c) torque += D.torque_dz[c] * joint.s[c];
      d_r[i] = r[i];
      r_u[i] = r[n + i];
      if (joint.locked) {
        right[i] = r[n + i];
      } else if (joint.prescribed) {
        right[i] = r[n + i] + b_ * torque;
      } else {
        right[i] = b_ * (torque + joint.stop_dq * y_q);
        if (i >= m_.arm) {
          const double y_other = r[m_.other_jaw(i)] / a_;
          right[i] -= b_ * m_.sync(i).stiffness_N_per_m * (y_q - y_other);
        }
      }
    }
  }

  void expand(const double* u, double* r) const override {
    const int n = m_.joints;
    for (int i = 0; i < n; ++i) {
      const auto k = static_cast<size_t>(i);
      const Joint& joint = joints_[k];
      double* z = r + m_.z_begin[k];
      for (int c = 0; c < m_.drive(i).state_count(); ++c) z[c] = joint.s[c] + joint.g[c] * u[i];
      r[i] = (r[i] + b_ * u[i]) / a_;
      r[n + i] = u[i];
    }
    for (int i = m_.energy_state(); i < m_.states; ++i) r[i] /= a_;
  }

 private:
  struct Body {
    int component, link;
  };
  struct Joint {
    Vec3 axis_W = Vec3::Zero(), origin_W = Vec3::Zero();
    bool revolute = true, locked = false, prescribed = false;
    DriveJacobian drive;
    double stop_dq = 0.0, stop_dqd = 0.0;
    double lu[kDriveStates][kDriveStates] = {};
    int pivots[kDriveStates] = {};
    double g[kDriveStates] = {}, s[kDriveStates] = {};
  };

  /// The slope of the end stop's force, where it acts. That of the damping with depth is left out: it is only
  /// there in the first hundredth of a millimetre.
  void add_stop(int i, const double* x, Joint& joint) const {
    if (m_.stop_force(i, x) == 0.0) return;
    const Impl::EndStop& stop = m_.stops[static_cast<size_t>(i)];
    joint.stop_dq = -stop.stiffness_N_per_m;
    joint.stop_dqd = -stop.damping_N_s_per_m;
  }

  using Solution = Impl::Solution;
  Impl& m_;
  int palm_link_;
  std::vector<Body> bodies_;
  std::array<Joint, kMaxJoints> joints_;
  MultibodyTree::MassMatrix mass_;
  double a_ = 1.0, b_ = 0.0;
};

std::unique_ptr<VelocityForm> DynamicRobot::make_velocity_form() const {
  return std::make_unique<Linear>(*impl_, impl_->arm - 1);
}

}  // namespace takt
