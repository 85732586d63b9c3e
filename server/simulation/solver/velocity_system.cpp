#include "server/simulation/solver/velocity_system.h"

#include <algorithm>

#include "server/simulation/solver/dense_lu.h"

namespace takt {

namespace {

using Vec6 = Eigen::Matrix<double, 6, 1>;

// Step of the difference quotient that gives accelerations of bodies without states (s).
constexpr double kMotionStep = 1e-6;

constexpr auto kNoGroup = static_cast<std::size_t>(-1);

Vec6 stacked(const Vec3& upper, const Vec3& lower) {
  Vec6 v;
  v << upper, lower;
  return v;
}

}  // namespace

VelocitySystem::VelocitySystem(const OdeSystem& system)
    : unit_of_body_(system.body_count(), -1), sets_(system.segments().size()) {
  std::size_t velocities = 0;
  for (const OdeSystem::Segment& segment : system.segments()) {
    Unit& unit = units_.emplace_back();
    unit.model = segment.model;
    unit.begin = segment.begin;
    unit.states = segment.count;
    unit.form = segment.count > 0 ? segment.model->make_velocity_form() : nullptr;
    if (unit.form) {
      unit.velocities = static_cast<std::size_t>(unit.form->velocity_count());
      unit.first_velocity = velocities;
      velocities += unit.velocities;
      unit.mass.resize(unit.velocities * unit.velocities);
      unit.rows.resize(unit.velocities);
      for (const int body : unit.form->bodies())
        unit_of_body_[static_cast<std::size_t>(body)] = static_cast<int>(units_.size()) - 1;
    } else if (segment.count > 0) {
      segment.model->jacobian_pattern(unit.pattern);
      unit.values.resize(unit.pattern.size());
      if (!unit.pattern.empty())
        unit.block.resize(unit.states * unit.states), unit.pivots.resize(unit.states);
    }
  }
  active_.reserve(units_.size()), groups_.reserve(units_.size());
  pairs_.reserve(16 + 8 * system.body_count());
  ends_.reserve(pairs_.capacity());
  constexpr std::size_t kOfBodies = 2 * 6 * 6;  // two bodies that move freely
  jacobians_.reserve(kOfBodies * pairs_.capacity());
  matrices_.reserve(velocities * kMaxDense);
  nodes_.reserve(units_.size()), couplings_.reserve(pairs_.capacity());
  const std::size_t room = std::min(velocities, kRoomForAll);
  if (velocities > kMaxDense) sparse_.reserve(std::min(units_.size(), room), room);
  pivots_.resize(velocities), right_.resize(velocities);
  displacement_.resize(velocities), r_u_.resize(velocities);
  twists_.resize(system.body_count());
}

int VelocitySystem::unit_of(int body) const {
  const int unit = body < 0 ? -1 : unit_of_body_[static_cast<std::size_t>(body)];
  return unit >= 0 && units_[static_cast<std::size_t>(unit)].active ? unit : -1;
}

void VelocitySystem::linearise(OdeSystem& system, double t, std::span<const double> x,
                               Linearisation of_friction) {
  linearise_pairs(system, of_friction);
  linearise_models(system, t, x);
}

void VelocitySystem::linearise_models(OdeSystem& system, double t, std::span<const double> x) {
  for (const std::size_t i : active_) units_[i].active = false;
  active_.clear();
  for (const std::size_t i : system.active_segments()) {
    Unit& unit = units_[i];
    if (unit.states == 0) continue;
    unit.active = true;
    active_.push_back(i);
    if (unit.form)
      unit.form->linearise(t, x.data() + unit.begin, system.motion(), system.wrenches(), unit.mass.data());
    else if (!unit.pattern.empty())
      unit.model->jacobian(t, x.data() + unit.begin, system.motion(), unit.values.data());
  }
  std::erase_if(pairs_, [this](const PairLinearisation& pair) {
    return unit_of(pair.base) < 0 && unit_of(pair.target) < 0;
  });
  ends_.resize(pairs_.size());
  jacobians_.clear();
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const PairLinearisation& pair = pairs_[i];
    for (const auto& [end, body] : {std::pair{&ends_[i].base, pair.base}, {&ends_[i].target, pair.target}}) {
      end->unit = unit_of(body);
      if (end->unit < 0) continue;
      const Unit& unit = units_[static_cast<std::size_t>(end->unit)];
      end->J = jacobians_.size();
      jacobians_.resize(end->J + 6 * unit.velocities);
      unit.form->body_jacobian(body, pair.p_W, &jacobians_[end->J]);
    }
  }
  find_groups();
  find_rates(system, t);
}

