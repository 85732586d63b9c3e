#pragma once
// Meshes whose coordinates are whole micrometres: vertices are shared exactly and written exactly.
#include <array>
#include <cstdint>
#include <iosfwd>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace takt::meshes {

/// x, y, z in micrometres.
using Point = std::array<std::int64_t, 3>;

/// Micrometres from millimetres.
constexpr std::int64_t mm(double length) {
  return static_cast<std::int64_t>(length * 1000.0 + (length < 0.0 ? -0.5 : 0.5));
}

/// One object of an OBJ file: a triangle mesh, faces counter-clockwise as seen from outside.
class LatticeMesh {
 public:
  explicit LatticeMesh(std::string name) : name_(std::move(name)) {}

  void add_triangle(const Point& a, const Point& b, const Point& c);
  /// The quadrilateral a b c d, cut along a-c. Corners must be in order around it.
  void add_quad(const Point& a, const Point& b, const Point& c, const Point& d);
  /// A flat convex polygon, cut into a fan around its first corner.
  void add_polygon(const std::vector<Point>& corners);

  /// Enclosed volume in m^3.
  double volume() const;

  const std::string& name() const { return name_; }
  const std::vector<Point>& vertices() const { return vertices_; }
  const std::vector<std::array<std::uint32_t, 3>>& triangles() const { return triangles_; }

 private:
  std::uint32_t number_of(const Point& p);

  std::string name_;
  std::vector<Point> vertices_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  std::map<Point, std::uint32_t> numbers_;
};

/// From `a` to `b` through all of `features` in between, in steps of about `edge`; all in micrometres.
std::vector<std::int64_t> subdivide(std::vector<std::int64_t> features, std::int64_t edge);

/// An axis-parallel box. Its faces are meshed with edges of about `edge` (micrometres).
LatticeMesh make_box(const std::string& name, const Point& lower, const Point& upper, std::int64_t edge);

/// A prism: the convex outline, counter-clockwise seen from the end of the axis `along` (0 x, 1 y), between
/// two coordinates on that axis. The outline's points are (y, z) for x, (z, x) for y.
LatticeMesh make_prism(const std::string& name, int along, std::int64_t from, std::int64_t to,
                       const std::vector<std::array<std::int64_t, 2>>& outline);

/// Writes the objects as OBJ in metres, six decimals, each line of `header` as a comment first.
void write_obj(std::ostream& out, const std::vector<std::string>& header,
               const std::vector<LatticeMesh>& objects);

}  // namespace takt::meshes
