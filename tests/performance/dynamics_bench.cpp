// Inverse and forward dynamics of a 6-axis arm (UR10e), from joint positions and velocities, side by side
// with Orocos KDL in one run. Figures are medians over rounds, which take turns so that a busy machine
// touches all of them. Exit code 1 when the two disagree.
#include <Eigen/Cholesky>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>

#include "tests/support/kdl_tree.h"
#include "tests/support/random_trees.h"
#include "tests/support/robot_tables.h"

namespace takt {
namespace {

constexpr int kStates = 1024;
constexpr int kRounds = 41;
constexpr int kJoints = 6;

struct State {
  JointArray q, qd, x, result;                ///< x: accelerations or torques
  KDL::JntArray q_kdl, qd_kdl, x_kdl, y_kdl;  ///< the same for KDL
};

struct Case {
  const char* name;
  std::function<void(State&)> run;
  std::vector<double> ns{};
};

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

double worst_difference(const std::vector<State>& states) {
  double worst = 0.0;
  for (const State& s : states) {
    const auto found = Eigen::Map<const Eigen::VectorXd>(s.result.data(), kJoints);
    worst = std::max(worst, (found - s.y_kdl.data).norm() / s.y_kdl.data.norm());
  }
  return worst;
}

void time_cases(std::vector<Case>& cases, std::vector<State>& states) {
  using Clock = std::chrono::steady_clock;
  for (int round = 0; round < kRounds; ++round) {
    for (Case& each : cases) {
      const auto start = Clock::now();
      for (State& state : states) each.run(state);
      const std::chrono::duration<double, std::nano> time = Clock::now() - start;
      each.ns.push_back(time.count() / kStates);
    }
  }
}

void report(const std::vector<Case>& cases, double goal_ns) {
  const double ours = median(cases.front().ns);
  for (const Case& each : cases) {
    const double time = median(each.ns);
    std::printf("  %-58s %7.0f ns   %5.1f x takt\n", each.name, time, time / ours);
  }
  std::printf("  goal for takt %.0f ns: %s\n", goal_ns, ours <= goal_ns ? "met" : "not met");
  double best = median(cases.back().ns);
  for (std::size_t i = 1; i < cases.size(); ++i) best = std::min(best, median(cases[i].ns));
  std::printf("  takt over the best of KDL %.2f (goal 0.7)\n", ours / best);
}

int bench() {
  const TreeModel model = test::tree_of(test::ur10e_table());
  const MultibodyTree tree(model);
  MultibodyTree::Workspace w;
  const KDL::Chain chain = test::kdl_chain(model);
  const KDL::Vector gravity = test::kdl(model.gravity_R);
  KDL::ChainIdSolver_RNE inverse(chain, gravity);
  KDL::ChainFdSolver_RNE forward(chain, gravity);
  KDL::ChainDynParam parameters(chain, gravity);
  const KDL::Wrenches no_wrenches(kJoints, KDL::Wrench::Zero());
  const MultibodyTree::Mask free{};
  MultibodyTree::Mask two_locked{};
  two_locked[3] = two_locked[5] = true;
  JointArray tau_lock{};
  MultibodyTree::MassMatrix M;
  KDL::JntSpaceInertiaMatrix M_kdl(kJoints);
  KDL::JntArray c(kJoints), g(kJoints);

  test::TreeMaker make(1);
  std::vector<State> states;
  for (int i = 0; i < kStates; ++i) {
    State state{make.joints(3.0), make.joints(2.0), make.joints(10.0), {}, {}, {}, {}, {}};
    state.q_kdl = test::kdl_joints(state.q, kJoints);
    state.qd_kdl = test::kdl_joints(state.qd, kJoints);
    state.x_kdl = test::kdl_joints(state.x, kJoints);
    state.y_kdl = KDL::JntArray(kJoints);
    states.push_back(state);
  }

  std::printf("Inverse dynamics, UR10e, from q, qd, qdd\n");
  std::vector<Case> cases{{"takt, recursive Newton-Euler",
                           [&](State& s) {
                             tree.update(s.q.data(), s.qd.data(), w);
                             tree.inverse_dynamics(s.x.data(), s.result.data(), w);
                           }},
                          {"KDL, ChainIdSolver_RNE", [&](State& s) {
                             inverse.CartToJnt(s.q_kdl, s.qd_kdl, s.x_kdl, no_wrenches, s.y_kdl);
                           }}};
  time_cases(cases, states);
  report(cases, 200.0);
  double worst = worst_difference(states);

  std::printf("Forward dynamics, UR10e, from q, qd, tau\n");
  cases = {{"takt, articulated bodies",
            [&](State& s) {
              tree.update(s.q.data(), s.qd.data(), w);
              tree.forward_dynamics(s.x.data(), free, s.result.data(), tau_lock.data(), w);
            }},
           {"KDL, ChainDynParam and Cholesky",
            [&](State& s) {
              parameters.JntToMass(s.q_kdl, M_kdl);
              parameters.JntToCoriolis(s.q_kdl, s.qd_kdl, c);
              parameters.JntToGravity(s.q_kdl, g);
              s.y_kdl.data = M_kdl.data.ldlt().solve(s.x_kdl.data - c.data - g.data);
            }},
           {"KDL, ChainFdSolver_RNE",
            [&](State& s) { forward.CartToJnt(s.q_kdl, s.qd_kdl, s.x_kdl, no_wrenches, s.y_kdl); }}};
  time_cases(cases, states);
  report(cases, 350.0);
  worst = std::max(worst, worst_difference(states));

  std::printf("Parts of it\n");
  cases = {{"positions and velocities alone", [&](State& s) { tree.update(s.q.data(), s.qd.data(), w); }},
           {"forward dynamics with two joints locked",
            [&](State& s) {
              tree.update(s.q.data(), s.qd.data(), w);
              tree.forward_dynamics(s.x.data(), two_locked, s.result.data(), tau_lock.data(), w);
            }},
           {"mass matrix with positions",
            [&](State& s) {
              tree.update(s.q.data(), s.qd.data(), w);
              tree.mass_matrix(M, w);
            }},
           {"KDL, mass matrix", [&](State& s) { parameters.JntToMass(s.q_kdl, M_kdl); }}};
  time_cases(cases, states);
  for (const Case& each : cases) std::printf("  %-58s %7.0f ns\n", each.name, median(each.ns));

  std::printf("Largest relative difference between takt and KDL: %.1e\n", worst);
  return worst < 1e-10 ? 0 : 1;
}

}  // namespace
}  // namespace takt

int main() {
  return takt::bench();
}
