#include "server/geometry/surface/clusters.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace takt {
namespace {

using Data = ContactSurface::Data;
using Place = std::vector<std::uint32_t>::iterator;

/// Largest number of elements of a leaf: exactly flat, flat up to a cosine, any other.
constexpr std::ptrdiff_t kLeaf = 64, kCurvedLeaf = 32, kSmall = 4;
constexpr double kFlat = 0.9999, kCurved = 0.95;
/// Weight of a change of the normal against a distance of one radius of the body: flat faces are separated
/// before they are divided.
constexpr double kNormalWeight = 8.0;

class Builder {
 public:
  explicit Builder(Data& data) : data_(data), order_(data.element_count()) {
    std::iota(order_.begin(), order_.end(), 0U);
  }

  void build() {
    data_.clusters.clear();
    if (!order_.empty()) divide(order_.begin(), order_.end());
    const auto reorder = [this](auto& values) {
      auto old = values;
      for (std::size_t i = 0; i < order_.size(); ++i) values[i] = old[order_[i]];
    };
    for (auto* values : {&data_.px, &data_.py, &data_.pz, &data_.nx, &data_.ny, &data_.nz, &data_.area_m2})
      reorder(*values);
    reorder(data_.triangle);
    if (!data_.outlines.empty()) reorder(data_.outlines);
  }

 private:
  ContactCluster around(Place begin, Place end) const {
    ContactCluster c;
    c.begin = static_cast<std::uint32_t>(begin - order_.begin());
    c.end = static_cast<std::uint32_t>(end - order_.begin());
    const auto count = static_cast<double>(end - begin);
    Vec3 normal = Vec3::Zero(), middle = Vec3::Zero();
    for (auto it = begin; it != end; ++it) normal += data_.normal(*it), middle += data_.point(*it);
    middle /= count;
    if (normal.norm() > 0.5 * count) {
      const Vec3 z = normal.normalized();
      Vec3 x = z.unitOrthogonal(), y = z.cross(x);
      double xx = 0.0, yy = 0.0, xy = 0.0;
      for (auto it = begin; it != end; ++it) {
        const Vec3 d = data_.point(*it) - middle;
        const double a = d.dot(x), b = d.dot(y);
        xx += a * a, yy += b * b, xy += a * b;
      }
      const double angle = 0.5 * std::atan2(2.0 * xy, xx - yy);
      const Vec3 along = std::cos(angle) * x + std::sin(angle) * y;
      c.axes_B.col(0) = along;
      c.axes_B.col(1) = z.cross(along);
      c.axes_B.col(2) = z;
      c.cone_cos = 1.0;
      for (auto it = begin; it != end; ++it) c.cone_cos = std::min(c.cone_cos, z.dot(data_.normal(*it)));
    }
    Vec3 lower = Vec3::Constant(INFINITY), upper = -lower;
    for (auto it = begin; it != end; ++it) {
      const Vec3 p = c.axes_B.transpose() * data_.point(*it);
      lower = lower.cwiseMin(p), upper = upper.cwiseMax(p);
    }
    c.center_B = c.axes_B * (0.5 * (lower + upper));
    c.half_m = 0.5 * (upper - lower) + Vec3::Constant(1e-12);
    c.radius_m = c.half_m.norm();
    return c;
  }

  std::int32_t divide(Place begin, Place end) {
    const auto index = data_.clusters.size();
    data_.clusters.push_back(around(begin, end));
    const double cosine = data_.clusters[index].cone_cos;
    if (end - begin <= (cosine >= kFlat ? kLeaf : cosine >= kCurved ? kCurvedLeaf : kSmall))
      return static_cast<std::int32_t>(index);
    // The widest of six coordinates: position and normal.
    const auto value = [this](std::uint32_t e, int axis) {
      return axis < 3 ? data_.point(e)[axis] : kNormalWeight * data_.radius_m * data_.normal(e)[axis - 3];
    };
    int widest = 0;
    double width = -1.0, low = 0.0;
    for (int axis = 0; axis < 6; ++axis) {
      double least = INFINITY, most = -INFINITY;
      for (auto it = begin; it != end; ++it)
        least = std::min(least, value(*it, axis)), most = std::max(most, value(*it, axis));
      if (most - least > width) width = most - least, widest = axis, low = least;
    }
    Place middle = begin + (end - begin) / 2;
    if (widest >= 3)
      middle =
          std::partition(begin, end, [&](std::uint32_t e) { return value(e, widest) < low + 0.5 * width; });
    if (widest < 3 || middle == begin || middle == end) {
      middle = begin + (end - begin) / 2;
      std::nth_element(begin, middle, end, [&](std::uint32_t i, std::uint32_t k) {
        const double a = value(i, widest), b = value(k, widest);
        return a != b ? a < b : i < k;
      });
    }
    divide(begin, middle);
    const std::int32_t second = divide(middle, end);
    data_.clusters[index].second = second;
    return static_cast<std::int32_t>(index);
  }

  Data& data_;
  std::vector<std::uint32_t> order_;
};

}  // namespace

void make_clusters(Data& data) {
  Builder(data).build();
}

}  // namespace takt