void VelocitySystem::find_groups() {
  sets_.reset();
  for (const PairEnds& ends : ends_)
    if (ends.base.unit >= 0 && ends.target.unit >= 0) sets_.join(ends.base.unit, ends.target.unit);
  for (const std::size_t i : active_) units_[i].group = kNoGroup;
  // Robots come first in the system and are coupled with most others: they are eliminated last.
  groups_.clear();
  for (std::size_t k = active_.size(); k-- > 0;) {
    const std::size_t i = active_[k];
    Unit& unit = units_[i];
    if (!unit.form) continue;
    std::size_t& group = units_[sets_.root(i)].group;
    if (group == kNoGroup) {
      group = groups_.size();
      groups_.emplace_back();
    }
    unit.group = group;
    unit.place = groups_[unit.group].size;
    groups_[unit.group].size += unit.velocities;
  }
  std::size_t first = 0, matrix = 0;
  largest_group_ = 0;
  for (Group& group : groups_) {
    group.first = first, group.matrix = matrix;
    first += group.size;
    if (group.is_dense()) matrix += group.size * group.size;
    largest_group_ = std::max(largest_group_, group.size);
  }
  if (matrices_.size() < matrix) matrices_.resize(matrix);
  if (largest_group_ > kMaxDense) set_sparse_pattern();
}

void VelocitySystem::set_sparse_pattern() {
  nodes_.clear(), couplings_.clear();
  for (std::size_t k = active_.size(); k-- > 0;) {
    Unit& unit = units_[active_[k]];
    unit.node = -1;
    if (unit.group == kNoGroup || groups_[unit.group].is_dense()) continue;
    unit.node = static_cast<int>(nodes_.size());
    nodes_.push_back({groups_[unit.group].first + unit.place, unit.velocities});
  }
  for (const PairEnds& ends : ends_) {
    if (ends.base.unit < 0 || ends.target.unit < 0) continue;
    const int base = units_[static_cast<std::size_t>(ends.base.unit)].node;
    const int target = units_[static_cast<std::size_t>(ends.target.unit)].node;
    if (base >= 0 && base != target) couplings_.emplace_back(base, target);
  }
  sparse_.set_pattern(nodes_, couplings_);
}

VelocitySystem::BlockPlace VelocitySystem::block_of(const Unit& row, const Unit& column) {
  const Group& group = groups_[row.group];
  if (!group.is_dense()) return {sparse_.block(row.node, column.node), row.velocities};
  return {&matrices_[group.matrix + column.place * group.size + row.place], group.size};
}

void VelocitySystem::clear_row(const Unit& unit, std::size_t i) {
  const Group& group = groups_[unit.group];
  if (!group.is_dense()) return sparse_.clear_row(unit.node, i);
  for (std::size_t k = 0; k < group.size; ++k)
    matrices_[group.matrix + k * group.size + unit.place + i] = 0.0;
}

