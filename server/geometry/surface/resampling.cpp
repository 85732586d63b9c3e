#include "server/geometry/surface/resampling.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

#include "server/geometry/surface/rim_strips.h"

namespace takt {
namespace {

using Data = ContactSurface::Data;
using Vec2 = Eigen::Vector2d;
using Polygon = std::vector<Vec2>;  // convex, counter-clockwise

/// Smaller cells, which rounding and rims leave over, join a neighbour.
constexpr double kSmallShare = 1e-3;
/// Smaller parts of cells are rounding.
constexpr double kRounding = 1e-9;
/// A point no further beside a face than this share of the spacing is on it.
constexpr double kMargin = 1e-6;
/// A face that is longer than a number of cells by this share of one gets none more: single precision.
constexpr double kCellSlack = 1e-4;
/// Width of a strip over the spacing, which is half an element edge.
constexpr double kStripShare = 2.0 * kRimShare;
/// Cells in which the centre of the area is beside the surface are divided as often.
constexpr int kDeepest = 4;

/// Share of the largest coordinate by which vertices of one plane are beside it: four units in the last place of
/// single precision.
constexpr double kFlatness = 2.4e-7;

struct Fragment {
  Polygon polygon;
  double stretch = 1.0;  ///< area of the face over area of its projection on the plane of the region
  std::int32_t face = -1;
};

struct Moments {
  double area = 0.0;
  Vec2 first = Vec2::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();

  void add(const Polygon& polygon, double stretch) {
    for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
      const Vec2 &a = polygon[0], &b = polygon[i], &c = polygon[i + 1];
      const Vec2 u = b - a, v = c - a, sum = a + b + c;
      const double part = 0.5 * stretch * (u.x() * v.y() - u.y() * v.x());
      area += part;
      first += part / 3.0 * sum;
      second +=
          part / 12.0 * (a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose());
    }
  }
  double slenderness() const {
    const Vec2 centre = first / area;
    const Eigen::Matrix2d about = second / area - centre * centre.transpose();
    const double mean = 0.5 * (about(0, 0) + about(1, 1));
    const double half = std::hypot(0.5 * (about(0, 0) - about(1, 1)), about(0, 1));
    return mean > half ? std::sqrt((mean + half) / (mean - half)) : INFINITY;
  }
};

/// The part of a convex polygon at or above the limit of a coordinate (sign 1), or at or below it (sign -1).
Polygon clipped(const Polygon& polygon, Eigen::Index axis, double limit, double sign) {
  Polygon kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2 &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double at_a = sign * (a[axis] - limit), at_b = sign * (b[axis] - limit);
    if (at_a >= 0.0) kept.push_back(a);
    if ((at_a > 0.0 && at_b < 0.0) || (at_a < 0.0 && at_b > 0.0)) {
      Vec2 cut = a + at_a / (at_a - at_b) * (b - a);
      cut[axis] = limit;
      kept.push_back(cut);
    }
  }
  return kept.size() < 3 ? Polygon{} : kept;
}

/// Edges shorter than the margin, which cuts near a corner leave, have a direction of rounding.
bool contains(const Polygon& polygon, const Vec2& p, double margin) {
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2 u = polygon[(i + 1) % polygon.size()] - polygon[i], v = p - polygon[i];
    if (u.norm() <= margin) continue;
    if (u.x() * v.y() - u.y() * v.x() < -margin * u.norm()) return false;
  }
  return true;
}

