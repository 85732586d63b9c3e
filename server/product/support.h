#pragma once
// What a product stands on: boxes of a Ground.
#include <vector>

#include "server/product/disassembly.h"
#include "server/product/geometry.h"

namespace takt::product {

struct Support {
  std::vector<TriangleMesh> boxes;   ///< a plate, then its posts
  double floor_m = 0.0;              ///< top of the plate
  std::vector<std::size_t> on_pads;  ///< instances that a pad holds
  std::vector<TriangleMesh> pads;    ///< for each of them
};

/// A plate under all, and posts below the base where other parts reach further down or leave downwards. Parts that no chain
/// of contacts joins to the base stand on the plate or on posts, too: of those that touch each other, the ones that leave
/// last. A post is where the part is what a look from below meets first: at its lowest flat face there, else at its lowest
/// point there. A base that is lowest stands on the plate if no post can carry it. What no post reaches, and what is in
/// `Disassembly::on_pads`, is held by a pad: a small box inside it, above its underside.
Support support_of(const Product& product, const std::vector<PlacedInstance>& placed,
                   const Disassembly& plan);

/// Boxes from this height up to where they can carry a part: free below, on its lowest flat face there, else below its lowest
/// free point. None: there is no such place.
std::vector<TriangleMesh> posts_under(const std::vector<PlacedInstance>& placed, std::size_t part,
                                      double floor_m);

/// It is lowest, or a post can carry it.
bool can_stand(const std::vector<PlacedInstance>& placed, std::size_t part);

}  // namespace takt::product
