#include "config/meshes/generator/block.h"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace takt::meshes {
namespace {

/// The surface over a common grid in x and y: a top and a bottom height for each corner of each cell, and
/// vertical walls where the top heights of neighbouring cells differ and around the outside.
class BlockMesher {
 public:
  BlockMesher(const Block& block, std::int64_t edge) : block_(block), mesh_(block.name) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const std::int64_t lower = block.outline.lower[axis];
      const std::int64_t upper = block.outline.upper[axis];
      std::vector<std::int64_t> features{lower, upper};
      if (block.bottom_chamfer > 0)
        features.insert(features.end(), {lower + block.bottom_chamfer, upper - block.bottom_chamfer});
      for (const Pocket& pocket : block.pockets)
        features.insert(features.end(),
                        {pocket.opening.lower[axis] - block.rim_chamfer, pocket.opening.lower[axis],
                         pocket.opening.upper[axis], pocket.opening.upper[axis] + block.rim_chamfer});
      lines_[axis] = subdivide(features, edge);
    }
    std::vector<std::int64_t> levels{0, block.bottom_chamfer, block.height};
    for (const Pocket& pocket : block.pockets) {
      levels.push_back(pocket.floor);
      levels.push_back(block.height - block.rim_chamfer);
    }
    levels_ = subdivide(levels, edge);
  }

  LatticeMesh run() {
    for (std::size_t i = 0; i + 1 < lines_[0].size(); ++i)
      for (std::size_t k = 0; k + 1 < lines_[1].size(); ++k) {
        add_cell(i, k, true);
        add_cell(i, k, false);
      }
    add_walls(0);
    add_walls(1);
    return std::move(mesh_);
  }

 private:
  const Pocket* pocket_of_cell(std::size_t i, std::size_t k) const {
    for (const Pocket& pocket : block_.pockets)
      if (lines_[0][i] >= pocket.opening.lower[0] && lines_[0][i + 1] <= pocket.opening.upper[0] &&
          lines_[1][k] >= pocket.opening.lower[1] && lines_[1][k + 1] <= pocket.opening.upper[1])
        return &pocket;
    return nullptr;
  }

  /// Height of the top at (x, y), outside the pockets: the chamfer rises by the distance to the opening.
  std::int64_t rim_height(std::int64_t x, std::int64_t y) const {
    std::int64_t lowest = block_.height;
    for (const Pocket& pocket : block_.pockets) {
      const Rectangle& o = pocket.opening;
      const std::int64_t away = std::max({o.lower[0] - x, x - o.upper[0], o.lower[1] - y, y - o.upper[1]});
      lowest = std::min(lowest, block_.height - std::max<std::int64_t>(0, block_.rim_chamfer - away));
    }
    return lowest;
  }

  std::int64_t bottom_height(std::int64_t x, std::int64_t y) const {
    const Rectangle& o = block_.outline;
    const std::int64_t inside = std::min({x - o.lower[0], o.upper[0] - x, y - o.lower[1], o.upper[1] - y});
    return std::max<std::int64_t>(0, block_.bottom_chamfer - inside);
  }

  /// Corner (gi, gk) of the grid as the cell (i, k) sees it.
  Point top_corner(std::size_t i, std::size_t k, std::size_t gi, std::size_t gk) const {
    const std::int64_t x = lines_[0][gi];
    const std::int64_t y = lines_[1][gk];
    const Pocket* pocket = pocket_of_cell(i, k);
    return {x, y, pocket != nullptr ? pocket->floor : rim_height(x, y)};
  }

  Point bottom_corner(std::size_t gi, std::size_t gk) const {
    return {lines_[0][gi], lines_[1][gk], bottom_height(lines_[0][gi], lines_[1][gk])};
  }

  void add_cell(std::size_t i, std::size_t k, bool top) {
    const auto corner = [&](std::size_t gi, std::size_t gk) {
      return top ? top_corner(i, k, gi, gk) : bottom_corner(gi, gk);
    };
    std::array<Point, 4> c{corner(i, k), corner(i + 1, k), corner(i + 1, k + 1), corner(i, k + 1)};
    // Where two chamfers meet, three corners are level and one is not: the mitre runs through that one.
    const bool other_diagonal = c[0][2] == c[2][2] && c[1][2] != c[3][2];
    if (!top) std::swap(c[1], c[3]);
    if (other_diagonal)
      mesh_.add_quad(c[1], c[2], c[3], c[0]);
    else
      mesh_.add_quad(c[0], c[1], c[2], c[3]);
  }

  /// Walls over the grid lines that run across `axis`; `along` is the axis they run in.
  void add_walls(std::size_t axis) {
    const std::size_t along = 1 - axis;
    for (std::size_t line = 0; line < lines_[axis].size(); ++line)
      for (std::size_t s = 0; s + 1 < lines_[along].size(); ++s) {
        // Heights at both ends of this piece of the line, on its lower and its upper side. Outside the block
        // the "top" is the bottom surface.
        const auto end = [&](bool upper_side, std::size_t g) {
          const std::size_t gi = axis == 0 ? line : g;
          const std::size_t gk = axis == 0 ? g : line;
          if (upper_side ? line + 1 == lines_[axis].size() : line == 0) return bottom_corner(gi, gk);
          const std::size_t cell = upper_side ? line : line - 1;
          return axis == 0 ? top_corner(cell, s, gi, gk) : top_corner(s, cell, gi, gk);
        };
        const Point below = end(false, s);
        const Point above = end(true, s);
        if (below[2] == above[2]) continue;
        // The wall faces the lower of the two sides.
        const bool faces_up = above[2] < below[2];
        add_wall(below, end(false, s + 1), std::min(below[2], above[2]), std::max(below[2], above[2]),
                 (axis == 0) == faces_up);
      }
  }

  /// A wall over the line from p to q, subdivided at the levels between `low` and `high`. Seen from the side
  /// where z up and p to q rightwards appear, the triangles are counter-clockwise if `forward`.
  void add_wall(Point p, Point q, std::int64_t low, std::int64_t high, bool forward) {
    std::vector<std::int64_t> levels{low};
    for (const std::int64_t level : levels_)
      if (level > low && level < high) levels.push_back(level);
    levels.push_back(high);
    if (!forward) std::swap(p, q);
    for (std::size_t n = 1; n < levels.size(); ++n)
      mesh_.add_quad({p[0], p[1], levels[n - 1]}, {q[0], q[1], levels[n - 1]}, {q[0], q[1], levels[n]},
                     {p[0], p[1], levels[n]});
  }

  const Block& block_;
  LatticeMesh mesh_;
  std::array<std::vector<std::int64_t>, 2> lines_;
  std::vector<std::int64_t> levels_;
};