/// Andrew's monotone chain, of points rounded to `unit`: the corners of neighbours are equal but for rounding.
Polygon hull(std::vector<Vec2> points, double unit) {
  for (Vec2& p : points) p = (p / unit).array().round();
  std::sort(points.begin(), points.end(),
            [](const Vec2& a, const Vec2& b) { return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y(); });
  Polygon result(2 * points.size());
  std::size_t k = 0;
  const auto add = [&](const Vec2& p, std::size_t least) {
    const auto turns = [&] {
      const Vec2 u = result[k - 1] - result[k - 2], v = p - result[k - 2];
      return u.x() * v.y() - u.y() * v.x() > 0.0;
    };
    while (k >= least && !turns()) --k;
    result[k++] = p;
  };
  for (const Vec2& p : points) add(p, 2);
  const std::size_t lower = k + 1;
  for (std::size_t i = points.size() - 1; i-- > 0;) add(points[i], lower);
  result.resize(k > 1 ? k - 1 : k);
  for (Vec2& p : result) p *= unit;
  return result;
}

Vec3 area_vector(const TriangleCorners& corner) {
  return 0.5 * (corner[1] - corner[0]).cross(corner[2] - corner[0]);
}

/// Grows regions from the largest faces, in circles. A needle's own normal is inexact, but its neighbour's corners
/// are near; with the region grows the exactness of its plane.
class RegionFinder {
 public:
  explicit RegionFinder(const Data& data) : data_(data) {
    found_.of_face.assign(data.faces.size(), -1);
    double largest = 0.0;
    for (const Vec3& v : data.vertices) largest = std::max(largest, v.cwiseAbs().maxCoeff());
    found_.flatness_m = kFlatness * largest;
    for (const ContactFace& face : data.faces) areas_.push_back(area_vector(data.corners(face)));
  }

  FlatRegions run() {
    std::vector<std::int32_t> order(data_.faces.size());
    std::iota(order.begin(), order.end(), 0);
    std::vector<double> size;
    for (const Vec3& area : areas_) size.push_back(area.squaredNorm());
    std::stable_sort(order.begin(), order.end(), [&](std::int32_t a, std::int32_t b) {
      return size[static_cast<std::size_t>(a)] > size[static_cast<std::size_t>(b)];
    });
    for (const std::int32_t seed : order)
      if (found_.of_face[static_cast<std::size_t>(seed)] < 0) grow(seed);
    return std::move(found_);
  }

 private:
  void grow(std::int32_t seed) {
    const auto number = static_cast<std::int32_t>(found_.regions.size());
    FlatRegion region;
    Vec3 sum = Vec3::Zero(), moment = Vec3::Zero();
    const auto take = [&](std::int32_t f) {
      const auto corner = data_.corners(data_.faces[static_cast<std::size_t>(f)]);
      const Vec3& area = areas_[static_cast<std::size_t>(f)];
      found_.of_face[static_cast<std::size_t>(f)] = number;
      region.faces.push_back(f);
      sum += area;
      moment += area.norm() / 3.0 * (corner[0] + corner[1] + corner[2]);
      weight_ += area.norm();
      region.normal = sum.normalized();
      region.point = moment / weight_;
    };
    weight_ = 0.0;
    take(seed);
    for (std::size_t i = 0; i < region.faces.size(); ++i)
      for (const std::int32_t next : data_.faces[static_cast<std::size_t>(region.faces[i])].neighbour)
        if (found_.of_face[static_cast<std::size_t>(next)] < 0 && is_in_plane(next, region)) take(next);
    std::sort(region.faces.begin(), region.faces.end());
    found_.regions.push_back(std::move(region));
  }

  bool is_in_plane(std::int32_t f, const FlatRegion& region) const {
    if (!(areas_[static_cast<std::size_t>(f)].dot(region.normal) >
          0.5 * areas_[static_cast<std::size_t>(f)].norm()))
      return false;
    const auto corner = data_.corners(data_.faces[static_cast<std::size_t>(f)]);
    return std::all_of(corner.begin(), corner.end(), [&](const Vec3& c) {
      return std::abs(region.normal.dot(c - region.point)) <= found_.flatness_m;
    });
  }

  const Data& data_;
  double weight_ = 0.0;
  std::vector<Vec3> areas_;
  FlatRegions found_;
};

