#pragma once
// Bodies with faces, made in code: boxes, and bodies of revolution or with a round hole, for tests of products.
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "server/product/product.h"

namespace takt::test {

inline constexpr std::uint32_t kRoundSides = 64;

inline product::Face plane_face(const Vec3& point, const Vec3& normal) {
  product::Face face;
  face.kind = product::SurfaceKind::plane;
  face.point_B = point, face.axis_B = normal;
  return face;
}

inline void complete(product::Body& body) {
  body.exact = volume_properties(body.mesh);
  body.material = {"steel", 7850.0, true};
  for (std::size_t i = 0; i < body.mesh.triangles.size(); ++i) {
    const auto& t = body.mesh.triangles[i];
    body.faces[static_cast<std::size_t>(body.triangle_faces[i])].area_m2 +=
        0.5 * (body.mesh.vertices[t[1]] - body.mesh.vertices[t[0]])
                  .cross(body.mesh.vertices[t[2]] - body.mesh.vertices[t[0]])
                  .norm();
  }
}

/// A box around the origin.
inline product::Body box_body(const std::string& name, const Vec3& size) {
  product::Body body;
  body.name = name;
  body.mesh = takt::box_mesh(-0.5 * size, 0.5 * size);
  body.triangle_faces = {0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5};
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {-1.0, 1.0})
      body.faces.push_back(plane_face(sign * 0.5 * size[axis] * Vec3::Unit(axis), sign * Vec3::Unit(axis)));
  complete(body);
  return body;
}

/// A solid of revolution about z: cylinders of these radii between these heights, from the lowest on. Its axis has
/// `kRoundSides` vertices around, which lie on the cylinders.
inline product::Body turned_body(const std::string& name, const std::vector<double>& heights,
                                 const std::vector<double>& radii) {
  product::Body body;
  body.name = name;
  auto& mesh = body.mesh;
  const auto ring = [&](double r, double z) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (std::uint32_t i = 0; i < kRoundSides; ++i) {
      const double angle = 2.0 * M_PI * i / kRoundSides;
      mesh.vertices.emplace_back(r * std::cos(angle), r * std::sin(angle), z);
    }
    return first;
  };
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, int face) {
    mesh.triangles.push_back({a, b, c});
    body.triangle_faces.push_back(face);
  };
  const auto band = [&](std::uint32_t low, std::uint32_t high,
                        int face) {  // outwards from the axis, or up for a wider `low`
    for (std::uint32_t i = 0; i < kRoundSides; ++i) {
      const std::uint32_t next = (i + 1) % kRoundSides;
      add(low + i, low + next, high + next, face);
      add(low + i, high + next, high + i, face);
    }
  };
  mesh.vertices.emplace_back(0.0, 0.0, heights.front());
  body.faces.push_back(plane_face(mesh.vertices.back(), -Vec3::UnitZ()));
  std::uint32_t below = 0;
  for (std::size_t k = 0; k < radii.size(); ++k) {
    const std::uint32_t low = ring(radii[k], heights[k]);
    if (k == 0) {
      for (std::uint32_t i = 0; i < kRoundSides; ++i) add(0, low + (i + 1) % kRoundSides, low + i, 0);
    } else {
      body.faces.push_back(plane_face(Vec3(0, 0, heights[k]), Vec3(0, 0, radii[k] < radii[k - 1] ? 1 : -1)));
      band(below, low, static_cast<int>(body.faces.size()) - 1);
    }
    const std::uint32_t high = ring(radii[k], heights[k + 1]);
    product::Face side;
    side.kind = product::SurfaceKind::cylinder;
    side.radius_m = radii[k];
    body.faces.push_back(side);
    band(low, high, static_cast<int>(body.faces.size()) - 1);
    below = high;
  }
  mesh.vertices.emplace_back(0.0, 0.0, heights.back());
  const auto top = static_cast<std::uint32_t>(mesh.vertices.size() - 1);
  body.faces.push_back(plane_face(mesh.vertices.back(), Vec3::UnitZ()));
  for (std::uint32_t i = 0; i < kRoundSides; ++i)
    add(top, below + i, below + (i + 1) % kRoundSides, static_cast<int>(body.faces.size()) - 1);
  complete(body);
  return body;
}

/// A square plate of this side and thickness around the origin, with a round hole along z.
inline product::Body plate_with_hole(const std::string& name, double side, double thickness, double radius) {
  product::Body body;
  body.name = name;
  auto& mesh = body.mesh;
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, int face) {
    mesh.triangles.push_back({a, b, c});
    body.triangle_faces.push_back(face);
  };
  for (const double z : {-0.5 * thickness, 0.5 * thickness}) {
    for (int q = 0; q < 4; ++q) {
      const double angle = M_PI / 4 + q * M_PI / 2;
      mesh.vertices.emplace_back(side / std::sqrt(2.0) * std::cos(angle),
                                 side / std::sqrt(2.0) * std::sin(angle), z);
    }
    for (std::uint32_t i = 0; i < kRoundSides; ++i) {
      const double angle = 2.0 * M_PI * i / kRoundSides;
      mesh.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
    }
  }
  constexpr std::uint32_t kLayer = 4 + kRoundSides, kQuarter = kRoundSides / 4;
  body.faces = {plane_face(Vec3(0, 0, -0.5 * thickness), -Vec3::UnitZ()),
                plane_face(Vec3(0, 0, 0.5 * thickness), Vec3::UnitZ())};
  for (std::uint32_t layer = 0; layer < 2; ++layer) {
    const std::uint32_t base = layer * kLayer;
    const auto cap = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
      layer == 1 ? add(base + a, base + b, base + c, 1) : add(base + a, base + c, base + b, 0);
    };
    for (std::uint32_t q = 0; q < 4; ++q) {
      // Corner q lies at 45 degrees + q * 90; the circle's points of its quarter begin at q * 90.
      for (std::uint32_t k = 0; k < kQuarter; ++k)
        cap(q, 4 + (q * kQuarter + k + 1) % kRoundSides, 4 + q * kQuarter + k);
      cap(q, (q + 1) % 4, 4 + ((q + 1) * kQuarter) % kRoundSides);
    }
  }
  product::Face hole;
  hole.kind = product::SurfaceKind::cylinder;
  hole.radius_m = radius, hole.concave = true;
  body.faces.push_back(hole);
  for (std::uint32_t i = 0; i < kRoundSides; ++i) {
    const std::uint32_t a = 4 + i, b = 4 + (i + 1) % kRoundSides;
    add(a, kLayer + b, b, 2);
    add(a, kLayer + a, kLayer + b, 2);
  }
  for (std::uint32_t q = 0; q < 4; ++q) {
    const std::uint32_t a = q, b = (q + 1) % 4;
    const double angle = M_PI / 2 + q * M_PI / 2;
    const Vec3 n(std::cos(angle), std::sin(angle), 0.0);
    body.faces.push_back(plane_face(0.5 * side * n, n));
    const int face = static_cast<int>(body.faces.size()) - 1;
    add(a, b, kLayer + b, face);
    add(a, kLayer + b, kLayer + a, face);
  }
  complete(body);
  return body;
}

/// A product of one instance of each body, at these places.
inline product::Product product_of(std::vector<std::pair<product::Body, Vec3>> bodies) {
  product::Product product;
  product.name = "product";
  product.source = "made in code";
  for (auto& [body, place] : bodies) {
    product::Instance instance;
    instance.name = instance.path = body.name;
    instance.body = product.bodies.size();
    instance.X_WB.p = place;
    product.instances.push_back(instance);
    product.bodies.push_back(std::move(body));
  }
  return product;
}

}  // namespace takt::test
