#pragma once
// Closed meshes of bodies that are not convex, their volumes known in closed form.
#include <array>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "server/geometry/mesh/triangle_mesh.h"

namespace takt::test {

/// The prism over a simple polygon (counter-clockwise in the x-y plane) between two heights; `cap` lists the
/// triangles of the polygon, counter-clockwise.
inline TriangleMesh prism(const std::vector<std::array<double, 2>>& outline,
                          const std::vector<std::array<std::uint32_t, 3>>& cap, double z0, double z1) {
  TriangleMesh mesh;
  const auto n = static_cast<std::uint32_t>(outline.size());
  for (const double z : {z0, z1}) {
    for (const auto& p : outline) mesh.vertices.emplace_back(p[0], p[1], z);
  }
  for (const auto& t : cap) {
    mesh.triangles.push_back({t[0], t[2], t[1]});
    mesh.triangles.push_back({t[0] + n, t[1] + n, t[2] + n});
  }
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t k = (i + 1) % n;
    mesh.triangles.push_back({i, k, k + n});
    mesh.triangles.push_back({i, k + n, i + n});
  }
  return mesh;
}

/// A solid box, its frame at the centre of the bottom face, moved by `offset`.
inline TriangleMesh box_mesh(const Vec3& size, const Vec3& offset = Vec3::Zero()) {
  const double x = 0.5 * size.x();
  const double y = 0.5 * size.y();
  TriangleMesh mesh = prism({{-x, -y}, {x, -y}, {x, y}, {-x, y}}, {{0, 1, 2}, {0, 2, 3}}, 0.0, size.z());
  for (Vec3& v : mesh.vertices) v += offset;
  return mesh;
}

/// 100 x 80 x 60 mm, its bottom at z = 0.
inline TriangleMesh block_mesh() {
  return box_mesh({0.1, 0.08, 0.06});
}

/// A U: 100 mm wide (x), 80 mm high (y), 50 mm deep (z); legs and floor 20 mm thick, open towards +y. Volume
/// 220 000 mm^3, its pocket 180 000 mm^3.
inline TriangleMesh u_shape() {
  return prism({{0.0, 0.0},
                {0.1, 0.0},
                {0.1, 0.08},
                {0.08, 0.08},
                {0.08, 0.02},
                {0.02, 0.02},
                {0.02, 0.08},
                {0.0, 0.08}},
               {{0, 5, 7}, {5, 6, 7}, {0, 1, 5}, {1, 4, 5}, {1, 2, 4}, {2, 3, 4}}, 0.0, 0.05);
}

/// A box open at the top, its frame at the centre of the bottom face: outer size, walls and floor `wall`
/// thick.
inline TriangleMesh open_box(const Vec3& size, double wall) {
  TriangleMesh mesh;
  const auto ring = [&mesh](double x, double y, double z) {
    for (const auto& [sx, sy] : {std::pair{-1.0, -1.0}, {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}})
      mesh.vertices.emplace_back(sx * x, sy * y, z);
  };
  const double x = 0.5 * size.x();
  const double y = 0.5 * size.y();
  ring(x, y, 0.0);                     // 0: outside, below
  ring(x, y, size.z());                // 4: outside, rim
  ring(x - wall, y - wall, size.z());  // 8: inside, rim
  ring(x - wall, y - wall, wall);      // 12: inside, floor
  const auto quad = [&mesh](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  };
  quad(3, 2, 1, 0);
  quad(12, 13, 14, 15);
  for (std::uint32_t i = 0; i < 4; ++i) {
    const std::uint32_t k = (i + 1) % 4;
    quad(i, k, k + 4, i + 4);
    quad(i + 4, k + 4, k + 8, i + 8);
    quad(i + 8, k + 8, k + 12, i + 12);
  }
  return mesh;
}

/// The same as five boxes: floor, then the walls along x and along y.
inline std::vector<TriangleMesh> open_box_by_hand(const Vec3& size, double wall) {
  const double inner_y = size.y() - 2.0 * wall;
  const double height = size.z() - wall;
  std::vector<TriangleMesh> parts{box_mesh({size.x(), size.y(), wall})};
  for (const double side : {-0.5, 0.5}) {
    parts.push_back(box_mesh({size.x(), wall, height}, {0.0, side * (size.y() - wall), wall}));
    parts.push_back(box_mesh({wall, inner_y, height}, {side * (size.x() - wall), 0.0, wall}));
  }
  return parts;
}

inline double open_box_volume(const Vec3& size, double wall) {
  return size.prod() - (size.x() - 2.0 * wall) * (size.y() - 2.0 * wall) * (size.z() - wall);
}

}  // namespace takt::test
