#pragma once
// The r3 robot a second time: drive equations written out as scalars in the relative form (wind-up and its
// rate), mechanics by Orocos KDL, its own stuck sets and its own reference motion. Classical Runge-Kutta of
// order four, modes switched at the end of each step.
#include <Eigen/LU>
#include <kdl/chain.hpp>
#include <kdl/chaindynparam.hpp>

#include "tests/support/r3_robot.h"

namespace takt::r3 {

/// The path of section "reference motion": share of the way and its rate.
inline void path(double t, double& s, double& sd) {
  double slowest = 0.0, laziest = 0.0;
  for (const Axis& axis : kAxes) {
    const double way = std::abs(axis.end_deg - axis.start_deg) * M_PI / 180.0;
    slowest = std::max(slowest, way / axis.speed);
    laziest = std::max(laziest, way / axis.acceleration);
  }
  const double vmax = 1.0 / slowest, amax = 1.0 / laziest;
  const double Ta = vmax / amax, Tv = 1.0 / vmax, Te = Tv + Ta;
  if (t < Ta) {
    s = 0.5 * amax * t * t, sd = amax * t;
  } else if (t < Tv) {
    s = vmax * (t - 0.5 * Ta), sd = vmax;
  } else if (t < Te) {
    s = 1.0 - 0.5 * amax * (Te - t) * (Te - t), sd = amax * (Te - t);
  } else {
    s = 1.0, sd = 0.0;
  }
}

class Oracle {
 public:
  struct AxisState {
    double q = 0, qd = 0, x = 0, vC = 0, i = 0, psi = 0, om_s = 0;
  };
  using State = std::array<AxisState, 6>;

  Oracle() : chain_(make_chain()), dynamics_(chain_, KDL::Vector(0.0, -kGravity, 0.0)) {
    KDL::JntArray start(6), g(6);
    for (unsigned j = 0; j < 6; ++j) start(j) = kAxes[j].start_deg * M_PI / 180.0;
    dynamics_.JntToGravity(start, g);
    for (size_t j = 0; j < 6; ++j) {
      const Axis& a = kAxes[j];
      AxisState& u = state[j];
      u.q = a.start_deg * M_PI / 180.0;
      const double load = g(static_cast<unsigned>(j));
      if (a.elastic) {
        u.psi = -load / a.n / a.c;
        u.i = load / a.n / a.k;
        u.x = u.i / kSpeedGain - kPositionGain * u.psi;
      } else {
        u.i = load / (a.n * a.k);
        u.x = u.i / kSpeedGain;
      }
      u.vC = -a.R * u.i / 5.0;
    }
  }

  void step(double h) {
    State k1, k2, k3, k4;
    derivatives(t, state, k1);
    derivatives(t + 0.5 * h, plus(state, 0.5 * h, k1), k2);
    derivatives(t + 0.5 * h, plus(state, 0.5 * h, k2), k3);
    derivatives(t + h, plus(state, h, k3), k4);
    state = plus(plus(state, h / 6.0, k1), h / 3.0, k2);
    state = plus(plus(state, h / 3.0, k3), h / 6.0, k4);
    t += h;
    switch_modes();
  }

  void switch_modes() {
    for (size_t j = 0; j < 6; ++j) {
      const Axis& a = kAxes[j];
      AxisState& u = state[j];
      const double v = a.elastic ? a.n * u.qd - u.om_s : u.qd;
      if (mode[j] != 0 && mode[j] * v <= 0.0) {
        mode[j] = 0;
        (a.elastic ? u.om_s : u.qd) = a.elastic ? a.n * u.qd : 0.0;
      }
    }
    for (bool again = true; again;) {
      again = false;
      State unused;
      derivatives(t, state, unused);
      for (size_t j = 0; j < 6; ++j) {
        if (mode[j] != 0 || std::abs(friction[j]) <= kAxes[j].peak * kAxes[j].Rv0) continue;
        mode[j] = friction[j] > 0.0 ? 1 : -1;
        again = true;
      }
    }
  }

  double t = 0.0;
  State state{};
  std::array<int, 6> mode{};         ///< -1, 0, 1
  std::array<double, 6> friction{};  ///< of the last derivatives()