class RegionSampler {
 public:
  RegionSampler(const Data& data, const FlatRegions& regions, std::size_t region, double spacing_m)
      : data_(data), regions_(regions), region_(regions.regions[region]), spacing_m_(spacing_m) {}

  std::vector<SurfaceSample> run(Rims rims) {
    choose_axes();
    choose_cells();
    if (rims == Rims::strips) choose_strips();
    for (const std::int32_t f : region_.faces) cut(f);
    join_small_cells();
    for (auto& [place, fragments] : cells_) take_strips(fragments, 0, false);
    return std::move(samples_);
  }

 private:
  using Place = std::pair<std::int64_t, std::int64_t>;
  using Fragments = std::vector<Fragment>;

  const ContactFace& face(std::int32_t index) const { return data_.faces[static_cast<std::size_t>(index)]; }
  Vec2 local(const Vec3& p) const { return {x_.dot(p - origin_), y_.dot(p - origin_)}; }

  std::int32_t region_of(std::int32_t f) const { return regions_.of_face[static_cast<std::size_t>(f)]; }

  struct Run {
    Vec3 from, to;
    bool is_sharp;  ///< the next face turns away along all of it
    double length_m() const { return (to - from).norm(); }
  };
  /// Along a run, which goes around the region counter-clockwise.
  struct Strip {
    Vec2 from, along;
    double length_m, width_m;
    double beside_m(const Vec2& p) const {
      const Vec2 v = p - from;
      return along.x() * v.y() - along.y() * v.x();
    }
  };

  /// Along the longest straight run of the rim, whose edges may be short. Of equally long ones a direction counts, not
  /// the order of faces.
  void choose_axes() {
    const Vec3 order = Vec3(1.0, 0.618, 0.382).normalized();
    origin_ = region_.point;
    x_ = region_.normal.unitOrthogonal();
    double longest_m = 0.0, first = 0.0;
    for (const Run& run : straight_runs()) {
      const double length_m = run.length_m();
      if (length_m < longest_m * (1.0 - kCellSlack)) continue;
      const Vec3 along = run.to - run.from;
      const Vec3 x = (along - region_.normal.dot(along) * region_.normal).normalized();
      const double place = std::abs(order.dot(x));
      if (length_m <= longest_m * (1.0 + kCellSlack) && place <= first) continue;
      longest_m = std::max(longest_m, length_m);
      first = place;
      x_ = x;
    }
    y_ = region_.normal.cross(x_);
  }

  /// Of the rim's loops, beginning at their sharpest corners.
  std::vector<Run> straight_runs() const {
    struct RimEdge {
      std::uint32_t to;
      bool is_sharp;
    };
    std::map<std::uint32_t, RimEdge> next;  // by vertex along the rim
    for (const std::int32_t f : region_.faces)
      for (std::size_t k = 0; k < 3; ++k)
        if (region_of(face(f).neighbour[k]) != region_of(f))
          next.try_emplace(face(f).vertex[k],
                           RimEdge{face(f).vertex[(k + 1) % 3], turns_away(data_, face(f), k)});
    std::vector<Run> runs;
    while (!next.empty()) {
      std::vector<Vec3> loop;
      std::vector<char> sharp;
      for (auto at = next.begin(); at != next.end();) {
        loop.push_back(data_.vertices[at->first]);
        sharp.push_back(at->second.is_sharp ? 1 : 0);
        const std::uint32_t to = at->second.to;
        next.erase(at);
        at = next.find(to);
      }
      add_runs(loop, sharp, runs);
    }
    return runs;
  }

