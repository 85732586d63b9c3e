#include "config/meshes/generator/cell_solid.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <stdexcept>

namespace takt::meshes {

namespace {

/// A corner of the grid, with its neighbours in the order that makes a face.
using Corner = std::array<int, 3>;

class Builder {
 public:
  Builder(const std::string& name, const CellGrid& grid, const CellPoint& point)
      : grid_(grid), point_(point), solid_{name, {}, {}} {}

  void add_face(const Corner& a, const Corner& b, const Corner& c, const Corner& d) {
    const std::array<std::uint32_t, 4> v{number(a), number(b), number(c), number(d)};
    add_triangle(v[0], v[1], v[2]);
    add_triangle(v[0], v[2], v[3]);
  }
  Solid take() { return std::move(solid_); }

 private:
  void add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    if (a != b && b != c && c != a) solid_.triangles.push_back({a, b, c});
  }
  std::uint32_t number(Corner corner) {
    if (grid_.closed_j) corner[1] %= grid_.nj;
    if (grid_.axis_i && corner[0] == 0) corner[1] = 0;
    const auto [entry, is_new] =
        numbers_.try_emplace(corner, static_cast<std::uint32_t>(solid_.vertices.size()));
    if (is_new) solid_.vertices.push_back(point_(corner[0], corner[1], corner[2]));
    return entry->second;
  }

  const CellGrid& grid_;
  const CellPoint& point_;
  Solid solid_;
  std::map<Corner, std::uint32_t> numbers_;
};

}  // namespace

Solid make_cell_solid(const std::string& name, const CellGrid& grid, const FilledCell& filled,
                      const CellPoint& point) {
  const auto full = [&](int i, int j, int k) {
    if (grid.closed_j) j = (j + grid.nj) % grid.nj;
    if (i < 0 || j < 0 || k < 0 || i >= grid.ni || j >= grid.nj || k >= grid.nk) return false;
    return filled(i, j, k);
  };
  Builder builder(name, grid, point);
  for (int i = 0; i < grid.ni; ++i)
    for (int j = 0; j < grid.nj; ++j)
      for (int k = 0; k < grid.nk; ++k) {
        if (!full(i, j, k)) continue;
        const int a = i + 1, b = j + 1, c = k + 1;
        if (!full(i - 1, j, k) && !(grid.axis_i && i == 0))
          builder.add_face({i, j, k}, {i, j, c}, {i, b, c}, {i, b, k});
        if (!full(i + 1, j, k)) builder.add_face({a, j, k}, {a, b, k}, {a, b, c}, {a, j, c});
        if (!full(i, j - 1, k)) builder.add_face({i, j, k}, {a, j, k}, {a, j, c}, {i, j, c});
        if (!full(i, j + 1, k)) builder.add_face({i, b, k}, {i, b, c}, {a, b, c}, {a, b, k});
        if (!full(i, j, k - 1)) builder.add_face({i, j, k}, {i, b, k}, {a, b, k}, {a, j, k});
        if (!full(i, j, k + 1)) builder.add_face({i, j, c}, {a, j, c}, {a, b, c}, {i, b, c});
      }
  return collapsed(builder.take());
}

std::vector<double> grid_lines(double from, const std::vector<LineSteps>& steps) {
  std::vector<double> lines{from};
  for (const LineSteps& step : steps) {
    const double begin = lines.back();
    for (int s = 1; s <= step.steps; ++s)
      lines.push_back(s == step.steps ? step.to : begin + (step.to - begin) * s / step.steps);
  }
  return lines;
}

int line_at(const std::vector<double>& lines, double value) {
  for (std::size_t i = 0; i < lines.size(); ++i)
    if (std::abs(lines[i] - value) < 1e-9) return static_cast<int>(i);
  throw std::logic_error("no grid line at " + std::to_string(value));
}

}  // namespace takt::meshes
