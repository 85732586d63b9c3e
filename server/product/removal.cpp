#include "server/product/removal.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace takt::product {

namespace {

constexpr double kAlong = 1e-3;    ///< of the sine: directions that are parallel
constexpr double kTouch_m = 3e-5;  ///< heights closer than this do not block
constexpr double kLeastShadow_m = 2e-5;

/// Lowest and highest point of an instance over each cell of a grid across a direction.
struct HeightMap {
  int width = 0, height = 0;
  std::vector<float> lowest, highest;
};

struct Grid {
  Vec3 x, y, d;
  double x0 = 0.0, y0 = 0.0, cell = 0.0;
  int width = 0, height = 0;
};

HeightMap rasterise(const PlacedInstance& instance, const Grid& g) {
  HeightMap map{g.width, g.height, {}, {}};
  const auto cells = static_cast<std::size_t>(g.width) * static_cast<std::size_t>(g.height);
  map.lowest.assign(cells, std::numeric_limits<float>::infinity());
  map.highest.assign(cells, -std::numeric_limits<float>::infinity());
  for (const Triangle& t : instance.triangles) {
    std::array<double, 3> u, v, h;
    for (std::size_t k = 0; k < 3; ++k)
      u[k] = (t[k].dot(g.x) - g.x0) / g.cell - 0.5, v[k] = (t[k].dot(g.y) - g.y0) / g.cell - 0.5,
      h[k] = t[k].dot(g.d);
    const double area = (u[1] - u[0]) * (v[2] - v[0]) - (u[2] - u[0]) * (v[1] - v[0]);
    if (std::abs(area) < 1e-12) continue;
    const int u_from = std::max(0, static_cast<int>(std::ceil(std::min({u[0], u[1], u[2]}))));
    const int u_to = std::min(g.width - 1, static_cast<int>(std::floor(std::max({u[0], u[1], u[2]}))));
    const int v_from = std::max(0, static_cast<int>(std::ceil(std::min({v[0], v[1], v[2]}))));
    const int v_to = std::min(g.height - 1, static_cast<int>(std::floor(std::max({v[0], v[1], v[2]}))));
    for (int j = v_from; j <= v_to; ++j) {
      for (int i = u_from; i <= u_to; ++i) {
        const double a = ((u[1] - i) * (v[2] - j) - (u[2] - i) * (v[1] - j)) / area;
        const double b = ((u[2] - i) * (v[0] - j) - (u[0] - i) * (v[2] - j)) / area;
        const double c = 1.0 - a - b;
        if (a < -1e-9 || b < -1e-9 || c < -1e-9) continue;
        const auto at =
            static_cast<std::size_t>(j) * static_cast<std::size_t>(g.width) + static_cast<std::size_t>(i);
        const auto height = static_cast<float>(a * h[0] + b * h[1] + c * h[2]);
        map.lowest[at] = std::min(map.lowest[at], height);
        map.highest[at] = std::max(map.highest[at], height);
      }
    }
  }
  return map;
}

struct Range {
  double from = std::numeric_limits<double>::infinity(), to = -from;
  void add(double x) { from = std::min(from, x), to = std::max(to, x); }
};

Range range_along(const PlacedInstance& instance, const Vec3& d) {
  Range range;
  for (const Triangle& t : instance.triangles)
    for (const Vec3& p : t) range.add(p.dot(d));
  return range;
}

/// The grid over this part of the plane.
Grid window(Grid g, double x0, double x1, double y0, double y1, double least_cell_m = 0.0) {
  g.x0 = x0, g.y0 = y0;
  g.cell = std::max(std::max(x1 - x0, y1 - y0) / Removal::kGrid, least_cell_m);
  g.width = std::max(3, static_cast<int>(std::ceil((x1 - x0) / g.cell)));
  g.height = std::max(3, static_cast<int>(std::ceil((y1 - y0) / g.cell)));
  return g;
}

/// Of the whole instance (m^2).
double shadow_area(const PlacedInstance& instance, const Vec3& d) {
  Grid g;
  g.d = d, g.x = d.unitOrthogonal(), g.y = d.cross(g.x);
  const Range x = range_along(instance, g.x), y = range_along(instance, g.y);
  g = window(g, x.from, x.to, y.from, y.to);
  const HeightMap map = rasterise(instance, g);
  const auto covered =
      std::count_if(map.lowest.begin(), map.lowest.end(), [](float h) { return std::isfinite(h); });
  return static_cast<double>(covered) * g.cell * g.cell;
}

/// Around the axis of a joint, across the direction: what its surfaces overlap.
struct Ring {
  double x = 0.0, y = 0.0, inner_m = 0.0, outer_m = 0.0;
};

std::vector<Ring> rings(const std::vector<const Contact*>& joints, const Grid& g, double facets_m) {
  constexpr double kDepth = 0.75;  // of the pitch: more than any profile
  std::vector<Ring> result;
  for (const Contact* joint : joints) {
    const bool is_thread = joint->kind == ContactKind::thread;
    const double depth = std::max(-joint->clearance_m, is_thread ? kDepth * std::abs(joint->pitch_m) : 0.0);
    result.push_back({joint->point_W.dot(g.x), joint->point_W.dot(g.y),
                      joint->radius_m - depth - facets_m - kTouch_m, joint->radius_m + facets_m + kTouch_m});
  }
  return result;
}

/// The cells of a grid in which B is beyond the first point of A.
class Overlap {
 public:
  /// Of neighbouring cells: the box around them.
  struct Group {
    double x0 = 0.0, x1 = 0.0, y0 = 0.0, y1 = 0.0;
    std::size_t cells = 0;
  };

