#include "server/geometry/surface/distance_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>

#include "server/geometry/surface/contact_surface_data.h"

namespace takt {
namespace {

using Data = ContactSurface::Data;

constexpr std::size_t kMostBlocks = 4'000'000, kMostPlaces = std::size_t{1} << 28U;
/// Depth of the band: a quarter of the walls, beyond which the contact law is hard, within these numbers of spacings.
constexpr double kBandShare = 0.25, kLeastBand = 4.0, kMostBand = 12.0;
/// Spacings of the default in a wall and in the diagonal, and squares of a spacing on the surface.
constexpr double kPerWall = 8.0, kPerDiagonal = 64.0, kMostSquares = 2e5;
constexpr double kLeastPerWall = 4.0, kMeanErrorShare = 1.0 / 30.0;

/// The closest face of the surface, from the octree where there is one.
NearestFace nearest_face(const Data& data, const Vec3& x, std::int32_t guess) {
  if (!data.octree.empty()) {
    const FaceOctree::Leaf* leaf = data.octree.find(x);
    if (leaf != nullptr && FaceOctree::has_list(*leaf)) return data.nearest_face(x, *leaf);
  }
  return data.nearest_face(x, guess);
}

double exact_distance_m(const Data& data, const Vec3& x, std::int32_t& guess) {
  const NearestFace nearest = nearest_face(data, x, guess);
  guess = nearest.face;
  const double distance_m = std::sqrt(nearest.closest.squared_m2);
  const bool inside = data.inside(data.faces[static_cast<std::size_t>(nearest.face)], nearest.closest, x);
  return inside ? -distance_m : distance_m;
}

/// A second difference, or less at an edge, where it is about h. There the quasi-interpolant would overshoot: edges
/// would stand out of the faces beside them. Round shapes of four spacings and more count whole.
double without_edge(double bend_m, double h) {
  constexpr double kRound = 0.25;
  return bend_m * std::clamp(2.0 - std::abs(bend_m) / (kRound * h), 0.0, 1.0);
}

/// Weights of the nodes before, at and after the nearest one, for a point that is f spacings beside it.
struct Weights {
  std::array<double, 3> value, slope;
  explicit Weights(double f)
      : value{0.5 * (0.5 - f) * (0.5 - f), 0.75 - f * f, 0.5 * (0.5 + f) * (0.5 + f)},
        slope{f - 0.5, -2.0 * f, f + 0.5} {}
};
constexpr std::array<double, 3> kSecond{1.0, -2.0, 1.0};

}  // namespace

double default_field_spacing_m(const ContactSurface& surface) {
  const Aabb& box = surface.bounds_B();
  double spacing_m = (box.upper - box.lower).norm() / kPerDiagonal;
  if (surface.wall_m() > 0.0) spacing_m = std::min(spacing_m, surface.wall_m() / kPerWall);
  return std::max(spacing_m, std::sqrt(surface.area_m2() / kMostSquares));
}

/// Divides the grid until a box of blocks is outside, deep, or one block.
class DistanceField::Builder {
 public:
  explicit Builder(DistanceField& field) : field_(field), data_(field.surface_->data()) {}

  void build() {
    divide({0, 0, 0}, field_.count_);
    nodes_at_.assign(field_.index_.size(), -1);
    std::vector<Block> kept;
    for (std::size_t i = 0; i < made_.size(); ++i) {
      Block block;
      // Between positive coefficients the spline is positive: outside.
      if (fill(made_[i], block)) {
        field_.index_[field_.place(made_[i])] = static_cast<std::int32_t>(kept.size());
        kept.push_back(block);
      } else {
        field_.index_[field_.place(made_[i])] = kOutside;
      }
    }
    field_.blocks_ = std::move(kept);
    field_.blocks_.shrink_to_fit();
  }

 private:
  using NodeValues = std::array<double, static_cast<std::size_t>(kNodes) * kNodes * kNodes>;

