#include "server/product/support.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <set>

namespace takt::product {

namespace {

constexpr double kSame_m = 1e-6;
constexpr double kNothing = std::numeric_limits<double>::infinity();

/// Squares under a part, seen from below.
class Grid {
 public:
  static constexpr int kCells = 24;

  explicit Grid(const Aabb& box)
      : from_(box.lower), size_((box.upper - box.lower).cwiseMax(kSame_m) / kCells) {}

  static std::size_t count() { return static_cast<std::size_t>(kCells) * kCells; }
  Vec3 lower(std::size_t cell) const {
    const std::size_t i = cell / kCells, j = cell % kCells;
    return {from_.x() + static_cast<double>(i) * size_.x(), from_.y() + static_cast<double>(j) * size_.y(),
            0.0};
  }
  Vec3 size() const { return {size_.x(), size_.y(), 0.0}; }

  /// By cell: the lowest point of the part there.
  std::vector<double> lowest(const PlacedInstance& part) const {
    std::vector<double> result(count(), kNothing);
    for (const Triangle& t : part.triangles)
      for_cells(t, [&](std::size_t cell, double low, double) {
        if (low >= result[cell]) return;
        const Vec3 a = lower(cell), b = a + size();
        Polygon polygon(t.begin(), t.end());
        clip(polygon, Vec3::UnitX(), b.x());
        clip(polygon, -Vec3::UnitX(), -a.x());
        clip(polygon, Vec3::UnitY(), b.y());
        clip(polygon, -Vec3::UnitY(), -a.y());
        for (const Vec3& p : polygon) result[cell] = std::min(result[cell], p.z());
      });
    return result;
  }

  /// By cell: the part has a horizontal face there at its lowest point, in the middle and, if `whole`, in the corners.
  std::vector<bool> flat(const PlacedInstance& part, const std::vector<double>& lowest, bool whole) const {
    std::vector<int> covered(count(), 0);
    constexpr std::array<std::array<double, 2>, 5> kPlaces{
        {{0.5, 0.5}, {0.02, 0.02}, {0.02, 0.98}, {0.98, 0.02}, {0.98, 0.98}}};
    for (const Triangle& t : part.triangles) {
      const Vec3 n = normal_of(t);
      if (n.z() > -0.999 * n.norm()) continue;
      for_cells(t, [&](std::size_t cell, double low, double high) {
        if (std::abs(low - lowest[cell]) > kSame_m || high - low > kSame_m) return;
        for (std::size_t k = 0; k < (whole ? kPlaces.size() : 1); ++k)
          if (covers(t, lower(cell).x() + kPlaces[k][0] * size_.x(),
                     lower(cell).y() + kPlaces[k][1] * size_.y(), -1.0))
            covered[cell] |= 1 << k;
      });
    }
    std::vector<bool> result;
    result.reserve(covered.size());
    for (const int places : covered) result.push_back(places == (whole ? 31 : 1));
    return result;
  }

 private:
  /// Calls `visit(cell, low, high)` for each cell under the box of the triangle, with its least and largest height.
  template <class Visit>
  void for_cells(const Triangle& t, Visit visit) const {
    const Vec3 low = t[0].cwiseMin(t[1]).cwiseMin(t[2]), high = t[0].cwiseMax(t[1]).cwiseMax(t[2]);
    const auto [i0, i1] = range(low.x(), high.x(), 0);
    const auto [j0, j1] = range(low.y(), high.y(), 1);
    for (int i = i0; i <= i1; ++i)
      for (int j = j0; j <= j1; ++j)
        visit(static_cast<std::size_t>(i) * kCells + static_cast<std::size_t>(j), low.z(), high.z());
  }
  std::pair<int, int> range(double low, double high, int axis) const {
    const auto cell = [&](double x) {
      return static_cast<int>(std::clamp(std::floor((x - from_[axis]) / size_[axis]), -1.0, 1.0 * kCells));
    };
    return {std::max(cell(low), 0), std::min(cell(high), kCells - 1)};
  }

