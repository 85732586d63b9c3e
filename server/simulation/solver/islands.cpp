#include "server/simulation/solver/islands.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/geometry/surface/contact_surface_data.h"

namespace takt {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Bounds that are apart by less than this (m) count as touching: room for rounding.
constexpr double kRounding_m = 1e-9;

const BodyMotion& body(const CellMotion& motion, int component) {
  return motion.bodies[static_cast<std::size_t>(component)];
}

int component_of(const PairContact& pair, int which) {
  return which == 0 ? pair.base : pair.target;
}

/// Half of the length of a box along an axis of the world.
double half_along(const BodyBox& box, const Mat3& R_WB, const Vec3& axis_W) {
  return (R_WB.transpose() * axis_W).cwiseAbs().dot(box.half_B);
}

}  // namespace

Islands::Islands(const OdeSystem& system, std::span<const int> unit_of_body)
    : contacts_(system.contacts()),
      unit_of_body_(unit_of_body.begin(), unit_of_body.end()),
      awake_(system.segments().size(), 0),
      new_(awake_),
      island_(awake_.size(), 0),
      sets_(awake_.size()),
      level_of_(awake_.size(), 0),
      marked_(awake_.size(), 0) {
  std::vector<char> has_form(awake_.size(), 0);
  for (const int unit : unit_of_body_)
    if (unit >= 0) has_form[static_cast<std::size_t>(unit)] = 1;
  for (std::size_t i = 0; i < awake_.size(); ++i)
    if (system.segments()[i].count > 0 && has_form[i] == 0) possible_ = false;
  possible_ = possible_ && contacts_ != nullptr && system.indicator_count() == 0;
  if (!possible_) return;
  with_states_.reserve(awake_.size()), members_.reserve(awake_.size()), begin_.reserve(awake_.size() + 1);
  const std::size_t room = contacts_->room();
  links_.reserve(room), inner_.reserve(room), outer_.reserve(2 * room);
  for (Level& level : levels_) {
    level.segments.reserve(awake_.size()), level.following.reserve(awake_.size());
    level.links.reserve(room), level.pairs.reserve(room);
    level.ends.reserve(2 * room), level.guards.reserve(room);
  }
}

std::size_t Islands::find(OdeSystem& system, double t, double h, std::span<const double> x) {
  begin_.clear();
  if (!possible_ || !system.force_elements().empty() || !contacts_->any_acting()) return 0;
  std::fill(awake_.begin(), awake_.end(), 0);
  with_states_.clear();
  for (const std::size_t i : system.active_segments()) {
    if (system.segments()[i].count == 0) continue;
    with_states_.push_back(i);
    awake_[i] = new_[i] = 1;
  }
  if (with_states_.size() < 2) return 0;
  system.update_motion(t, x);
  sets_.reset();
  for (const PairConnection& pair : system.connections())
    if (const int a = unit_of(pair.base), b = unit_of(pair.connection.partner); a >= 0 && b >= 0)
      sets_.join(a, b);
  links_.clear();
  for (PairContact* const pair : contacts_->moving()) {
    Link link{pair, {unit_of(pair->base), unit_of(pair->target)}, Vec3::Zero(), {}, {}};
    if (link.units[0] < 0 && link.units[1] < 0) continue;
    if (is_cross(link)) guard(system, link, h);
    pair->keep();
    links_.push_back(link);
  }
  sort_members();
  return count();
}