// Motion prescribed by time (models without states, and those that follow their courses) changes the forces on other models.
void VelocitySystem::find_rates(OdeSystem& system, double t) {
  has_rates_ = false;
  const auto moved_by_time = [&](int body, const End& end) {
    if (body < 0 || end.unit >= 0) return false;
    const int unit = unit_of_body_[static_cast<std::size_t>(body)];
    if (unit >= 0 && !system.follows(static_cast<std::size_t>(unit))) return false;
    return !(system.motion().carrier(body).V_WB == Twist{});
  };
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    ends_[i].rate.setZero();
    ends_[i].moved_by_time.setZero();
    has_rates_ = has_rates_ || moved_by_time(pairs_[i].base, ends_[i].base) ||
                 moved_by_time(pairs_[i].target, ends_[i].target);
  }
  if (!has_rates_) return;
  const auto twist_at = [&](int body, const Vec3& p_W) {
    const BodyMotion& motion = system.motion().carrier(body);
    return Twist{motion.V_WB.at(p_W - motion.X_WB.p), motion.V_WB.w};
  };
  const auto for_each_moved = [&](const auto& visit) {
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      if (moved_by_time(pairs_[i].base, ends_[i].base)) visit(i, pairs_[i].base, 1.0);
      if (moved_by_time(pairs_[i].target, ends_[i].target)) visit(i, pairs_[i].target, -1.0);
    }
  };
  for_each_moved([&](std::size_t i, int body, double sign) {
    const Twist V = twist_at(body, pairs_[i].p_W);
    const Vec6 twist = sign * stacked(V.v, V.w);
    ends_[i].rate += pairs_[i].K * twist - pairs_[i].D * (twist / kMotionStep);
    ends_[i].moved_by_time += sign * V.v;
  });
  system.update_stateless_motion(t + kMotionStep);
  for_each_moved([&](std::size_t i, int body, double sign) {
    const Twist V = twist_at(body, pairs_[i].p_W);
    ends_[i].rate += pairs_[i].D * (sign / kMotionStep * stacked(V.v, V.w));
  });
  system.update_stateless_motion(t);
}

// J_i^T G J_k for both ends, with the sign of each end in the relative twist.
// `moved` a x f is what the moment about the point of the base has in addition, a the linear part of the twist.
void VelocitySystem::add_pair(const Mat6& G, const Vec3& f_W, double moved, const PairEnds& ends) {
  const End* both[] = {&ends.base, &ends.target};
  for (const End* column : both) {
    if (column->unit < 0) continue;
    const Unit& c = units_[static_cast<std::size_t>(column->unit)];
    BlockPlace blocks[2] = {};
    for (std::size_t side = 0; side < 2; ++side)
      if (both[side]->unit >= 0)
        blocks[side] = block_of(units_[static_cast<std::size_t>(both[side]->unit)], c);
    for (std::size_t k = 0; k < c.velocities; ++k) {
      const auto twist = column_of(*column, k);
      Vec6 force = G * twist;
      for (std::size_t side = 2; side-- > 0;) {
        const End* row = both[side];
        if (side == 0) force.tail<3>() += moved * twist.head<3>().cross(f_W);
        if (row->unit < 0) continue;
        const Unit& r = units_[static_cast<std::size_t>(row->unit)];
        const double sign = row == column ? 1.0 : -1.0;
        double* entries = blocks[side].values + k * blocks[side].stride;
        for (std::size_t i = 0; i < r.velocities; ++i) entries[i] += sign * column_of(*row, i).dot(force);
      }
    }
  }
}

void VelocitySystem::assemble(double a, double b) {
  for (const Group& group : groups_)
    if (group.is_dense())
      std::fill_n(matrices_.begin() + static_cast<std::ptrdiff_t>(group.matrix), group.size * group.size,
                  0.0);
  if (largest_group_ > kMaxDense) sparse_.clear();
  for (std::size_t i = 0; i < pairs_.size(); ++i)
    add_pair(-b * pairs_[i].D - b * b / a * pairs_[i].K, pairs_[i].f_W, b * b / a, ends_[i]);
  for (const std::size_t segment : active_) {
    Unit& unit = units_[segment];
    if (!unit.form) continue;
    const BlockPlace own = block_of(unit, unit);
    for (std::size_t k = 0; k < unit.velocities; ++k) {
      double* column = own.values + k * own.stride;
      for (std::size_t i = 0; i < unit.velocities; ++i) column[i] += a * unit.mass[k * unit.velocities + i];
      column[k] += unit.rows[k].value;
    }
    unit.form->add_couplings(own.values, own.stride);
    for (std::size_t i = 0; i < unit.velocities; ++i) {
      if (!unit.rows[i].prescribed) continue;
      clear_row(unit, i);
      own.values[i * own.stride + i] = unit.rows[i].value;
    }
  }
}