  void add_runs(const std::vector<Vec3>& loop, const std::vector<char>& sharp, std::vector<Run>& runs) const {
    const std::size_t n = loop.size();
    const auto at = [&](std::size_t i) -> const Vec3& { return loop[i % n]; };
    std::size_t corner = 0;
    double sharpest = 2.0;
    for (std::size_t i = 0; i < n; ++i) {
      const double cosine = (at(i + 1) - at(i)).normalized().dot((at(i) - at(i + n - 1)).normalized());
      if (cosine < sharpest) sharpest = cosine, corner = i;
    }
    std::size_t begin = corner;
    for (std::size_t i = corner + 1; i <= corner + n; ++i) {
      const Vec3 along = (at(i + 1) - at(begin)).normalized(), beside = at(i) - at(begin);
      const bool straight = i < corner + n && along.dot(beside) > 0.0 &&
                            (beside - along.dot(beside) * along).norm() <= regions_.flatness_m;
      if (straight) continue;
      bool is_sharp = true;
      for (std::size_t k = begin; k < i; ++k) is_sharp = is_sharp && sharp[k % n] != 0;
      runs.push_back({at(begin), at(i), is_sharp});
      begin = i;
    }
  }

  /// Where the region is at least a cell wide.
  void choose_strips() {
    for (const Run& run : straight_runs()) {
      if (!run.is_sharp || run.length_m() < spacing_m_ * (1.0 - kCellSlack)) continue;
      const Vec2 from = local(run.from), along = local(run.to) - from;
      Strip strip{from, along.normalized(), along.norm(), kStripShare * spacing_m_};
      double widest_m = 0.0;
      for (const std::int32_t f : region_.faces)
        for (const Vec3& corner : data_.corners(face(f)))
          widest_m = std::max(widest_m, strip.beside_m(local(corner)));
      if (widest_m >= spacing_m_ * (1.0 - kCellSlack)) strips_.push_back(strip);
    }
  }

  void choose_cells() {
    Vec2 upper = Vec2::Constant(-std::numeric_limits<double>::infinity());
    lower_ = -upper;
    for (const std::int32_t f : region_.faces)
      for (const Vec3& c : data_.corners(face(f)))
        lower_ = lower_.cwiseMin(local(c)), upper = upper.cwiseMax(local(c));
    for (Eigen::Index axis = 0; axis < 2; ++axis) {
      const double length = upper[axis] - lower_[axis];
      count_[static_cast<std::size_t>(axis)] =
          std::max<std::int64_t>(1, static_cast<std::int64_t>(std::ceil(length / spacing_m_ - kCellSlack)));
      cell_[axis] = length / static_cast<double>(count_[static_cast<std::size_t>(axis)]);
    }
  }

  std::int64_t number(double value, Eigen::Index axis) const {
    const auto n = static_cast<std::int64_t>(std::floor((value - lower_[axis]) / cell_[axis]));
    return std::clamp<std::int64_t>(n, 0, count_[static_cast<std::size_t>(axis)] - 1);
  }

  /// The outermost cells have no outer limit, so that rounding loses nothing.
  Polygon strip(const Polygon& polygon, Eigen::Index axis, std::int64_t n) const {
    Polygon result = polygon;
    if (n > 0) result = clipped(result, axis, lower_[axis] + static_cast<double>(n) * cell_[axis], 1.0);
    if (n + 1 < count_[static_cast<std::size_t>(axis)])
      result = clipped(result, axis, lower_[axis] + static_cast<double>(n + 1) * cell_[axis], -1.0);
    return result;
  }

  template <class Visit>
  void for_each_strip(const Polygon& polygon, Eigen::Index axis, const Visit& visit) const {
    const auto less = [axis](const Vec2& a, const Vec2& b) { return a[axis] < b[axis]; };
    const auto [least, most] = std::minmax_element(polygon.begin(), polygon.end(), less);
    for (std::int64_t n = number((*least)[axis], axis); n <= number((*most)[axis], axis); ++n) {
      const Polygon part = strip(polygon, axis, n);
      if (!part.empty()) visit(n, part);
    }
  }

  void cut(std::int32_t f) {
    const auto corner = data_.corners(face(f));
    const Polygon triangle{local(corner[0]), local(corner[1]), local(corner[2])};
    Moments flat;
    flat.add(triangle, 1.0);
    const double area = area_vector(corner).norm();
    if (!(flat.area > 0.0)) return;
    for_each_strip(triangle, 0, [&](std::int64_t i, const Polygon& column) {
      for_each_strip(column, 1, [&](std::int64_t k, const Polygon& part) {
        cells_[{i, k}].push_back({part, area / flat.area, f});
      });
    });
  }

