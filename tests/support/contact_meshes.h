#pragma once
// Closed meshes for surface contact: boxes with a lattice on every side, balls, tori, a hollow block.
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <utility>

#include "server/geometry/mesh/triangle_mesh.h"

namespace takt::test {

/// A box around the origin whose sides are cut into `cells` squares along each axis, two triangles each.
inline TriangleMesh lattice_box(const Vec3& size, const std::array<int, 3>& cells) {
  TriangleMesh mesh;
  std::map<std::array<int, 3>, std::uint32_t> known;
  const auto vertex = [&](const std::array<int, 3>& at) {
    const auto [it, fresh] = known.emplace(at, static_cast<std::uint32_t>(mesh.vertices.size()));
    if (fresh) {
      Vec3 p;
      for (std::size_t k = 0; k < 3; ++k)
        p[static_cast<Eigen::Index>(k)] =
            size[static_cast<Eigen::Index>(k)] * (static_cast<double>(at[k]) / cells[k] - 0.5);
      mesh.vertices.push_back(p);
    }
    return it->second;
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (const bool upper : {false, true})
      for (int i = 0; i < cells[u]; ++i)
        for (int j = 0; j < cells[v]; ++j) {
          std::array<std::uint32_t, 4> corner{};
          for (int c = 0; c < 4; ++c) {
            std::array<int, 3> at{};
            at[axis] = upper ? cells[axis] : 0;
            at[u] = i + (c == 1 || c == 2 ? 1 : 0);
            at[v] = j + (c >= 2 ? 1 : 0);
            corner[static_cast<std::size_t>(c)] = vertex(at);
          }
          if (!upper) std::swap(corner[1], corner[3]);
          mesh.triangles.push_back({corner[0], corner[1], corner[2]});
          mesh.triangles.push_back({corner[0], corner[2], corner[3]});
        }
  }
  return mesh;
}

inline TriangleMesh lattice_box(const Vec3& size, double edge) {
  std::array<int, 3> cells{};
  for (std::size_t k = 0; k < 3; ++k)
    cells[k] = std::max(1, static_cast<int>(std::lround(size[static_cast<Eigen::Index>(k)] / edge)));
  return lattice_box(size, cells);
}

/// An octahedron's faces halved `levels` times, moved onto the sphere: 8 * 4^levels triangles.
inline TriangleMesh ball(double radius, int levels) {
  TriangleMesh mesh;
  for (const double s : {1.0, -1.0})
    for (int k = 0; k < 3; ++k) mesh.vertices.push_back(s * Vec3::Unit(k));
  mesh.triangles = {{0, 1, 2}, {1, 3, 2}, {3, 4, 2}, {4, 0, 2}, {1, 0, 5}, {3, 1, 5}, {4, 3, 5}, {0, 4, 5}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [it, fresh] =
          middles.emplace(std::minmax(a, b), static_cast<std::uint32_t>(mesh.vertices.size()));
      if (fresh) mesh.vertices.push_back(Vec3(mesh.vertices[a] + mesh.vertices[b]).normalized());
      return it->second;
    };
    std::vector<std::array<std::uint32_t, 3>> finer;
    for (const auto& t : mesh.triangles) {
      const std::uint32_t ab = middle(t[0], t[1]), bc = middle(t[1], t[2]), ca = middle(t[2], t[0]);
      finer.insert(finer.end(), {{t[0], ab, ca}, {ab, t[1], bc}, {ca, bc, t[2]}, {ab, bc, ca}});
    }
    mesh.triangles = finer;
  }
  for (Vec3& v : mesh.vertices) v *= radius;
  return mesh;
}

/// A prism of n sides: its end faces are fans around their middles, or strips of needles from side to side.
inline TriangleMesh prism(double radius, double height, std::uint32_t n, bool of_needles) {
  TriangleMesh mesh;
  for (const double z : {-0.5 * height, 0.5 * height})
    for (std::uint32_t i = 0; i < n; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / n;
      mesh.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
    }
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t next = (i + 1) % n;
    mesh.triangles.push_back({i, next, n + next});
    mesh.triangles.push_back({i, n + next, n + i});
  }
  for (const std::uint32_t base : {0U, n}) {
    const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
      if (base == 0) std::swap(b, c);
      mesh.triangles.push_back({a, b, c});
    };
    if (of_needles) {
      for (std::uint32_t low = 0, high = n - 1; low + 1 < high;) {
        add(base + low, base + low + 1, base + high);
        if (++low + 1 >= high) break;
        add(base + low, base + high - 1, base + high);
        --high;
      }
    } else {
      const auto middle = static_cast<std::uint32_t>(mesh.vertices.size());
      mesh.vertices.emplace_back(0.0, 0.0, base == 0 ? -0.5 * height : 0.5 * height);
      for (std::uint32_t i = 0; i < n; ++i) add(base + i, base + (i + 1) % n, middle);
    }
  }
  return mesh;
}

/// Around the z axis.
inline TriangleMesh torus(double ring_radius, double tube_radius, std::uint32_t around,
                          std::uint32_t across) {
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < around; ++i)
    for (std::uint32_t j = 0; j < across; ++j) {
      const double a = 2.0 * std::numbers::pi * i / around, b = 2.0 * std::numbers::pi * j / across;
      const double r = ring_radius + tube_radius * std::cos(b);
      mesh.vertices.emplace_back(r * std::cos(a), r * std::sin(a), tube_radius * std::sin(b));
    }
  for (std::uint32_t i = 0; i < around; ++i)
    for (std::uint32_t j = 0; j < across; ++j) {
      const std::uint32_t i2 = (i + 1) % around, j2 = (j + 1) % across;
      mesh.triangles.push_back({i * across + j, i2 * across + j, i2 * across + j2});
      mesh.triangles.push_back({i * across + j, i2 * across + j2, i * across + j2});
    }
  return mesh;
}

/// `outer` with a hollow inside, the surface of `inner`, which must lie within it.
inline TriangleMesh hollow(const TriangleMesh& outer, const TriangleMesh& inner) {
  TriangleMesh mesh = outer;
  const auto shift = static_cast<std::uint32_t>(outer.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), inner.vertices.begin(), inner.vertices.end());
  for (const auto& t : inner.triangles) mesh.triangles.push_back({t[0] + shift, t[2] + shift, t[1] + shift});
  return mesh;
}

inline TriangleMesh moved(TriangleMesh mesh, const Pose& X) {
  for (Vec3& v : mesh.vertices) v = X * v;
  return mesh;
}

}  // namespace takt::test