  void divide(const Index& lower, const Index& upper) {
    const double h = field_.spacing_m_;
    const Vec3 a = field_.center(lower), b = field_.center({upper[0] - 1, upper[1] - 1, upper[2] - 1});
    const Vec3 middle = 0.5 * (a + b);
    const double radius_m = (0.5 * (b - a)).norm() + 0.5 * std::sqrt(3.0) * kNodes * h;
    const double distance_m = exact_distance_m(data_, middle, guess_);
    // Coefficients of a block depend on nodes beside it.
    const double beside_m = 2.0 * std::sqrt(3.0) * h;
    if (distance_m > radius_m + beside_m) return set(lower, upper, kOutside, middle, distance_m);
    if (distance_m < -(field_.band_m_ + radius_m)) return set(lower, upper, kDeep, middle, distance_m);
    std::size_t axis = 0;
    for (std::size_t k = 1; k < 3; ++k)
      if (upper[k] - lower[k] > upper[axis] - lower[axis]) axis = k;
    if (upper[axis] - lower[axis] == 1) {
      if (made_.size() == kMostBlocks)
        throw std::invalid_argument("a distance field with a spacing of " + std::to_string(1e3 * h) +
                                    " mm has more than " + std::to_string(kMostBlocks) +
                                    " blocks; choose a larger field_spacing_m");
      set(lower, upper, 0, middle, distance_m);
      return made_.push_back(lower);
    }
    Index half = upper, begin = lower;
    half[axis] = begin[axis] = lower[axis] + (upper[axis] - lower[axis]) / 2;
    divide(lower, half);
    divide(begin, upper);
  }

  void set(const Index& lower, const Index& upper, std::int32_t kind, const Vec3& middle, double distance_m) {
    Index at;
    for (at[0] = lower[0]; at[0] < upper[0]; ++at[0])
      for (at[1] = lower[1]; at[1] < upper[1]; ++at[1])
        for (at[2] = lower[2]; at[2] < upper[2]; ++at[2]) {
          const std::size_t place = field_.place(at);
          field_.index_[place] = kind;
          const double least_m = distance_m - (field_.center(at) - middle).norm();
          field_.clear_m_[place] =
              std::nextafter(static_cast<float>(least_m), -std::numeric_limits<float>::infinity());
        }
  }

  /// Exact distance at a node, once.
  double node(const Index& at) {
    Index block, in;
    for (std::size_t k = 0; k < 3; ++k) {
      block[k] = std::clamp(at[k] >= 0 ? at[k] / kNodes : -1, 0, field_.count_[k] - 1);
      in[k] = at[k] - kNodes * block[k];
    }
    const auto exact = [&] {
      return exact_distance_m(data_, field_.lower_ + field_.spacing_m_ * Vec3(at[0], at[1], at[2]), guess_);
    };
    for (const std::int32_t k : in)
      if (k < 0 || k >= kNodes) return exact();  // beside the grid
    std::int32_t& number = nodes_at_[field_.place(block)];
    if (number < 0) {
      number = static_cast<std::int32_t>(nodes_.size());
      nodes_.emplace_back();
      nodes_.back().fill(std::numeric_limits<double>::quiet_NaN());
    }
    double& value = nodes_[static_cast<std::size_t>(number)]
                          [static_cast<std::size_t>((in[0] * kNodes + in[1]) * kNodes + in[2])];
    if (std::isnan(value)) value = exact();
    return value;
  }

  /// False if all coefficients are positive.
  bool fill(const Index& block, Block& to) {
    constexpr std::int32_t kSide = kStored + 2;
    std::array<double, static_cast<std::size_t>(kSide) * kSide * kSide> d{};
    const auto value = [&d](std::int32_t i, std::int32_t j, std::int32_t k) -> double& {
      return d[static_cast<std::size_t>((i * kSide + j) * kSide + k)];
    };
    const auto at_rim = [](std::int32_t i) { return i == 0 || i == kSide - 1 ? 1 : 0; };
    for (std::int32_t i = 0; i < kSide; ++i)
      for (std::int32_t j = 0; j < kSide; ++j)
        for (std::int32_t k = 0; k < kSide; ++k)
          if (at_rim(i) + at_rim(j) + at_rim(k) < 2)  // second differences are along one axis
            value(i, j, k) =
                node({kNodes * block[0] + i - 2, kNodes * block[1] + j - 2, kNodes * block[2] + k - 2});
    bool below = false;
    for (std::int32_t i = 1; i <= kStored; ++i)
      for (std::int32_t j = 1; j <= kStored; ++j)
        for (std::int32_t k = 1; k <= kStored; ++k) {
          const double twice = 2.0 * value(i, j, k), h = field_.spacing_m_;
          const double bend = without_edge(value(i - 1, j, k) + value(i + 1, j, k) - twice, h) +
                              without_edge(value(i, j - 1, k) + value(i, j + 1, k) - twice, h) +
                              without_edge(value(i, j, k - 1) + value(i, j, k + 1) - twice, h);
          const auto c = static_cast<float>(value(i, j, k) - 0.125 * bend);
          to[static_cast<std::size_t>(((i - 1) * kStored + j - 1) * kStored + k - 1)] = c;
          below = below || !(c > 0.0F);
        }
    return below;
  }

