#include "config/meshes/generator/lattice_mesh.h"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <ostream>
#include <utility>

namespace takt::meshes {
namespace {

/// Micrometres as metres with as many decimals as needed.
std::string metres(std::int64_t micrometres) {
  const std::int64_t size = std::abs(micrometres);
  std::string decimals = std::to_string(size % 1000000);
  decimals.insert(0, 6 - decimals.size(), '0');
  decimals.erase(decimals.find_last_not_of('0') + 1);
  std::string text = micrometres < 0 ? "-" : "";
  text += std::to_string(size / 1000000);
  if (!decimals.empty()) text += "." + decimals;
  return text;
}

}  // namespace

std::uint32_t LatticeMesh::number_of(const Point& p) {
  const auto [entry, is_new] = numbers_.try_emplace(p, static_cast<std::uint32_t>(vertices_.size()));
  if (is_new) vertices_.push_back(p);
  return entry->second;
}

void LatticeMesh::add_triangle(const Point& a, const Point& b, const Point& c) {
  const std::uint32_t ia = number_of(a);
  const std::uint32_t ib = number_of(b);
  triangles_.push_back({ia, ib, number_of(c)});
}

void LatticeMesh::add_quad(const Point& a, const Point& b, const Point& c, const Point& d) {
  add_triangle(a, b, c);
  add_triangle(a, c, d);
}

void LatticeMesh::add_polygon(const std::vector<Point>& corners) {
  for (std::size_t i = 2; i < corners.size(); ++i) add_triangle(corners[0], corners[i - 1], corners[i]);
}

double LatticeMesh::volume() const {
  double six_volumes = 0.0;
  for (const auto& t : triangles_) {
    const Point& a = vertices_[t[0]];
    const Point& b = vertices_[t[1]];
    const Point& c = vertices_[t[2]];
    six_volumes +=
        static_cast<double>(a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                            a[2] * (b[0] * c[1] - b[1] * c[0]));
  }
  return six_volumes / 6.0 * 1e-18;
}

std::vector<std::int64_t> subdivide(std::vector<std::int64_t> features, std::int64_t edge) {
  std::sort(features.begin(), features.end());
  features.erase(std::unique(features.begin(), features.end()), features.end());
  std::vector<std::int64_t> lines{features.front()};
  for (std::size_t i = 1; i < features.size(); ++i) {
    const std::int64_t start = features[i - 1];
    const std::int64_t length = features[i] - start;
    const std::int64_t steps = std::max<std::int64_t>(1, (length + edge / 2) / edge);
    for (std::int64_t k = 1; k <= steps; ++k) lines.push_back(start + length * k / steps);
  }
  return lines;
}

LatticeMesh make_box(const std::string& name, const Point& lower, const Point& upper, std::int64_t edge) {
  LatticeMesh mesh(name);
  std::array<std::vector<std::int64_t>, 3> lines;
  for (std::size_t i = 0; i < 3; ++i) lines[i] = subdivide({lower[i], upper[i]}, edge);
  for (std::size_t normal = 0; normal < 3; ++normal) {
    const std::size_t u = (normal + 1) % 3;  // u, v, normal are right-handed
    const std::size_t v = (normal + 2) % 3;
    for (const bool outer : {false, true})
      for (std::size_t i = 1; i < lines[u].size(); ++i)
        for (std::size_t k = 1; k < lines[v].size(); ++k) {
          const auto corner = [&](std::size_t iu, std::size_t iv) {
            Point p;
            p[normal] = outer ? upper[normal] : lower[normal];
            p[u] = lines[u][iu];
            p[v] = lines[v][iv];
            return p;
          };
          if (outer)
            mesh.add_quad(corner(i - 1, k - 1), corner(i, k - 1), corner(i, k), corner(i - 1, k));
          else
            mesh.add_quad(corner(i - 1, k - 1), corner(i - 1, k), corner(i, k), corner(i, k - 1));
        }
  }
  return mesh;
}

LatticeMesh make_prism(const std::string& name, int along, std::int64_t from, std::int64_t to,
                       const std::vector<std::array<std::int64_t, 2>>& outline) {
  LatticeMesh mesh(name);
  const auto corner = [&](const std::array<std::int64_t, 2>& p, std::int64_t at) {
    return along == 0 ? Point{at, p[0], p[1]} : Point{p[1], at, p[0]};
  };
  std::vector<Point> near_end;
  std::vector<Point> far_end;
  for (const auto& p : outline) {
    near_end.insert(near_end.begin(), corner(p, from));
    far_end.push_back(corner(p, to));
  }
  mesh.add_polygon(near_end);
  mesh.add_polygon(far_end);
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const auto& p = outline[i];
    const auto& q = outline[(i + 1) % outline.size()];
    mesh.add_quad(corner(p, from), corner(q, from), corner(q, to), corner(p, to));
  }
  return mesh;
}

void write_obj(std::ostream& out, const std::vector<std::string>& header,
               const std::vector<LatticeMesh>& objects) {
  for (const std::string& line : header) out << "# " << line << '\n';
  std::size_t first = 1;  // OBJ counts vertices from 1 through the whole file
  for (const LatticeMesh& object : objects) {
    out << "o " << object.name() << '\n';
    for (const Point& p : object.vertices())
      out << "v " << metres(p[0]) << ' ' << metres(p[1]) << ' ' << metres(p[2]) << '\n';
    for (const auto& t : object.triangles())
      out << "f " << t[0] + first << ' ' << t[1] + first << ' ' << t[2] + first << '\n';
    first += object.vertices().size();
  }
}

}  // namespace takt::meshes