 private:
  static State plus(const State& y, double h, const State& d) {
    State sum = y;
    for (size_t j = 0; j < 6; ++j) {
      sum[j].q += h * d[j].q;
      sum[j].qd += h * d[j].qd;
      sum[j].x += h * d[j].x;
      sum[j].vC += h * d[j].vC;
      sum[j].i += h * d[j].i;
      sum[j].psi += h * d[j].psi;
      sum[j].om_s += h * d[j].om_s;
    }
    return sum;
  }
  static KDL::RigidBodyInertia kdl_inertia(const Body& b) {
    return KDL::RigidBodyInertia(b.mass, KDL::Vector(b.cm.x(), b.cm.y(), b.cm.z()),
                                 KDL::RotationalInertia(b.I11, b.I22, b.I33, b.I21, 0.0, 0.0));
  }
  static KDL::Chain make_chain() {
    KDL::Chain chain;
    for (int j = 0; j < 6; ++j) {
      const Axis& a = kAxes[j];
      KDL::RigidBodyInertia inertia = kdl_inertia(kBodies[j]);
      if (j == 5) inertia = inertia + kdl_inertia(kLoad);
      chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::None),
                                    KDL::Frame(KDL::Vector(a.offset.x(), a.offset.y(), a.offset.z()))));
      chain.addSegment(KDL::Segment(KDL::Joint(a.about_y ? KDL::Joint::RotY : KDL::Joint::RotX),
                                    KDL::Frame::Identity(), inertia));
    }
    return chain;
  }

  void derivatives(double time, const State& y, State& dy) {
    KDL::JntArray q(6), qd(6), g(6), h(6);
    KDL::JntSpaceInertiaMatrix mass(6);
    for (unsigned j = 0; j < 6; ++j) q(j) = y[j].q, qd(j) = y[j].qd;
    dynamics_.JntToGravity(q, g);
    dynamics_.JntToCoriolis(q, qd, h);
    dynamics_.JntToMass(q, mass);
    Eigen::Matrix<double, 6, 6> M = mass.data;
    Eigen::Matrix<double, 6, 1> rhs;
    double s, sd;
    path(time, s, sd);
    for (unsigned j = 0; j < 6; ++j) {
      const Axis& a = kAxes[j];
      const AxisState& u = y[j];
      const double way = (a.end_deg - a.start_deg) * M_PI / 180.0;
      const double q_ref = a.start_deg * M_PI / 180.0 + s * way, qd_ref = sd * way;
      const double phi = a.elastic ? a.n * u.q - u.psi : a.n * u.q;
      double om = a.elastic ? a.n * u.qd - u.om_s : a.n * u.qd;
      if (a.elastic && mode[j] == 0) om = 0.0;
      const double control = a.n * qd_ref + kPositionGain * (a.n * q_ref - phi) - om;
      const double i_ref = kSpeedGain * (u.x + control);
      dy[j].q = u.qd;
      dy[j].x = control / kIntegralTime;
      dy[j].vC = (u.i - i_ref) * a.w / (0.04 * a.D);
      dy[j].i = (-5.0 * u.vC - a.R * u.i - a.k * om) / (a.R / (2.0 * a.D * a.w));
      dy[j].psi = dy[j].om_s = 0.0;
      const double sliding = mode[j] * (a.Rv0 + a.Rv1 * std::abs(a.elastic ? om : u.qd));
      if (a.elastic) {
        const double spring = a.c * u.psi + a.d * (a.n * u.qd - om);
        friction[j] = mode[j] == 0 ? a.k * u.i + spring : sliding;
        dy[j].psi = a.n * u.qd - om;
        dy[j].om_s = -(a.k * u.i + spring - friction[j]) / a.J;  // plus n qdd, below
        rhs(j) = -a.n * spring - h(j) - g(j);
      } else {
        M(j, j) += a.J * a.n * a.n;
        friction[j] = sliding;
        rhs(j) = a.n * a.k * u.i - sliding - h(j) - g(j);
      }
    }
    // Stuck joints: their row becomes the friction torque as the unknown, qdd = 0.
    Eigen::Matrix<double, 6, 6> A = M;
    for (int j = 3; j < 6; ++j) {
      if (mode[static_cast<size_t>(j)] != 0) continue;
      A.col(j).setZero();
      A(j, j) = 1.0;
    }
    const Eigen::Matrix<double, 6, 1> solution = A.fullPivLu().solve(rhs);
    for (unsigned j = 0; j < 6; ++j) {
      if (!kAxes[j].elastic && mode[j] == 0) {
        friction[j] = solution(j);
        dy[j].qd = 0.0;
      } else {
        dy[j].qd = solution(j);
      }
      if (kAxes[j].elastic) dy[j].om_s += kAxes[j].n * dy[j].qd;
    }
  }

  KDL::Chain chain_;  ///< the solver keeps a reference
  KDL::ChainDynParam dynamics_;
};

}  // namespace takt::r3