  static Moments moments(const Fragments& fragments) {
    Moments sum;
    for (const Fragment& part : fragments) sum.add(part.polygon, part.stretch);
    return sum;
  }

  void join_small_cells() {
    std::map<Place, double> areas;
    for (const auto& [place, fragments] : cells_) areas[place] = moments(fragments).area;
    for (const auto& [place, area] : areas) {
      if (area >= kSmallShare * cell_.x() * cell_.y()) continue;
      const auto [i, k] = place;
      auto largest = cells_.end();
      for (const Place& beside : {Place{i - 1, k}, Place{i + 1, k}, Place{i, k - 1}, Place{i, k + 1}}) {
        const auto found = cells_.find(beside);
        if (found != cells_.end() && (largest == cells_.end() || areas[beside] > areas[largest->first]))
          largest = found;
      }
      if (largest == cells_.end()) continue;
      auto& moved = cells_[place];
      largest->second.insert(largest->second.end(), moved.begin(), moved.end());
      cells_.erase(place);
    }
  }

  /// The elements of a cell, divided along the strips from this one on.
  void take_strips(const Fragments& fragments, std::size_t first, bool is_strip) {
    const double least_m2 = kSmallShare * cell_.x() * cell_.y();
    for (std::size_t k = first; k < strips_.size(); ++k) {
      Fragments inside, outside;
      divide(fragments, strips_[k], inside, outside);
      if (!(moments(outside).area > least_m2) || !(moments(inside).area > least_m2)) continue;
      take_strips(inside, k + 1, is_strip);
      return take_strips(outside, k + 1, true);
    }
    const std::size_t before = samples_.size();
    take(fragments, 0);
    for (std::size_t i = before; i < samples_.size(); ++i) samples_[i].is_strip = is_strip;
  }

  /// `outside` is the strip: the rectangle along its run.
  void divide(const Fragments& fragments, const Strip& strip, Fragments& inside, Fragments& outside) const {
    const double margin_m = kMargin * spacing_m_;
    const Vec2 inward(-strip.along.y(), strip.along.x());
    // Inside of the rectangle where direction . (p - from) + shift_m is not negative.
    const std::pair<Vec2, double> limits[] = {
        {strip.along, 0.0}, {-strip.along, strip.length_m}, {inward, margin_m}, {-inward, strip.width_m}};
    for (const Fragment& part : fragments) {
      const auto is_apart = [&](const auto& limit) {
        return std::all_of(part.polygon.begin(), part.polygon.end(), [&](const Vec2& p) {
          return limit.first.dot(p - strip.from) + limit.second <= margin_m;
        });
      };
      if (std::any_of(std::begin(limits), std::end(limits), is_apart)) {
        inside.push_back(part);
        continue;
      }
      Fragment rest = part;
      for (const auto& [direction, shift_m] : limits) {
        Fragment beyond{{}, part.stretch, part.face};
        Polygon within;
        cut_along(rest.polygon, strip.from, direction, shift_m, within, beyond.polygon);
        rest.polygon = std::move(within);
        if (beyond.polygon.size() >= 3) inside.push_back(std::move(beyond));
      }
      if (rest.polygon.size() >= 3) outside.push_back(std::move(rest));
    }
  }

