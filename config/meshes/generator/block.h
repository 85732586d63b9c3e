#pragma once
// The blocks of the assembly scenario: boxes with rectangular pockets from the top and chamfers where parts
// slide in.
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "config/meshes/generator/lattice_mesh.h"

namespace takt::meshes {

/// A rectangle in x and y, micrometres.
struct Rectangle {
  std::array<std::int64_t, 2> lower{};
  std::array<std::int64_t, 2> upper{};

  static Rectangle around(std::int64_t x, std::int64_t y, std::int64_t size_x, std::int64_t size_y) {
    return {{x - size_x / 2, y - size_y / 2}, {x + size_x / 2, y + size_y / 2}};
  }
};

struct Pocket {
  Rectangle opening;
  std::int64_t floor = 0;  ///< height above the bottom of the block
};

/// Origin at the centre of the bottom face, z up; micrometres.
struct Block {
  std::string name;
  Rectangle outline;
  std::int64_t height = 0;
  std::vector<Pocket> pockets;
  std::int64_t rim_chamfer = 0;     ///< at 45 degrees, outwards from the openings of the pockets
  std::int64_t bottom_chamfer = 0;  ///< at 45 degrees, around the bottom face
};

/// The block's surface, closed, with edges of about `edge` (micrometres).
LatticeMesh make_block(const Block& block, std::int64_t edge);

/// Convex pieces that together fill the block: the slab under the pockets, then the walls between them. The
/// pockets must lie in a row along x with equal extents in y. Chamfers of the long walls run from end to end,
/// which removes a little more material than the block itself has lost.
std::vector<LatticeMesh> make_convex_pieces(const Block& block);

}  // namespace takt::meshes
