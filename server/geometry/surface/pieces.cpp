#include <algorithm>
#include <cmath>
#include <numeric>

#include "server/geometry/surface/clusters.h"

namespace takt {
namespace {

using Data = ContactSurface::Data;
using Place = std::vector<std::int32_t>::iterator;

/// Smallest share of its rectangle that a piece fills.
constexpr double kFilled = 0.9;

class Divider {
 public:
  explicit Divider(Data& data) : data_(data), areas_m2_(data.faces.size()) {
    for (std::size_t i = 0; i < areas_m2_.size(); ++i) {
      const auto c = data.corners(data.faces[i]);
      areas_m2_[i] = 0.5 * (c[1] - c[0]).cross(c[2] - c[0]).norm();
    }
  }

  /// Faces of one patch.
  void divide(Place begin, Place end) {
    const ContactFace& first = face(*begin);
    if (end - begin == 1) {
      const auto c = data_.corners(first);
      data_.pieces.push_back({first.patch, {c[0], c[1], c[2], c[2]}, 0, 0});
      keep(begin, end);
      return;
    }
    double area_m2 = 0.0;
    Place largest = begin;
    for (auto it = begin; it != end; ++it) {
      area_m2 += area(*it);
      if (area(*it) > area(*largest)) largest = it;
    }
    const Vec3& normal = data_.patches[static_cast<std::size_t>(first.patch)].normal;
    const auto corners = data_.corners(face(*largest));
    double least_m2 = INFINITY, length_m = 0.0, middle_m = 0.0;
    Vec3 along = Vec3::Zero();
    ContactPiece piece{first.patch, {}, 0, 0};
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 edge = corners[(k + 1) % 3] - corners[k];
      const Vec3 x = (edge - normal.dot(edge) * normal).normalized(), y = normal.cross(x);
      double from_x = INFINITY, to_x = -INFINITY, from_y = INFINITY, to_y = -INFINITY;
      for (auto it = begin; it != end; ++it)
        for (const Vec3& c : data_.corners(face(*it))) {
          from_x = std::min(from_x, x.dot(c)), to_x = std::max(to_x, x.dot(c));
          from_y = std::min(from_y, y.dot(c)), to_y = std::max(to_y, y.dot(c));
        }
      const double rectangle_m2 = (to_x - from_x) * (to_y - from_y);
      if (!(rectangle_m2 < least_m2)) continue;
      least_m2 = rectangle_m2;
      const Vec3 z = data_.patches[static_cast<std::size_t>(first.patch)].offset_m * normal;
      piece.corner = {from_x * x + from_y * y + z, to_x * x + from_y * y + z, to_x * x + to_y * y + z,
                      from_x * x + to_y * y + z};
      const bool wide = to_x - from_x >= to_y - from_y;
      along = wide ? x : y;
      length_m = std::max(to_x - from_x, to_y - from_y);
      middle_m = 0.5 * (wide ? from_x + to_x : from_y + to_y);
    }
    if (area_m2 >= kFilled * least_m2) {
      data_.pieces.push_back(piece);
      keep(begin, end);
      return;
    }
    const auto place = [&](std::int32_t index) {
      const auto c = data_.corners(face(index));
      return along.dot(c[0] + c[1] + c[2]) / 3.0;
    };
    Place middle = std::partition(begin, end, [&](std::int32_t i) { return place(i) < middle_m; });
    if (middle == begin || middle == end || !(length_m > 0.0)) {
      middle = begin + (end - begin) / 2;
      std::nth_element(begin, middle, end, [&](std::int32_t i, std::int32_t k) {
        const double a = place(i), b = place(k);
        return a != b ? a < b : i < k;
      });
    }
    divide(begin, middle);
    divide(middle, end);
  }

 private:
  void keep(Place begin, Place end) {
    ContactPiece& piece = data_.pieces.back();
    piece.begin = static_cast<std::uint32_t>(data_.piece_faces.size());
    data_.piece_faces.insert(data_.piece_faces.end(), begin, end);
    piece.end = static_cast<std::uint32_t>(data_.piece_faces.size());
  }
  const ContactFace& face(std::int32_t index) const { return data_.faces[static_cast<std::size_t>(index)]; }
  double area(std::int32_t index) const { return areas_m2_[static_cast<std::size_t>(index)]; }

  Data& data_;
  std::vector<double> areas_m2_;
};

}  // namespace

void make_pieces(Data& data) {
  std::vector<std::int32_t> order(data.faces.size());
  std::iota(order.begin(), order.end(), 0);
  const auto patch = [&data](std::int32_t i) { return data.faces[static_cast<std::size_t>(i)].patch; };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::int32_t i, std::int32_t k) { return patch(i) < patch(k); });
  data.pieces.clear(), data.piece_faces.clear();
  Divider divider(data);
  for (auto begin = order.begin(); begin != order.end();) {
    const auto end =
        std::find_if(begin, order.end(), [&](std::int32_t i) { return patch(i) != patch(*begin); });
    divider.divide(begin, end);
    begin = end;
  }
  std::vector<Aabb> boxes;
  std::vector<std::int32_t> labels;
  for (const ContactPiece& piece : data.pieces) {
    Aabb box{piece.corner[0], piece.corner[0]};
    for (const Vec3& c : piece.corner) box = {box.lower.cwiseMin(c), box.upper.cwiseMax(c)};
    boxes.push_back(box);
    labels.push_back(piece.patch);
  }
  data.piece_tree = BoxTree(boxes);
  data.piece_tree.label(labels);
}

}  // namespace takt