/// The axis on which the bounds stay furthest apart at the present velocities; without one the two are joined.
void Islands::guard(const OdeSystem& system, Link& link, double h) {
  if (link.contact->contact.held_from() != nullptr) return sets_.join(link.units[0], link.units[1]);
  const CellMotion& motion = system.motion();
  const BodyMotion* bodies[2];
  const BodyBox* boxes[2];
  Vec3 centres[2], velocities[2];
  for (int k = 0; k < 2; ++k) {
    const int component = component_of(*link.contact, k);
    bodies[k] = &body(motion, component), boxes[k] = &contacts_->surface(component).data().box;
    centres[k] = bodies[k]->X_WB * boxes[k]->center_B;
    velocities[k] = bodies[k]->V_WB.at(centres[k] - bodies[k]->X_WB.p);
  }
  const Vec3 between = centres[1] - centres[0], closing = velocities[0] - velocities[1];
  double widest = -kInfinity;
  for (int k = 0; k < 6; ++k) {
    Vec3 axis = bodies[k / 3]->X_WB.R.col(k % 3);
    if (between.dot(axis) < 0.0) axis = -axis;
    double gap = between.dot(axis) - h * std::max(0.0, closing.dot(axis));
    for (int side = 0; side < 2; ++side)
      gap -= half_along(*boxes[side], bodies[side]->X_WB.R, axis) +
             h * bodies[side]->V_WB.w.cross(axis).norm() * boxes[side]->half_B.norm();
    if (gap > widest) widest = gap, link.axis = axis;
  }
  if (!(widest > kRounding_m)) return sets_.join(link.units[0], link.units[1]);
  for (int k = 0; k < 2; ++k) link.ends[k] = link.tried[k] = reach_m(motion, link, k);
}

// Written out, as it is called in every evaluation.
double Islands::reach_m(const CellMotion& motion, const Link& link, int which) const {
  const int component = component_of(*link.contact, which);
  const BodyBox& box = contacts_->surface(component).data().box;
  const Pose& X_WB = body(motion, component).X_WB;
  const double towards = which == 0 ? 1.0 : -1.0;
  const double x = towards * link.axis[0], y = towards * link.axis[1], z = towards * link.axis[2];
  double reach = x * X_WB.p[0] + y * X_WB.p[1] + z * X_WB.p[2];
  for (int k = 0; k < 3; ++k) {
    const double along = x * X_WB.R(0, k) + y * X_WB.R(1, k) + z * X_WB.R(2, k);
    reach += along * box.center_B[k] + std::abs(along) * box.half_B[k];
  }
  return reach;
}

/// Islands in the order of their lowest segments.
void Islands::sort_members() {
  begin_.clear(), members_.clear();
  std::size_t islands = 0;
  for (const std::size_t i : with_states_)
    island_[i] = sets_.root(i) == i ? islands++ : island_[sets_.root(i)];
  members_.assign(with_states_.begin(), with_states_.end());
  std::sort(members_.begin(), members_.end(), [this](std::size_t a, std::size_t b) {
    return island_[a] != island_[b] ? island_[a] < island_[b] : a < b;
  });
  for (std::size_t i = 0; i < members_.size(); ++i)
    if (i == 0 || island_[members_[i]] != island_[members_[i - 1]]) begin_.push_back(i);
  begin_.push_back(members_.size());
  inner_.clear(), outer_.clear();
  for (std::size_t l = 0; l < links_.size(); ++l) {
    const bool crosses = is_cross(links_[l]);
    for (int k = 0; k < 2; ++k) {
      if (links_[l].units[k] < 0) continue;
      (crosses ? outer_ : inner_).push_back({island_[static_cast<std::size_t>(links_[l].units[k])], l, k});
      if (!crosses) break;
    }
  }
  std::sort(inner_.begin(), inner_.end());
  std::sort(outer_.begin(), outer_.end());
}

void Islands::attend(OdeSystem& system, std::size_t island) {
  const auto of_island = [island](const std::vector<Side>& sides) {
    const auto [first, last] =
        std::equal_range(sides.begin(), sides.end(), Side{island, 0, 0},
                         [](const Side& a, const Side& b) { return a.island < b.island; });
    return std::span<const Side>(first, last);
  };
  level_ = 0;
  Level& level = levels_[0];
  const auto members = segments(island);
  level.segments.assign(members.begin(), members.end());
  level.links.clear(), level.guards.clear(), level.following.clear();
  for (const Side& side : of_island(inner_)) level.links.push_back(side.link);
  for (const Side& side : of_island(outer_)) {
    level.guards.push_back(side);
    Link& link = links_[side.link];
    link.ends[side.which] = link.tried[side.which] = -kInfinity;
  }
  for (const std::size_t segment : members) new_[segment] = 0, level_of_[segment] = 0;
  attend_level(system);
}

