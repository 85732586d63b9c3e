#include "server/geometry/surface/rim_strips.h"

#include <algorithm>
#include <limits>

namespace takt {
namespace {

constexpr double kTurns_cos = 0.94;  // 20 degrees

/// Parts of a convex polygon on both sides of a line, by the distances of its corners.
void split(const std::vector<Vec3>& polygon, const std::vector<double>& distance_m, std::vector<Vec3>& outer,
           std::vector<Vec3>& inner) {
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const std::size_t next = (k + 1) % polygon.size();
    const double here = distance_m[k], there = distance_m[next];
    if (here <= 0.0) outer.push_back(polygon[k]);
    if (here >= 0.0) inner.push_back(polygon[k]);
    if ((here < 0.0 && there > 0.0) || (here > 0.0 && there < 0.0)) {
      const Vec3 cut = polygon[k] + here / (here - there) * (polygon[next] - polygon[k]);
      outer.push_back(cut);
      inner.push_back(cut);
    }
  }
}

}  // namespace

bool turns_away(const ContactSurface::Data& data, const ContactFace& face, std::size_t edge) {
  const ContactFace& beyond = data.faces[static_cast<std::size_t>(face.neighbour[edge])];
  const Vec3& normal = data.patches[static_cast<std::size_t>(face.patch)].normal;
  const Vec3& other = data.patches[static_cast<std::size_t>(beyond.patch)].normal;
  return !(normal.dot(other) > kTurns_cos) && !(other.dot(face.inward[edge]) > 0.0);
}

RimStrips::RimStrips(const ContactSurface::Data& data, std::size_t face, double edge_m)
    : width_m_(kRimShare * edge_m) {
  if (!(edge_m > 0.0)) return;
  const ContactFace& here = data.faces[face];
  for (std::size_t k = 0; k < 3; ++k) {
    if (!turns_away(data, here, k)) continue;
    const double wide_m = here.inward[k].dot(data.vertices[here.vertex[(k + 2) % 3]]) + here.shift_m[k];
    if (wide_m < 0.5 * edge_m) continue;
    lines_.push_back({here.inward[k], here.shift_m[k] - width_m_});
  }
}

void RimStrips::divide(const TriangleCorners& piece, std::vector<std::vector<Vec3>>& parts) const {
  if (lines_.empty()) return;
  // A part that is thinner than this stays with its neighbour.
  const double least_m = 1e-3 * width_m_;
  std::vector<std::vector<Vec3>> open(1, std::vector<Vec3>(piece.begin(), piece.end()));
  std::vector<double> distance_m;
  bool cut = false;
  for (const Line& line : lines_) {
    std::vector<std::vector<Vec3>> divided;
    for (const std::vector<Vec3>& part : open) {
      double least = std::numeric_limits<double>::infinity(), most = -least;
      distance_m.clear();
      for (const Vec3& corner : part) {
        distance_m.push_back(line.inward.dot(corner) + line.shift_m);
        least = std::min(least, distance_m.back()), most = std::max(most, distance_m.back());
      }
      if (least > -least_m || most < least_m) {
        divided.push_back(part);
        continue;
      }
      std::vector<Vec3> outer, inner;
      split(part, distance_m, outer, inner);
      divided.push_back(std::move(outer));
      divided.push_back(std::move(inner));
      cut = true;
    }
    open = std::move(divided);
  }
  if (cut) parts.insert(parts.end(), open.begin(), open.end());
}

double mean_element_area_m2(const ContactSurface& surface) {
  return surface.area_m2() / static_cast<double>(surface.element_count() - surface.data().strip_count);
}

double area_and_centroid(const std::vector<Vec3>& polygon, Vec3& centroid) {
  double sum = 0.0;
  centroid = Vec3::Zero();
  for (std::size_t k = 1; k + 1 < polygon.size(); ++k) {
    const double area = 0.5 * (polygon[k] - polygon[0]).cross(polygon[k + 1] - polygon[0]).norm();
    sum += area;
    centroid += area / 3.0 * (polygon[0] + polygon[k] + polygon[k + 1]);
  }
  if (sum > 0.0)
    centroid /= sum;
  else
    centroid = polygon[0];
  return sum;
}

}  // namespace takt