  Vec3 from_, size_;
};

struct Place {
  Vec3 lower, upper;  ///< of the top of a post
};

/// Where posts can carry a part: free below, on the lowest flat face that there is; else below its lowest free point.
std::vector<Place> places_under(const std::vector<PlacedInstance>& placed, std::size_t part) {
  const PlacedInstance& body = placed[part];
  const Grid grid(body.box);
  const std::vector<double> top = grid.lowest(body);
  std::vector<double> others(Grid::count(), kNothing);
  for (std::size_t other = 0; other < placed.size(); ++other) {
    const Aabb& b = placed[other].box;
    if (other == part || b.lower.z() > body.box.upper.z() ||
        ((b.lower - body.box.upper).head<2>().array() > 0.0).any() ||
        ((body.box.lower - b.upper).head<2>().array() > 0.0).any())
      continue;
    const std::vector<double> lowest = grid.lowest(placed[other]);
    for (std::size_t c = 0; c < lowest.size(); ++c) others[c] = std::min(others[c], lowest[c]);
  }
  const auto place = [&](std::size_t c) {
    Place result{grid.lower(c), grid.lower(c) + grid.size()};
    result.lower.z() = result.upper.z() = top[c];
    return result;
  };
  const auto free = [&](std::size_t c) { return top[c] < kNothing && others[c] > top[c] + kSame_m; };
  for (const bool whole : {true, false}) {
    const std::vector<bool> flat = grid.flat(body, top, whole);
    std::vector<std::size_t> cells;
    double lowest = kNothing;
    for (std::size_t c = 0; c < flat.size(); ++c)
      if (flat[c] && free(c)) lowest = std::min(lowest, top[c]);
    for (std::size_t c = 0; c < flat.size(); ++c)
      if (flat[c] && free(c) && top[c] - lowest < kSame_m) cells.push_back(c);
    if (cells.empty()) continue;
    // The four places that lie furthest out along the diagonals carry it.
    std::set<std::size_t> chosen;
    for (const double sx : {-1.0, 1.0})
      for (const double sy : {-1.0, 1.0})
        chosen.insert(*std::max_element(cells.begin(), cells.end(), [&](std::size_t a, std::size_t b) {
          const Vec3 from = grid.lower(a), to = grid.lower(b);
          return sx * from.x() + sy * from.y() < sx * to.x() + sy * to.y();
        }));
    std::vector<Place> result;
    result.reserve(chosen.size());
    for (const std::size_t c : chosen) result.push_back(place(c));
    return result;
  }
  std::size_t best = Grid::count();
  for (std::size_t c = 0; c < top.size(); ++c)
    if (free(c) && (best == Grid::count() || top[c] < top[best] - kSame_m)) best = c;
  if (best == Grid::count()) return {};
  return {place(best)};
}

/// Of a vertical line through an instance: where it enters, and where it leaves for the first time.
struct Stretch {
  double from = 0.0, to = 0.0;
};

std::optional<Stretch> lowest_stretch(const PlacedInstance& part, double x, double y) {
  std::vector<double> heights;
  for (const Triangle& t : part.triangles) {
    const Vec3 n = normal_of(t);
    if (n.z() == 0.0 || !covers(t, x, y, n.z() > 0.0 ? 1.0 : -1.0)) continue;
    heights.push_back(t[0].z() - (n.x() * (x - t[0].x()) + n.y() * (y - t[0].y())) / n.z());
  }
  std::sort(heights.begin(), heights.end());
  for (const double height : heights)
    if (height - heights.front() > kSame_m) return Stretch{heights.front(), height};
  return std::nullopt;
}

/// A box inside the instance, above its underside by more than the distance at which components touch, where it is thick
/// enough. Around it there is more of the instance than above it, so that it carries from below. As near to the middle as
/// can be.
TriangleMesh pad_in(const PlacedInstance& part) {
  constexpr double kBelow_m = 2.5e-4, kTop_m = 5e-4, kShareBelow = 0.25, kShareTop = 0.5;
  const Vec3 middle = 0.5 * (part.box.lower + part.box.upper);
  std::vector<Vec3> places;
  const Grid grid(part.box);
  for (std::size_t c = 0; c < Grid::count(); ++c) places.push_back(grid.lower(c) + 0.5 * grid.size());
  constexpr std::size_t kTriangles = 100;
  std::vector<Triangle> undersides;
  for (const Triangle& t : part.triangles)
    if (normal_of(t).z() < 0.0) undersides.push_back(t);
  std::stable_sort(undersides.begin(), undersides.end(),
                   [](const Triangle& a, const Triangle& b) { return normal_of(a).z() < normal_of(b).z(); });
  undersides.resize(std::min(undersides.size(), kTriangles));
  for (const Triangle& t : undersides) places.emplace_back((t[0] + t[1] + t[2]) / 3.0);
  std::stable_sort(places.begin(), places.end(), [&](const Vec3& a, const Vec3& b) {
    return (a - middle).head<2>().norm() < (b - middle).head<2>().norm();
  });
  for (const double around_m : {1e-3, 3e-4, 1e-4, 0.0}) {
    for (const Vec3& at : places) {
      const auto here = lowest_stretch(part, at.x(), at.y());
      if (!here) continue;
      const double thickness = here->to - here->from;
      const double from = here->from + std::min(kBelow_m, kShareBelow * thickness),
                   to = here->from + std::min(kTop_m, kShareTop * thickness);
      const auto inside = [&](double dx, double dy) {
        const auto there = lowest_stretch(part, at.x() + dx, at.y() + dy);
        return there && there->from < from && there->to > to;
      };
      if (around_m > 0.0 &&
          !(inside(around_m, 0) && inside(-around_m, 0) && inside(0, around_m) && inside(0, -around_m)))
        continue;
      const double half = 0.25 * std::max(around_m, 1e-4);
      return box_mesh(Vec3(at.x() - half, at.y() - half, from), Vec3(at.x() + half, at.y() + half, to));
    }
  }
  return box_mesh(middle - Vec3::Constant(kBelow_m), middle + Vec3::Constant(kBelow_m));
}

/// By instance: a number that those have in common which a chain of contacts joins.
std::vector<std::size_t> chains(const Product& product) {
  std::vector<std::size_t> chain(product.instances.size());
  std::iota(chain.begin(), chain.end(), std::size_t{0});
  for (const Contact& contact : product.contacts) {
    const std::size_t from = chain[contact.first], to = chain[contact.second];
    std::replace(chain.begin(), chain.end(), from, to);
  }
  return chain;
}

TriangleMesh box_of(const Place& post, double floor_m) {
  Vec3 foot = post.lower;
  foot.z() = floor_m;
  return box_mesh(foot, post.upper);
}

double lowest_of(const std::vector<PlacedInstance>& placed) {
  double lowest = kNothing;
  for (const PlacedInstance& instance : placed) lowest = std::min(lowest, instance.box.lower.z());
  return lowest;
}

}  // namespace

std::vector<TriangleMesh> posts_under(const std::vector<PlacedInstance>& placed, std::size_t part,
                                      double floor_m) {
  std::vector<TriangleMesh> result;
  for (const Place& post : places_under(placed, part)) result.push_back(box_of(post, floor_m));
  return result;
}

bool can_stand(const std::vector<PlacedInstance>& placed, std::size_t part) {
  return placed[part].box.lower.z() - lowest_of(placed) < kSame_m || !places_under(placed, part).empty();
}

Support support_of(const Product& product, const std::vector<PlacedInstance>& placed,
                   const Disassembly& plan) {
  BoxBuilder all;
  for (const PlacedInstance& instance : placed) all.add(instance.box.lower), all.add(instance.box.upper);
  const double lowest = lowest_of(placed);
  const Vec3 size = all.box.upper - all.box.lower;
  const double margin = 0.1 * std::max(size.x(), size.y()), thickness = 0.05 * size.maxCoeff();
  // Room for the tallest group that leaves downwards.
  double room = 0.0;
  for (const RemovalStep& step : plan.steps) {
    if (step.direction_W.z() > -0.5) continue;
    BoxBuilder group;
    for (const std::size_t i : step.parts) group.add(placed[i].box.lower), group.add(placed[i].box.upper);
    room = std::max(room, group.box.upper.z() - group.box.lower.z());
  }
  Support result;
  std::vector<Place> posts;
  const auto is_lowest = [&](std::size_t i) { return placed[i].box.lower.z() - lowest < kSame_m; };
  const auto carry = [&](std::size_t i) {
    const std::vector<Place> places = places_under(placed, i);
    posts.insert(posts.end(), places.begin(), places.end());
    return !places.empty();
  };
  const bool on_plate = is_lowest(plan.base) && (room == 0.0 || !carry(plan.base));
  std::set<std::size_t> on_pads(plan.on_pads.begin(), plan.on_pads.end());
  if (!on_plate && posts.empty() && !carry(plan.base)) on_pads.insert(plan.base);
  const std::vector<std::size_t> chain = chains(product);
  for (const std::size_t i : hierarchy(product, plan).floating)
    if (chain[i] != chain[plan.base] && !(on_plate && is_lowest(i)) && !carry(i)) on_pads.insert(i);
  result.on_pads.assign(on_pads.begin(), on_pads.end());
  for (const std::size_t i : result.on_pads) result.pads.push_back(pad_in(placed[i]));
  result.floor_m = on_plate ? lowest : lowest - 0.25 * size.z() - 2.0 * room;
  const Vec3 beside(margin, margin, 0.0);
  Vec3 lower = all.box.lower - beside, upper = all.box.upper + beside;
  lower.z() = result.floor_m - thickness, upper.z() = result.floor_m;
  result.boxes.push_back(box_mesh(lower, upper));
  for (const Place& post : posts)
    if (post.upper.z() - result.floor_m > kSame_m) result.boxes.push_back(box_of(post, result.floor_m));
  return result;
}

}  // namespace takt::product
