#include "server/geometry/surface/clusters.h"

#include <algorithm>
#include <cmath>

namespace takt {
namespace {

using Data = ContactSurface::Data;
/// An element, together in memory: the order of elements changes again and again.
struct Element {
  Vec3 p_B, normal_B;
  std::uint32_t index;
};
using Place = std::vector<Element>::iterator;

/// Largest number of elements of a leaf: exactly flat, flat up to a cosine, any other.
constexpr std::ptrdiff_t kLeaf = 64, kCurvedLeaf = 32, kSmall = 4;
constexpr double kFlat = 0.9999, kCurved = 0.95;
/// Weight of a change of the normal against a distance of one radius of the body: flat faces are separated
/// before they are divided.
constexpr double kNormalWeight = 8.0;

class Builder {
 public:
  explicit Builder(Data& data) : data_(data), normal_weight_m_(kNormalWeight * data.radius_m) {
    order_.reserve(data.element_count());
    for (std::uint32_t i = 0; i < data.element_count(); ++i)
      order_.push_back({data.point(i), data.normal(i), i});
  }

  void build() {
    data_.clusters.clear();
    if (!order_.empty()) divide(order_.begin(), order_.end());
    const auto reorder = [this](auto& values) {
      auto old = values;
      for (std::size_t i = 0; i < order_.size(); ++i) values[i] = old[order_[i].index];
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
    for (auto it = begin; it != end; ++it) normal += it->normal_B, middle += it->p_B;
    middle /= count;
    if (normal.norm() > 0.5 * count) {
      const Vec3 z = normal.normalized();
      Vec3 x = z.unitOrthogonal(), y = z.cross(x);
      double xx = 0.0, yy = 0.0, xy = 0.0;
      for (auto it = begin; it != end; ++it) {
        const Vec3 d = it->p_B - middle;
        const double a = d.dot(x), b = d.dot(y);
        xx += a * a, yy += b * b, xy += a * b;
      }
      const double angle = 0.5 * std::atan2(2.0 * xy, xx - yy);
      const Vec3 along = std::cos(angle) * x + std::sin(angle) * y;
      c.axes_B.col(0) = along;
      c.axes_B.col(1) = z.cross(along);
      c.axes_B.col(2) = z;
      c.cone_cos = 1.0;
      for (auto it = begin; it != end; ++it) c.cone_cos = std::min(c.cone_cos, z.dot(it->normal_B));
    }
    Vec3 lower = Vec3::Constant(INFINITY), upper = -lower;
    for (auto it = begin; it != end; ++it) {
      const Vec3 p = c.axes_B.transpose() * it->p_B;
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
    Eigen::Array<double, 6, 1> least = Eigen::Array<double, 6, 1>::Constant(INFINITY), most = -least;
    for (auto it = begin; it != end; ++it) {
      least.head<3>() = least.head<3>().min(it->p_B.array()),
      most.head<3>() = most.head<3>().max(it->p_B.array());
      least.tail<3>() = least.tail<3>().min(it->normal_B.array());
      most.tail<3>() = most.tail<3>().max(it->normal_B.array());
    }
    least.tail<3>() *= normal_weight_m_, most.tail<3>() *= normal_weight_m_;
    int widest = 0;
    const double width = (most - least).maxCoeff(&widest), low = least[widest];
    const auto value = [&](const Element& e) {
      return widest < 3 ? e.p_B[widest] : normal_weight_m_ * e.normal_B[widest - 3];
    };
    Place middle = begin + (end - begin) / 2;
    if (widest >= 3)
      middle = std::partition(begin, end, [&](const Element& e) { return value(e) < low + 0.5 * width; });
    if (widest < 3 || middle == begin || middle == end) {
      middle = begin + (end - begin) / 2;
      std::nth_element(begin, middle, end, [&](const Element& i, const Element& k) {
        const double a = value(i), b = value(k);
        return a != b ? a < b : i.index < k.index;
      });
    }
    divide(begin, middle);
    const std::int32_t second = divide(middle, end);
    data_.clusters[index].second = second;
    return static_cast<std::int32_t>(index);
  }

  Data& data_;
  double normal_weight_m_;
  std::vector<Element> order_;
};

}  // namespace

void make_clusters(Data& data) {
  Builder(data).build();
}

}  // namespace takt