  Overlap(const PlacedInstance& A, const PlacedInstance& B, const Grid& grid, const std::vector<Ring>& rings)
      : g_(grid) {
    const HeightMap map_a = rasterise(A, g_), map_b = rasterise(B, g_);
    blocked_.assign(map_a.lowest.size(), 0);
    for (int j = 0; j < g_.height; ++j)
      for (int i = 0; i < g_.width; ++i) {
        const std::size_t k = at(i, j);
        if (!std::isfinite(map_a.lowest[k]) || !std::isfinite(map_b.lowest[k])) continue;
        if (!(map_a.lowest[k] < map_b.highest[k] - kTouch_m)) continue;
        const double x = g_.x0 + (i + 0.5) * g_.cell, y = g_.y0 + (j + 0.5) * g_.cell;
        const bool joined = std::any_of(rings.begin(), rings.end(), [&](const Ring& ring) {
          const double r = std::hypot(x - ring.x, y - ring.y);
          return r > ring.inner_m && r < ring.outer_m;
        });
        if (joined) continue;
        blocked_[k] = 1;
        ++count_;
      }
    if (count_ > 0) find_whole();
  }

  /// Some cell and all around it are blocked.
  bool blocks() const { return blocks_; }
  double area_m2() const { return static_cast<double>(count_) * g_.cell * g_.cell; }
  double cell_m() const { return g_.cell; }

  std::vector<Group> largest_groups(std::size_t most) const {
    std::vector<Group> groups;
    std::vector<char> seen(blocked_.size(), 0);
    std::vector<std::pair<int, int>> waiting;
    for (int j = 0; j < g_.height; ++j)
      for (int i = 0; i < g_.width; ++i) {
        if (blocked_[at(i, j)] == 0 || seen[at(i, j)] != 0) continue;
        int from_i = i, to_i = i, from_j = j, to_j = j;
        Group group;
        waiting.assign(1, {i, j});
        seen[at(i, j)] = 1;
        while (!waiting.empty()) {
          const auto [u, v] = waiting.back();
          waiting.pop_back();
          ++group.cells;
          from_i = std::min(from_i, u), to_i = std::max(to_i, u);
          from_j = std::min(from_j, v), to_j = std::max(to_j, v);
          for (int dv = -1; dv <= 1; ++dv)
            for (int du = -1; du <= 1; ++du) {
              const int p = u + du, q = v + dv;
              if (p < 0 || q < 0 || p >= g_.width || q >= g_.height) continue;
              if (blocked_[at(p, q)] == 0 || seen[at(p, q)] != 0) continue;
              seen[at(p, q)] = 1;
              waiting.emplace_back(p, q);
            }
        }
        // A cell of air around.
        group.x0 = g_.x0 + (from_i - 1) * g_.cell, group.x1 = g_.x0 + (to_i + 2) * g_.cell;
        group.y0 = g_.y0 + (from_j - 1) * g_.cell, group.y1 = g_.y0 + (to_j + 2) * g_.cell;
        groups.push_back(group);
      }
    std::stable_sort(groups.begin(), groups.end(),
                     [](const Group& a, const Group& b) { return a.cells > b.cells; });
    if (groups.size() > most) groups.resize(most);
    return groups;
  }

 private:
  std::size_t at(int i, int j) const {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(g_.width) + static_cast<std::size_t>(i);
  }
  void find_whole() {
    for (int j = 1; j + 1 < g_.height && !blocks_; ++j) {
      for (int i = 1; i + 1 < g_.width && !blocks_; ++i) {
        bool whole = true;
        for (int dj = -1; dj <= 1 && whole; ++dj)
          for (int di = -1; di <= 1 && whole; ++di) whole = blocked_[at(i + di, j + dj)] != 0;
        blocks_ = whole;
      }
    }
  }

  Grid g_;
  std::vector<char> blocked_;
  std::size_t count_ = 0;
  bool blocks_ = false;
};

}  // namespace

