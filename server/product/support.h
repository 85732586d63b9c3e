#pragma once
// What the base of a product stands on: boxes of a Ground.
#include <vector>

#include "server/product/disassembly.h"
#include "server/product/geometry.h"

namespace takt::product {

struct Support {
  std::vector<TriangleMesh> boxes;  ///< a plate, then its posts
  double floor_m = 0.0;             ///< top of the plate
};

/// A plate under all, and posts below the base where other parts reach further down or leave downwards: where the base is
/// what a look from below meets first. Without such a place the plate is alone.
Support support_of(const std::vector<PlacedInstance>& placed, const Disassembly& plan);

}  // namespace takt::product
