#include "server/simulation/solver/system_jacobian.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "server/simulation/solver/dense_lu.h"

namespace takt {

namespace {
// Square root of the rounding unit: truncation and rounding error of a forward difference are then of equal
// size.
constexpr double kRelativeIncrement = 1.5e-8;
// Increment for the search for influences: large enough to change every term.
constexpr double kTrial = 1e-6;
}  // namespace

SystemJacobian::SystemJacobian(const OdeSystem& system) : sets_(system.blocks().size()) {
  const auto n = static_cast<std::size_t>(system.state_count());
  states_.resize(n), pivots_.resize(n), scales_.resize(n);
  x_.resize(n), f0_.resize(n), f1_.resize(n), work_.resize(n);
  groups_.reserve(system.blocks().size());
  system.state_scales(scales_);
  int bodies = 0;
  for (const OdeSystem::Block& block : system.blocks()) bodies = std::max(bodies, block.body + 1);
  block_of_body_.assign(static_cast<std::size_t>(bodies), -1);
  for (std::size_t i = 0; i < system.blocks().size(); ++i) {
    const int body = system.blocks()[i].body;
    if (body >= 0) block_of_body_[static_cast<std::size_t>(body)] = static_cast<int>(i);
  }
}

double SystemJacobian::increment(std::size_t state, double value) const {
  const double delta = kRelativeIncrement * std::max(std::abs(value), scales_[state]);
  return (value + delta) - value;  // increment of the rounded sum
}

void SystemJacobian::find_groups(const OdeSystem& system, double t, const double* x, const Derivatives& f) {
  const std::span<const OdeSystem::Block> blocks = system.blocks();
  sets_.reset();
  std::copy(x, x + x_.size(), x_.begin());
  // A failed evaluation counts as a difference: groups are then too large, never too small.
  static_cast<void>(f(t, x_.data(), f0_.data()));
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const OdeSystem::Block& block = blocks[i];
    if (block.body >= 0) {
      const int partner = system.partner(block.body);
      if (partner < 0 || static_cast<std::size_t>(partner) >= block_of_body_.size()) continue;
      const int other = block_of_body_[static_cast<std::size_t>(partner)];
      if (other >= 0) sets_.join(i, static_cast<std::size_t>(other));
      continue;
    }
    for (std::size_t s = block.states.begin; s < block.states.end; ++s)
      x_[s] += kTrial * scales_[s] * (1.0 + 0.1 * static_cast<double>(s % 7));
    static_cast<void>(f(t, x_.data(), f1_.data()));
    for (std::size_t s = block.states.begin; s < block.states.end; ++s) x_[s] = x[s];
    for (std::size_t k = 0; k < blocks.size(); ++k) {
      const OdeSystem::Range& range = blocks[k].states;
      if (k != i &&
          std::memcmp(&f0_[range.begin], &f1_[range.begin], (range.end - range.begin) * sizeof(double)) != 0)
        sets_.join(i, k);
    }
  }
  groups_.clear();
  largest_ = 0;
  std::size_t place = 0, values = 0;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (sets_.root(i) != i) continue;
    Group group{place, 0, values};
    for (std::size_t k = i; k < blocks.size(); ++k) {
      if (sets_.root(k) != i) continue;
      for (std::size_t s = blocks[k].states.begin; s < blocks[k].states.end; ++s) states_[place++] = s;
    }
    group.size = place - group.first;
    values += group.size * group.size;
    largest_ = std::max(largest_, group.size);
    groups_.push_back(group);
  }
  // Only grows; at a change of connections, never within a step.
  if (jacobian_.size() < values) jacobian_.resize(values), factors_.resize(values);
}

bool SystemJacobian::evaluate(double t, const double* x, const double* f0, const Derivatives& f) {
  std::copy(x, x + x_.size(), x_.begin());
  for (std::size_t column = 0; column < largest_; ++column) {
    for (const Group& group : groups_) {
      if (column >= group.size) continue;
      const std::size_t s = states_[group.first + column];
      x_[s] += increment(s, x[s]);
    }
    const bool finite = f(t, x_.data(), f1_.data());
    for (const Group& group : groups_) {
      if (column >= group.size) continue;
      const std::size_t s = states_[group.first + column];
      const double inverse = 1.0 / (x_[s] - x[s]);
      double* values = &jacobian_[group.values + column * group.size];
      for (std::size_t i = 0; i < group.size; ++i) {
        const std::size_t row = states_[group.first + i];
        values[i] = (f1_[row] - f0[row]) * inverse;
      }
      x_[s] = x[s];
    }
    if (!finite) return false;
  }
  return true;
}

bool SystemJacobian::factorise(double a, double b) {
  for (const Group& group : groups_) {
    const std::size_t n = group.size;
    double* block = &factors_[group.values];
    for (std::size_t i = 0; i < n * n; ++i) block[i] = -b * jacobian_[group.values + i];
    for (std::size_t i = 0; i < n; ++i) block[i * n + i] += a;
    if (!factorise_dense(block, n, &pivots_[group.first])) return false;
  }
  return true;
}

void SystemJacobian::solve(double* b) {
  for (std::size_t i = 0; i < states_.size(); ++i) work_[i] = b[states_[i]];
  for (const Group& group : groups_)
    solve_dense(&factors_[group.values], group.size, &pivots_[group.first], &work_[group.first]);
  for (std::size_t i = 0; i < states_.size(); ++i) b[states_[i]] = work_[i];
}

}  // namespace takt