Removal::Removal(const Product& product) : product_(product), placed_(place(product)) {
  const auto add = [this](const Vec3& d) {
    for (const double sign : {1.0, -1.0}) {
      const Vec3 one = sign * d;
      const bool known = std::any_of(directions_.begin(), directions_.end(),
                                     [&](const Vec3& other) { return (other - one).norm() < kAlong; });
      if (!known) directions_.push_back(one);
    }
  };
  for (const Vec3& axis : {Vec3(0, 0, 1), Vec3(1, 0, 0), Vec3(0, 1, 0)}) add(axis);
  for (const Contact& contact : product.contacts) {
    if (contact.kind != ContactKind::other) add(contact.axis_W);
    contacts_[{contact.first, contact.second}].push_back(&contact);
  }
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z)
        if (x != 0 || y != 0 || z != 0) add(Vec3(x, y, z).normalized());
}

const std::vector<const Contact*>& Removal::contacts_of(std::size_t a, std::size_t b) const {
  static const std::vector<const Contact*> none;
  const auto found = contacts_.find({std::min(a, b), std::max(a, b)});
  return found == contacts_.end() ? none : found->second;
}

std::vector<const Contact*> Removal::joints(std::size_t a, std::size_t b, const Vec3& d) const {
  std::vector<const Contact*> result;
  for (const Contact* contact : contacts_of(a, b)) {
    const bool joins = contact->kind == ContactKind::thread ||
                       (contact->kind == ContactKind::cylinder_fit && contact->clearance_m < 0.0);
    if (joins && contact->axis_W.cross(d).norm() < kAlong) result.push_back(contact);
  }
  return result;
}

bool Removal::blocked_by_contact(std::size_t a, const Vec3& d, std::size_t b) const {
  const double sign = a < b ? 1.0 : -1.0;
  const bool along_joint = !joints(a, b, d).empty();
  for (const Contact* contact : contacts_of(a, b)) {
    if (along_joint && contact->kind != ContactKind::plane) continue;
    for (const Vec3& n : contact->normals_W) {
      // Facets of curved surfaces have normals of their own.
      const double slack = contact->kind == ContactKind::other ? 0.2 : 1e-3;
      if (sign * n.dot(d) > slack) return true;
    }
  }
  return false;
}

Removal::Shadow Removal::shadow(std::size_t a, const Vec3& d, std::size_t b) const {
  const PlacedInstance &A = placed_[a], &B = placed_[b];
  Grid g;
  g.d = d, g.x = d.unitOrthogonal(), g.y = d.cross(g.x);
  const Range heights_a = range_along(A, d), heights_b = range_along(B, d);
  if (heights_a.from >= heights_b.to - kTouch_m) return {};
  const Range ax = range_along(A, g.x), bx = range_along(B, g.x), ay = range_along(A, g.y),
              by = range_along(B, g.y);
  const double x0 = std::max(ax.from, bx.from), x1 = std::min(ax.to, bx.to);
  const double y0 = std::max(ay.from, by.from), y1 = std::min(ay.to, by.to);
  if (x1 - x0 < kLeastShadow_m || y1 - y0 < kLeastShadow_m) return {};
  const double facets_m = deflection(a) + deflection(b);
  const std::vector<Ring> joined = rings(joints(a, b, d), g, facets_m);
  const Overlap whole(A, B, window(g, x0, x1, y0, y1), joined);
  Shadow result{whole.area_m2(), whole.blocks()};
  // Narrow ones of small extent.
  constexpr std::size_t kGroups = 4;
  constexpr double kSmall = 0.5;  // of the extent
  const double finest_m = std::max(kLeastShadow_m, 2.0 * facets_m) / 3.0;
  if (result.blocks || result.area_m2 == 0.0 || whole.cell_m() < 1.5 * finest_m) return result;
  for (const Overlap::Group& group : whole.largest_groups(kGroups)) {
    const double extent = std::max(group.x1 - group.x0, group.y1 - group.y0);
    if (result.blocks || extent > kSmall * std::max(x1 - x0, y1 - y0)) continue;
    const Grid closer = window(g, group.x0, group.x1, group.y0, group.y1, finest_m);
    result.blocks = Overlap(A, B, closer, joined).blocks();
  }
  return result;
}

bool Removal::blocked(std::size_t a, std::size_t d, std::size_t b) {
  const Vec3& direction = directions_[d];
  if (blocked_by_contact(a, direction, b)) return true;
  const auto [place, fresh] = known_.try_emplace({a, d, b});
  if (fresh) place->second = shadow(a, direction, b);
  return place->second.blocks;
}

Removal::Undercut Removal::undercut(std::size_t a, std::size_t d, std::size_t b) {
  const auto [place, fresh] = known_.try_emplace({a, d, b});
  if (fresh) place->second = shadow(a, directions_[d], b);
  if (!place->second.blocks) return {};
  const auto [own, first] = own_m2_.try_emplace({a, d});
  if (first) own->second = shadow_area(placed_[a], directions_[d]);
  return {place->second.area_m2 / own->second, place->second.area_m2};
}

}  // namespace takt::product
