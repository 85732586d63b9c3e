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

Range range_along(const PlacedInstance& instance, const Vec3& d);

/// Of the whole instance (m^2).
double shadow_area(const PlacedInstance& instance, const Vec3& d) {
  Grid g;
  g.d = d, g.x = d.unitOrthogonal(), g.y = d.cross(g.x);
  const Range x = range_along(instance, g.x), y = range_along(instance, g.y);
  g.x0 = x.from, g.y0 = y.from;
  g.cell = std::max(x.to - x.from, y.to - y.from) / Removal::kGrid;
  g.width = static_cast<int>(std::ceil((x.to - x.from) / g.cell)) + 1;
  g.height = static_cast<int>(std::ceil((y.to - y.from) / g.cell)) + 1;
  const HeightMap map = rasterise(instance, g);
  const auto covered =
      std::count_if(map.lowest.begin(), map.lowest.end(), [](float h) { return std::isfinite(h); });
  return static_cast<double>(covered) * g.cell * g.cell;
}

Range range_along(const PlacedInstance& instance, const Vec3& d) {
  Range range;
  for (const Triangle& t : instance.triangles)
    for (const Vec3& p : t) range.add(p.dot(d));
  return range;
}

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

bool Removal::threaded(std::size_t a, std::size_t b, const Vec3& d) const {
  const auto& contacts = contacts_of(a, b);
  return std::any_of(contacts.begin(), contacts.end(), [&](const Contact* contact) {
    const bool joins = contact->kind == ContactKind::thread ||
                       (contact->kind == ContactKind::cylinder_fit && contact->clearance_m < 0.0);
    return joins && contact->axis_W.cross(d).norm() < kAlong;
  });
}

bool Removal::blocked_by_contact(std::size_t a, const Vec3& d, std::size_t b) const {
  const double sign = a < b ? 1.0 : -1.0;
  const bool along_thread = threaded(a, b, d);
  for (const Contact* contact : contacts_of(a, b)) {
    if (along_thread && contact->kind != ContactKind::plane) continue;
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
  g.x0 = x0, g.y0 = y0;
  g.cell = std::max(x1 - x0, y1 - y0) / kGrid;
  g.width = std::max(3, static_cast<int>(std::ceil((x1 - x0) / g.cell)));
  g.height = std::max(3, static_cast<int>(std::ceil((y1 - y0) / g.cell)));
  const HeightMap map_a = rasterise(A, g), map_b = rasterise(B, g);
  const auto at = [&](int i, int j) {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(g.width) + static_cast<std::size_t>(i);
  };
  std::vector<char> bad(map_a.lowest.size(), 0);
  std::size_t blocked = 0;
  for (std::size_t k = 0; k < bad.size(); ++k) {
    if (!std::isfinite(map_a.lowest[k]) || !std::isfinite(map_b.lowest[k])) continue;
    bad[k] = map_a.lowest[k] < map_b.highest[k] - kTouch_m ? 1 : 0;
    blocked += bad[k] != 0 ? 1U : 0U;
  }
  Shadow result;
  result.area_m2 = static_cast<double>(blocked) * g.cell * g.cell;
  for (int j = 1; j + 1 < g.height && !result.blocks; ++j) {
    for (int i = 1; i + 1 < g.width && !result.blocks; ++i) {
      bool whole = true;
      for (int dj = -1; dj <= 1 && whole; ++dj)
        for (int di = -1; di <= 1 && whole; ++di) whole = bad[at(i + di, j + dj)] != 0;
      result.blocks = whole;
    }
  }
  return result;
}

bool Removal::blocked(std::size_t a, std::size_t d, std::size_t b) {
  const Vec3& direction = directions_[d];
  if (blocked_by_contact(a, direction, b)) return true;
  if (threaded(a, b, direction)) return false;
  const auto [place, fresh] = known_.try_emplace({a, d, b});
  if (fresh) place->second = shadow(a, direction, b);
  return place->second.blocks;
}

double Removal::blocked_share(std::size_t a, std::size_t d, std::size_t b) {
  const auto [place, fresh] = known_.try_emplace({a, d, b});
  if (fresh) place->second = shadow(a, directions_[d], b);
  if (!place->second.blocks) return 0.0;
  const auto [own, first] = own_m2_.try_emplace({a, d});
  if (first) own->second = shadow_area(placed_[a], directions_[d]);
  return place->second.area_m2 / own->second;
}

}  // namespace takt::product