bool VelocitySystem::factorise_block(Unit& unit, double a, double b) const {
  const std::size_t n = unit.states;
  std::fill(unit.block.begin(), unit.block.end(), 0.0);
  for (std::size_t e = 0; e < unit.pattern.size(); ++e) {
    const auto [row, column] = unit.pattern[e];
    unit.block[static_cast<std::size_t>(column) * n + static_cast<std::size_t>(row)] -= b * unit.values[e];
  }
  for (std::size_t i = 0; i < n; ++i) unit.block[i * n + i] += a;
  return factorise_dense(unit.block.data(), n, unit.pivots.data());
}

bool VelocitySystem::factorise(double a, double b) {
  a_ = a, b_ = b;
  for (const std::size_t segment : active_) {
    Unit& unit = units_[segment];
    if (unit.form) {
      if (!unit.form->factorise(a, b, unit.rows.data())) return false;
    } else if (!unit.pattern.empty() && !factorise_block(unit, a, b)) {
      return false;
    }
  }
  assemble(a, b);
  for (const Group& group : groups_)
    if (group.is_dense() && !factorise_dense(&matrices_[group.matrix], group.size, &pivots_[group.first]))
      return false;
  return largest_group_ <= kMaxDense || sparse_.factorise();
}

void VelocitySystem::solve(std::span<double> r, double rate_share) {
  for (const std::size_t segment : active_) {
    Unit& unit = units_[segment];
    double* own = r.data() + unit.begin;
    if (!unit.form) {
      if (unit.pattern.empty())
        for (std::size_t i = 0; i < unit.states; ++i) own[i] /= a_;
      else
        solve_dense(unit.block.data(), unit.states, unit.pivots.data(), own);
      continue;
    }
    const auto n = static_cast<Eigen::Index>(unit.velocities);
    double* right = &right_[groups_[unit.group].first + unit.place];
    double* r_u = &r_u_[unit.first_velocity];
    unit.form->reduce(own, &displacement_[unit.first_velocity], r_u, right);
    for (Eigen::Index i = 0; i < n; ++i) {
      if (unit.rows[static_cast<std::size_t>(i)].prescribed) continue;
      double sum = 0.0;  // M is symmetric
      for (Eigen::Index k = 0; k < n; ++k) sum += unit.mass[static_cast<std::size_t>(i * n + k)] * r_u[k];
      right[i] += sum;
    }
  }
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const PairEnds& ends = ends_[i];
    const std::pair<const End*, double> both[] = {{&ends.base, 1.0}, {&ends.target, -1.0}};
    Vec6 d = Vec6::Zero();
    for (const auto& [end, sign] : both) {
      if (end->unit < 0) continue;
      const Unit& unit = units_[static_cast<std::size_t>(end->unit)];
      for (std::size_t k = 0; k < unit.velocities; ++k)
        d += (sign * displacement_[unit.first_velocity + k]) * column_of(*end, k);
    }
    const Vec6 wrench = pairs_[i].K * (b_ / a_ * d);
    for (const auto& [end, sign] : both) {
      if (end->unit < 0) continue;
      Vec6 force = wrench;
      if (has_rates_) force += rate_share * ends.rate;
      if (sign > 0.0) {
        Vec3 moved = b_ / a_ * d.head<3>();
        if (has_rates_) moved += rate_share * ends.moved_by_time;
        force.tail<3>() -= moved.cross(pairs_[i].f_W);
      }
      const Unit& unit = units_[static_cast<std::size_t>(end->unit)];
      double* right = &right_[groups_[unit.group].first + unit.place];
      for (std::size_t k = 0; k < unit.velocities; ++k)
        if (!unit.rows[k].prescribed) right[k] += sign * column_of(*end, k).dot(force);
    }
  }
  for (const Group& group : groups_)
    if (group.is_dense())
      solve_dense(&matrices_[group.matrix], group.size, &pivots_[group.first], &right_[group.first]);
  if (largest_group_ > kMaxDense) sparse_.solve(right_.data());
  for (const std::size_t segment : active_) {
    Unit& unit = units_[segment];
    if (!unit.form) continue;
    unit.form->expand(&right_[groups_[unit.group].first + unit.place], r.data() + unit.begin);
  }
}

}  // namespace takt