  DistanceField& field_;
  const Data& data_;
  std::int32_t guess_ = -1;
  std::vector<Index> made_;
  std::vector<std::int32_t> nodes_at_;  ///< by block
  std::vector<NodeValues> nodes_;
};

DistanceField::DistanceField(std::shared_ptr<const ContactSurface> surface, double spacing_m)
    : surface_(std::move(surface)), spacing_m_(spacing_m), over_m_(1.0 / spacing_m) {
  if (!(spacing_m > 0.0 && std::isfinite(spacing_m)))
    throw std::invalid_argument("field_spacing_m is " + std::to_string(spacing_m) + "; it must be positive");
  const Data& data = surface_->data();
  const Aabb& box = data.bounds;
  band_m_ = std::clamp(kBandShare * data.wall_m, kLeastBand * spacing_m, kMostBand * spacing_m);
  std::size_t places = 1;
  for (Eigen::Index k = 0; k < 3; ++k) {
    // Nodes lie beside the faces of a box as on its other side.
    const double blocks = std::ceil(((box.upper[k] - box.lower[k]) * over_m_ + 2.0) / kNodes);
    if (!(blocks < 1e6) || !(blocks * static_cast<double>(places) < static_cast<double>(kMostPlaces)))
      throw std::invalid_argument("field_spacing_m is " + std::to_string(spacing_m) +
                                  ", too small for a mesh of " +
                                  std::to_string((box.upper - box.lower).maxCoeff()) +
                                  " m; choose a larger one, or, of a file in millimetres, mesh_scale: 0.001");
    count_[static_cast<std::size_t>(k)] = static_cast<std::int32_t>(blocks);
    places *= static_cast<std::size_t>(blocks);
  }
  const Vec3 size = spacing_m * (Vec3(count_[0], count_[1], count_[2]) * kNodes - Vec3::Ones());
  lower_ = data.box.center_B - 0.5 * size;
  index_.assign(places, kOutside);
  clear_m_.assign(places, 0.0F);
  Builder(*this).build();
  measure();
}

Vec3 DistanceField::center(const Index& block) const {
  return lower_ +
         spacing_m_ * (Vec3(block[0], block[1], block[2]) * kNodes + Vec3::Constant(0.5 * (kNodes - 1)));
}

bool DistanceField::locate(const Vec3& x, Index& block, Index& at, Vec3& beside) const {
  for (std::size_t k = 0; k < 3; ++k) {
    const auto axis = static_cast<Eigen::Index>(k);
    const double u = (x[axis] - lower_[axis]) * over_m_ + 0.5;
    if (!(u >= 0.0 && u < static_cast<double>(kNodes * count_[k]))) return false;
    const auto node = static_cast<std::int32_t>(u);
    beside[axis] = u - 0.5 - static_cast<double>(node);
    block[k] = node / kNodes;
    at[k] = node % kNodes;
  }
  return true;
}

bool DistanceField::find(const Vec3& x, Depth& depth) const {
  const Data& data = surface_->data();
  for (Eigen::Index k = 0; k < 3; ++k)
    if (!(x[k] >= data.bounds.lower[k] && x[k] <= data.bounds.upper[k])) return false;
  Index block, at;
  Vec3 beside;
  if (!locate(x, block, at, beside)) return false;
  const std::int32_t number = index_[place(block)];
  if (number == kOutside) return false;
  if (number == kDeep) {
    const NearestFace nearest = nearest_face(data, x, -1);
    const double distance_m = std::sqrt(nearest.closest.squared_m2);
    if (!(distance_m > 0.0)) return false;
    depth.depth_m = distance_m;
    depth.gradient = (x - nearest.closest.q) / distance_m;
    return true;
  }
  const Block& c = blocks_[static_cast<std::size_t>(number)];
  const Weights wx(beside.x()), wy(beside.y()), wz(beside.z());
  double value = 0.0, gx = 0.0, gy = 0.0, gz = 0.0;
  for (std::int32_t i = 0; i < 3; ++i) {
    double v = 0.0, vy = 0.0, vz = 0.0;
    for (std::int32_t j = 0; j < 3; ++j) {
      const float* row =
          c.data() + static_cast<std::size_t>(((at[0] + i) * kStored + at[1] + j) * kStored + at[2]);
      const double a = row[0], b = row[1], d = row[2];
      const double along = wz.value[0] * a + wz.value[1] * b + wz.value[2] * d;
      const double slope = wz.slope[0] * a + wz.slope[1] * b + wz.slope[2] * d;
      const auto m = static_cast<std::size_t>(j);
      v += wy.value[m] * along;
      vy += wy.slope[m] * along;
      vz += wy.value[m] * slope;
    }
    const auto m = static_cast<std::size_t>(i);
    value += wx.value[m] * v;
    gx += wx.slope[m] * v;
    gy += wx.value[m] * vy;
    gz += wx.value[m] * vz;
  }
  if (!(value < 0.0)) return false;
  depth.depth_m = -value;
  depth.gradient = -over_m_ * Vec3(gx, gy, gz);
  return true;
}

Mat3 DistanceField::curvature(const Vec3& x) const {
  Index block, at;
  Vec3 beside;
  Mat3 result = Mat3::Zero();
  if (!locate(x, block, at, beside)) return result;
  const std::int32_t number = index_[place(block)];
  if (number < 0) return result;
  const Block& c = blocks_[static_cast<std::size_t>(number)];
  const std::array<Weights, 3> w{Weights(beside.x()), Weights(beside.y()), Weights(beside.z())};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t k = 0; k < 3; ++k) {
        const auto side = static_cast<std::size_t>(kStored);
        const double value =
            c[((static_cast<std::size_t>(at[0]) + i) * side + static_cast<std::size_t>(at[1]) + j) * side +
              static_cast<std::size_t>(at[2]) + k];
        result(0, 0) += kSecond[i] * w[1].value[j] * w[2].value[k] * value;
        result(1, 1) += w[0].value[i] * kSecond[j] * w[2].value[k] * value;
        result(2, 2) += w[0].value[i] * w[1].value[j] * kSecond[k] * value;
        result(0, 1) += w[0].slope[i] * w[1].slope[j] * w[2].value[k] * value;
        result(0, 2) += w[0].slope[i] * w[1].value[j] * w[2].slope[k] * value;
        result(1, 2) += w[0].value[i] * w[1].slope[j] * w[2].slope[k] * value;
      }
  result(1, 0) = result(0, 1), result(2, 0) = result(0, 2), result(2, 1) = result(1, 2);
  return -over_m_ * over_m_ * result;
}

