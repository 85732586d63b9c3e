#pragma once
// Builds a closed mesh from lines and rings of vertices that strips of triangles join.
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "config/meshes/generator/solid.h"

namespace takt::meshes {

/// Vertices in the order of a key along a line, to be joined with a neighbouring line.
struct Row {
  std::vector<std::uint32_t> vertex;
  std::vector<double> key;
};

using Ring = std::vector<std::uint32_t>;
Ring reversed(Ring ring);

Vec3 cylindrical(double radius, double angle, double z);

class MeshMaker {
 public:
  explicit MeshMaker(const std::string& name) { solid_.name = name; }

  std::uint32_t vertex(const Vec3& p);
  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) { solid_.triangles.push_back({a, b, c}); }
  /// Fills the strip between two lines with triangles; equal keys are joined. Seen from outside, `right` is to
  /// the right of `left` and keys grow upwards.
  void strip(const Row& left, const Row& right);
  /// Between closed rings of equal size: quads from `lower` to `upper`, seen from outside counter-clockwise.
  /// A solid of revolution is a chain of them: from the axis below outwards, up and inwards to the axis.
  void ring(const Ring& lower, const Ring& upper);
  /// Closes a ring, which runs counter-clockwise seen from outside, around a centre.
  void fan(const Ring& ring, const Vec3& center);
  /// A circle about z, its first vertex at angle 0.
  Ring circle(double radius, int columns, double z);
  /// A hexagon about z, as wide as this across its flats, one of which is at 30 degrees. `columns`: a multiple
  /// of 12.
  Ring hexagon(double across_flats, int columns, double z);
  /// Quads from the ring along z to the height `z`, each at most `edge` high. Returns the last ring.
  Ring wall(Ring ring, double z, double edge);
  Solid take() { return std::move(solid_); }

 private:
  Solid solid_;
};

}  // namespace takt::meshes