void Islands::attend_level(OdeSystem& system) {
  Level& level = levels_[level_];
  level.pairs.clear(), level.ends.clear();
  for (const std::size_t link : level.links) {
    PairContact* const pair = links_[link].contact;
    level.pairs.push_back(pair);
    level.ends.push_back(pair->base), level.ends.push_back(pair->target);
  }
  std::sort(level.ends.begin(), level.ends.end());
  level.ends.erase(std::unique(level.ends.begin(), level.ends.end()), level.ends.end());
  guards_ = level.guards;
  system.attend(level.segments, level.pairs, level.ends, *this);
}

void Islands::add_connected(const OdeSystem& system, std::vector<std::size_t>& segments) {
  for (const std::size_t i : segments) marked_[i] = 1;
  for (bool added = true; added;) {
    added = false;
    for (const PairConnection& pair : system.connections()) {
      const int a = unit_of(pair.base), b = unit_of(pair.connection.partner);
      if (a < 0 || b < 0) continue;
      const auto one = static_cast<std::size_t>(a), other = static_cast<std::size_t>(b);
      if (marked_[one] == marked_[other]) continue;
      const std::size_t joined = marked_[one] != 0 ? other : one;
      marked_[joined] = 1, added = true;
      segments.push_back(joined);
    }
  }
  for (const std::size_t i : segments) marked_[i] = 0;
  std::sort(segments.begin(), segments.end());
}

void Islands::refine(OdeSystem& system, std::span<const std::size_t> segments,
                     const OdeSystem::Courses& courses) {
  const Level& whole = levels_[level_];
  Level& part = levels_[++level_];
  part.segments.assign(segments.begin(), segments.end());
  part.links.clear(), part.guards.clear(), part.following.clear();
  for (const std::size_t i : segments) level_of_[i] = level_;
  const auto is_in = [this](int unit) {
    return unit >= 0 && level_of_[static_cast<std::size_t>(unit)] == level_;
  };
  for (const Side& side : whole.guards) {
    Link& link = links_[side.link];
    const bool in = is_in(link.units[side.which]);
    (in ? link.tried : link.ends)[side.which] = (in ? link.ends : link.tried)[side.which];
    if (in) part.guards.push_back(side);
  }
  for (const std::size_t l : whole.links) {
    const Link& link = links_[l];
    if (!is_in(link.units[0]) && !is_in(link.units[1])) continue;
    part.links.push_back(l);
    for (const int unit : link.units) {
      if (unit < 0 || is_in(unit) || marked_[static_cast<std::size_t>(unit)] != 0) continue;
      marked_[static_cast<std::size_t>(unit)] = 1;
      part.following.push_back(static_cast<std::size_t>(unit));
    }
  }
  for (const std::size_t i : part.following) marked_[i] = 0;
  courses_ = &courses;
  attend_level(system);
  system.follow(courses_, part.following);
}

void Islands::resume(OdeSystem& system) {
  for (const std::size_t i : levels_[level_].segments) level_of_[i] = level_ - 1;
  --level_;
  attend_level(system);
  system.follow(courses_, levels_[level_].following);
}

void Islands::watch(const CellMotion& motion) {
  for (const Side& side : guards_) {
    Link& link = links_[side.link];
    link.tried[side.which] = std::max(link.tried[side.which], reach_m(motion, link, side.which));
  }
}

void Islands::accept() {
  for (const Side& side : guards_) links_[side.link].ends[side.which] = links_[side.link].tried[side.which];
}

void Islands::reject() {
  for (const Side& side : guards_) links_[side.link].tried[side.which] = links_[side.link].ends[side.which];
}

bool Islands::join_met() {
  bool met = false;
  for (const Side& side : outer_) {
    const Link& link = links_[side.link];
    if (side.which != 0 || link.ends[0] + link.ends[1] < -kRounding_m) continue;
    sets_.join(link.units[0], link.units[1]);
    for (const int unit : link.units) new_[static_cast<std::size_t>(unit)] = 1;
    met = true;
  }
  if (!met) return false;
  for (const std::size_t i : with_states_)
    if (new_[i] != 0) new_[sets_.root(i)] = 1;
  for (const std::size_t i : with_states_) new_[i] = new_[sets_.root(i)];
  for (const Link& link : links_)
    if (const int unit = std::max(link.units[0], link.units[1]); new_[static_cast<std::size_t>(unit)] != 0)
      link.contact->restore_kept();
  sort_members();
  return true;
}

}  // namespace takt