/// The slab under the pockets, with the bottom chamfer.
LatticeMesh make_slab(const Block& block, std::int64_t top) {
  Block slab{"bottom", block.outline, top, {}, 0, block.bottom_chamfer};
  return make_block(slab, std::int64_t{1} << 40);
}

using Outline = std::vector<std::array<std::int64_t, 2>>;

/// Cross-section of a wall from s0 to s1 (the coordinate across it), counter-clockwise with the height to the
/// left of the coordinate's direction; `c0` and `c1` are the chamfers on its sides.
Outline wall_section(std::int64_t s0, std::int64_t s1, std::int64_t low, std::int64_t high, std::int64_t c0,
                     std::int64_t c1) {
  Outline outline{{s0, low}, {s1, low}};
  if (c1 > 0) outline.push_back({s1, high - c1});
  outline.push_back({s1 - c1, high});
  outline.push_back({s0 + c0, high});
  if (c0 > 0) outline.push_back({s0, high - c0});
  return outline;
}

/// (x, z) outlines become (z, x) outlines with the opposite sense, as a prism along y requires.
Outline mirrored(Outline outline) {
  std::reverse(outline.begin(), outline.end());
  for (auto& p : outline) std::swap(p[0], p[1]);
  return outline;
}

}  // namespace

LatticeMesh make_block(const Block& block, std::int64_t edge) {
  return BlockMesher(block, edge).run();
}

std::vector<LatticeMesh> make_convex_pieces(const Block& block) {
  const std::int64_t c = block.rim_chamfer;
  const Rectangle& whole = block.outline;
  const Rectangle& first = block.pockets.front().opening;
  const std::int64_t floor = block.pockets.front().floor;
  std::vector<LatticeMesh> pieces{make_slab(block, floor)};
  pieces.push_back(make_prism("wall_y_minus", 0, whole.lower[0], whole.upper[0],
                              wall_section(whole.lower[1], first.lower[1], floor, block.height, 0, c)));
  pieces.push_back(make_prism("wall_y_plus", 0, whole.lower[0], whole.upper[0],
                              wall_section(first.upper[1], whole.upper[1], floor, block.height, c, 0)));
  std::int64_t x = whole.lower[0];
  for (std::size_t i = 0; i <= block.pockets.size(); ++i) {
    const bool last = i == block.pockets.size();
    const std::int64_t next = last ? whole.upper[0] : block.pockets[i].opening.lower[0];
    pieces.push_back(
        make_prism("wall_x_" + std::to_string(i + 1), 1, first.lower[1], first.upper[1],
                   mirrored(wall_section(x, next, floor, block.height, i == 0 ? 0 : c, last ? 0 : c))));
    if (!last) x = block.pockets[i].opening.upper[0];
  }
  return pieces;
}

}  // namespace takt::meshes