  static void cut_along(const Polygon& polygon, const Vec2& from, const Vec2& direction, double shift_m,
                        Polygon& within, Polygon& beyond) {
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vec2 &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
      const double at_a = direction.dot(a - from) + shift_m, at_b = direction.dot(b - from) + shift_m;
      if (at_a >= 0.0) within.push_back(a);
      if (at_a <= 0.0) beyond.push_back(a);
      if ((at_a < 0.0 && at_b > 0.0) || (at_a > 0.0 && at_b < 0.0)) {
        const Vec2 cut = a + at_a / (at_a - at_b) * (b - a);
        within.push_back(cut);
        beyond.push_back(cut);
      }
    }
  }

  /// One element; several if the centre of the area is beside the region (around a hole, between two arms).
  void take(const Fragments& fragments, int depth) {
    const Moments all = moments(fragments);
    if (!(all.area > 0.0)) return;
    const Vec2 centre = all.first / all.area;
    const double margin = kMargin * spacing_m_;
    const auto home = std::find_if(fragments.begin(), fragments.end(), [&](const Fragment& part) {
      return moments({part}).area > kRounding * cell_.x() * cell_.y() &&
             contains(part.polygon, centre, margin);
    });
    if (home != fragments.end() || fragments.size() == 1)
      return add(fragments, all, home != fragments.end() ? home->face : fragments.front().face);
    if (depth == kDeepest) {
      for (const Fragment& part : fragments) take({part}, depth);
      return;
    }
    Vec2 upper = Vec2::Constant(-std::numeric_limits<double>::infinity()), lower = -upper;
    for (const Fragment& part : fragments)
      for (const Vec2& p : part.polygon) lower = lower.cwiseMin(p), upper = upper.cwiseMax(p);
    const Eigen::Index axis = upper.x() - lower.x() >= upper.y() - lower.y() ? 0 : 1;
    for (const double sign : {-1.0, 1.0}) {
      Fragments half;
      for (const Fragment& part : fragments) {
        Polygon kept = clipped(part.polygon, axis, centre[axis], sign);
        if (!kept.empty()) half.push_back({std::move(kept), part.stretch, part.face});
      }
      if (!half.empty()) take(half, depth + 1);
    }
  }

  void add(const Fragments& fragments, const Moments& all, std::int32_t f) {
    const auto at = [this](const Vec2& p) -> Vec3 { return origin_ + p.x() * x_ + p.y() * y_; };
    SurfaceSample sample{on_face(at(all.first / all.area), f), all.area, all.slenderness(),
                         static_cast<std::uint32_t>(f),        {},       false};
    std::vector<Vec2> points;
    for (const Fragment& part : fragments)
      points.insert(points.end(), part.polygon.begin(), part.polygon.end());
    for (const Vec2& p : hull(std::move(points), 1e-7 * spacing_m_)) sample.outline.push_back(at(p));
    samples_.push_back(std::move(sample));
  }

  /// The plane of the region is beside the face by rounding.
  Vec3 on_face(const Vec3& p, std::int32_t f) const { return data_.closest_on_face(face(f), p).q; }

  const Data& data_;
  const FlatRegions& regions_;
  const FlatRegion& region_;
  const double spacing_m_;
  Vec3 origin_, x_, y_;
  Vec2 lower_, cell_;
  std::array<std::int64_t, 2> count_{};
  std::map<Place, Fragments> cells_;
  std::vector<Strip> strips_;
  std::vector<SurfaceSample> samples_;
};

}  // namespace

double slenderness(const TriangleCorners& corners) {
  const Vec3 u = corners[1] - corners[0], v = corners[2] - corners[0];
  const double length = u.norm();
  if (!(length > 0.0)) return INFINITY;
  const double along = u.dot(v) / length;
  Moments moments;
  moments.add({Vec2::Zero(), Vec2(length, 0.0), Vec2(along, u.cross(v).norm() / length)}, 1.0);
  return moments.area > 0.0 ? moments.slenderness() : INFINITY;
}

FlatRegions find_flat_regions(const Data& data) {
  return RegionFinder(data).run();
}

std::vector<SurfaceSample> sample_region(const Data& data, const FlatRegions& regions, std::size_t region,
                                         double spacing_m, Rims rims) {
  return RegionSampler(data, regions, region, spacing_m).run(rims);
}

}  // namespace takt
