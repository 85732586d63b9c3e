#pragma once
// Parts that the file places inside each other, deeper than a fit: drawn threads, cables through walls, mistakes.
#include <vector>

#include "server/product/product.h"

namespace takt::product {

/// Two instances that stand inside each other in the finished product.
struct PartOverlap {
  std::size_t first = 0;  ///< index of an instance; less than `second`
  std::size_t second = 0;
  double depth_m = 0.0;
  Vec3 point_W = Vec3::Zero();  ///< where it is deepest
};

/// The pairs that a scenario refuses at its start unless `world.allow_overlap` names them, sorted by first and second. From the
/// meshes that the scenario has.
std::vector<PartOverlap> find_overlaps(const Product& product);

}  // namespace takt::product
