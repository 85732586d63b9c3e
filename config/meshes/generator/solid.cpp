#include "config/meshes/generator/solid.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <numeric>
#include <ostream>

namespace takt::meshes {
namespace {

/// Metres in whole nanometres, as the shortest decimal of their single precision: programs that keep coordinates in
/// single or double precision read the same shape.
std::string coordinate_text(double length_m) {
  const double rounded = static_cast<double>(std::llround(length_m * 1e9)) / 1e9;
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), static_cast<float>(rounded),
                                 std::chars_format::fixed);
  return {text.data(), end.ptr};
}

}  // namespace

Solid make_tube(const std::string& name, const TubeGrid& grid, const GridPoint& point) {
  Solid solid{name, {}, {}};
  for (int row = 0; row < grid.rows; ++row)
    for (int column = 0; column < grid.columns; ++column) solid.vertices.push_back(point(row, column));
  const auto at = [&](int row, int column) {
    return static_cast<std::uint32_t>((row % grid.rows) * grid.columns + column % grid.columns);
  };
  const int strips = grid.closed ? grid.rows : grid.rows - 1;
  for (int row = 0; row < strips; ++row)
    for (int column = 0; column < grid.columns; ++column) {
      const std::uint32_t a = at(row, column), b = at(row, column + 1), c = at(row + 1, column + 1),
                          d = at(row + 1, column);
      solid.triangles.push_back({a, b, c});
      solid.triangles.push_back({a, c, d});
    }
  if (grid.closed) return collapsed(std::move(solid));
  const auto first = static_cast<std::uint32_t>(solid.vertices.size());
  solid.vertices.push_back(grid.first_pole);
  solid.vertices.push_back(grid.last_pole);
  for (int column = 0; column < grid.columns; ++column) {
    solid.triangles.push_back({first, at(0, column + 1), at(0, column)});
    solid.triangles.push_back({first + 1, at(grid.rows - 1, column), at(grid.rows - 1, column + 1)});
  }
  return collapsed(std::move(solid));
}

Solid collapsed(Solid solid) {
  const auto nm = [&](std::uint32_t i) {
    const Vec3& v = solid.vertices[i];
    return std::array<std::int64_t, 3>{std::llround(v.x() * 1e9), std::llround(v.y() * 1e9),
                                       std::llround(v.z() * 1e9)};
  };
  std::vector<std::uint32_t> same(solid.vertices.size());
  std::iota(same.begin(), same.end(), 0U);
  const auto first = [&](std::uint32_t i) {
    while (same[i] != i) i = same[i];
    return i;
  };
  bool any = false;
  for (const auto& t : solid.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = first(t[k]), b = first(t[(k + 1) % 3]);
      if (a == b || nm(a) != nm(b)) continue;
      same[std::max(a, b)] = std::min(a, b);
      any = true;
    }
  }
  if (!any) return solid;
  Solid result{solid.name, {}, {}};
  std::vector<std::uint32_t> place(solid.vertices.size(), std::numeric_limits<std::uint32_t>::max());
  for (const auto& t : solid.triangles) {
    std::array<std::uint32_t, 3> c{first(t[0]), first(t[1]), first(t[2])};
    if (c[0] == c[1] || c[1] == c[2] || c[2] == c[0]) continue;
    for (std::uint32_t& corner : c) {
      if (place[corner] == std::numeric_limits<std::uint32_t>::max()) {
        place[corner] = static_cast<std::uint32_t>(result.vertices.size());
        result.vertices.push_back(solid.vertices[corner]);
      }
      corner = place[corner];
    }
    result.triangles.push_back(c);
  }
  return result;
}

Profile subdivided(const Profile& profile, double edge, bool closed) {
  Profile result{profile.front()};
  const std::size_t lines = closed ? profile.size() : profile.size() - 1;
  for (std::size_t i = 0; i < lines; ++i) {
    const ProfilePoint &a = profile[i], &b = profile[(i + 1) % profile.size()];
    const double length = std::hypot(b[0] - a[0], b[1] - a[1]);
    const auto pieces = std::max(1L, std::lround(length / edge));
    for (long k = 1; k <= pieces; ++k) {
      const double u = static_cast<double>(k) / static_cast<double>(pieces);
      result.push_back(k == pieces ? b : ProfilePoint{a[0] + u * (b[0] - a[0]), a[1] + u * (b[1] - a[1])});
    }
  }
  if (closed) result.pop_back();
  return result;
}

Solid make_revolved(const std::string& name, const Profile& profile, bool closed, int facets) {
  // The poles of an open profile are no rows.
  const std::size_t skip = closed ? 0 : 1;
  TubeGrid grid;
  grid.rows = static_cast<int>(profile.size() - 2 * skip);
  grid.columns = facets;
  grid.closed = closed;
  grid.first_pole = {0.0, 0.0, profile.front()[1]};
  grid.last_pole = {0.0, 0.0, profile.back()[1]};
  const double to_corner = 1.0 / std::cos(std::numbers::pi / facets);
  return make_tube(name, grid, [&](int row, int column) {
    const ProfilePoint& p = profile[static_cast<std::size_t>(row) + skip];
    const double angle = 2.0 * std::numbers::pi * (column + 0.5) / facets;
    return Vec3(p[0] * to_corner * std::cos(angle), p[0] * to_corner * std::sin(angle), p[1]);
  });
}

void write_obj(std::ostream& out, const std::vector<std::string>& header, const std::vector<Solid>& solids) {
  for (const std::string& line : header) out << "# " << line << '\n';
  std::size_t first = 1;
  for (const Solid& solid : solids) {
    out << "o " << solid.name << '\n';
    for (const Vec3& v : solid.vertices)
      out << "v " << coordinate_text(v.x()) << ' ' << coordinate_text(v.y()) << ' ' << coordinate_text(v.z())
          << '\n';
    for (const auto& t : solid.triangles)
      out << "f " << t[0] + first << ' ' << t[1] + first << ' ' << t[2] + first << '\n';
    first += solid.vertices.size();
  }
}

void write_obj(std::ostream& out, const std::vector<std::string>& header, const Solid& solid) {
  write_obj(out, header, std::vector<Solid>{solid});
}

}  // namespace takt::meshes
