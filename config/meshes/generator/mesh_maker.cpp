#include "config/meshes/generator/mesh_maker.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace takt::meshes {

namespace {
constexpr double kPi = std::numbers::pi;
}

Ring reversed(Ring ring) {
  std::reverse(ring.begin(), ring.end());
  return ring;
}

Vec3 cylindrical(double radius, double angle, double z) {
  return {radius * std::cos(angle), radius * std::sin(angle), z};
}

std::uint32_t MeshMaker::vertex(const Vec3& p) {
  solid_.vertices.push_back(p);
  return static_cast<std::uint32_t>(solid_.vertices.size() - 1);
}

void MeshMaker::strip(const Row& left, const Row& right) {
  std::size_t i = 0, k = 0;
  while (i + 1 < left.vertex.size() || k + 1 < right.vertex.size()) {
    const bool left_ends = i + 1 == left.vertex.size(), right_ends = k + 1 == right.vertex.size();
    const bool go_right = left_ends || (!right_ends && right.key[k + 1] <= left.key[i + 1]);
    if (go_right) {
      triangle(left.vertex[i], right.vertex[k], right.vertex[k + 1]);
      ++k;
    } else {
      triangle(left.vertex[i], right.vertex[k], left.vertex[i + 1]);
      ++i;
    }
  }
}

void MeshMaker::ring(const Ring& lower, const Ring& upper) {
  for (std::size_t i = 0; i < lower.size(); ++i) {
    const std::size_t next = (i + 1) % lower.size();
    triangle(lower[i], lower[next], upper[next]);
    triangle(lower[i], upper[next], upper[i]);
  }
}

void MeshMaker::fan(const Ring& ring, const Vec3& center) {
  const std::uint32_t middle = vertex(center);
  for (std::size_t i = 0; i < ring.size(); ++i) triangle(ring[i], ring[(i + 1) % ring.size()], middle);
}

Ring MeshMaker::circle(double radius, int columns, double z) {
  Ring ring;
  for (int i = 0; i < columns; ++i) ring.push_back(vertex(cylindrical(radius, 2.0 * kPi * i / columns, z)));
  return ring;
}

Ring MeshMaker::hexagon(double across_flats, int columns, double z) {
  Ring ring;
  for (int i = 0; i < columns; ++i) {
    const double angle = 2.0 * kPi * i / columns;
    const double from_flat = std::remainder(angle - kPi / 6.0, kPi / 3.0);
    ring.push_back(vertex(cylindrical(0.5 * across_flats / std::cos(from_flat), angle, z)));
  }
  return ring;
}

Ring MeshMaker::wall(Ring ring, double z, double edge) {
  const std::vector<Vec3>& corners = solid_.vertices;
  const double from = corners[ring.front()].z();
  const int pieces = std::max(1, static_cast<int>(std::ceil(std::abs(z - from) / edge - 1e-9)));
  for (int k = 1; k <= pieces; ++k) {
    Ring next;
    for (const std::uint32_t v : ring) {
      const Vec3 at = corners[v];
      next.push_back(vertex({at.x(), at.y(), from + (z - from) * k / pieces}));
    }
    this->ring(ring, next);
    ring = std::move(next);
  }
  return ring;
}

}  // namespace takt::meshes
