#pragma once
// A mesh in the precision in which it is shown.
#include <cstdint>
#include <vector>

namespace takt {

struct DescribedMesh {
  std::vector<float> vertices;           ///< x, y, z of each, in B (m)
  std::vector<std::uint32_t> triangles;  ///< three vertex indices each, outward by the right-hand rule
};

}  // namespace takt