double DistanceField::at_least_m(const Vec3& x) const {
  Index block, at;
  Vec3 beside;
  if (locate(x, block, at, beside))
    return static_cast<double>(clear_m_[place(block)]) - (x - center(block)).norm();
  const Aabb& box = surface_->data().bounds;
  double sum = 0.0;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const double beyond = std::max({box.lower[k] - x[k], x[k] - box.upper[k], 0.0});
    sum += beyond * beyond;
  }
  return std::sqrt(sum);
}

void DistanceField::measure() {
  constexpr std::size_t kPoints = 4000;
  const Data& data = surface_->data();
  report_.spacing_m = spacing_m_;
  report_.blocks = blocks_.size();
  report_.bytes = blocks_.size() * sizeof(Block) + index_.size() * (sizeof(std::int32_t) + sizeof(float));
  std::vector<double> area_until;
  double area_m2 = 0.0;
  for (const ContactFace& face : data.faces) {
    const auto c = data.corners(face);
    area_m2 += 0.5 * (c[1] - c[0]).cross(c[2] - c[0]).norm();
    area_until.push_back(area_m2);
  }
  std::mt19937_64 random(1);
  const auto uniform = [&random] { return static_cast<double>(random() >> 11U) * 0x1.0p-53; };
  double sum_m = 0.0;
  std::size_t count = 0;
  std::int32_t guess = -1;
  for (std::size_t i = 0; i < kPoints; ++i) {
    const auto found = std::upper_bound(area_until.begin(), area_until.end(), uniform() * area_m2);
    const auto f = std::min(static_cast<std::size_t>(found - area_until.begin()), data.faces.size() - 1);
    const auto c = data.corners(data.faces[f]);
    double u = uniform(), v = uniform();
    if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
    const Vec3 on = c[0] + u * (c[1] - c[0]) + v * (c[2] - c[0]);
    const Vec3& normal = data.patches[static_cast<std::size_t>(data.faces[f].patch)].normal;
    const Vec3 x = on - 2.0 * spacing_m_ * uniform() * normal;
    const double exact_m = exact_distance_m(data, x, guess);
    if (exact_m > 0.0) continue;  // through a thin wall
    Depth depth;
    const double found_m = find(x, depth) ? -depth.depth_m : 0.0;
    const double error_m = std::abs(found_m - exact_m);
    sum_m += error_m;
    ++count;
    if (error_m > report_.largest_error_m) report_.largest_error_m = error_m, report_.largest_at = x;
  }
  if (count > 0) report_.mean_error_m = sum_m / static_cast<double>(count);
  report_.resolves = count > 0 && data.wall_m >= kLeastPerWall * spacing_m_ &&
                     report_.mean_error_m <= kMeanErrorShare * spacing_m_;
}

}  // namespace takt
