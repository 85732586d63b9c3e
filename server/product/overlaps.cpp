#include "server/product/overlaps.h"

#include <algorithm>
#include <memory>

#include "server/geometry/mesh/solid_overlap.h"
#include "server/product/geometry.h"
#include "server/scenario/cell_builders.h"

namespace takt::product {

std::vector<PartOverlap> find_overlaps(const Product& product) {
  const double margin_m = Scenario().contact_margin_m;
  std::vector<std::unique_ptr<SolidProbe>> probes(product.bodies.size());
  const auto probe = [&](std::size_t instance) -> const SolidProbe& {
    const std::size_t b = product.instances[instance].body;
    const Body& body = product.bodies[b];
    if (!probes[b])
      probes[b] =
          std::make_unique<SolidProbe>(body.contact_mesh.triangles.empty() ? body.mesh : body.contact_mesh);
    return *probes[b];
  };
  const auto placed = place(product);
  std::vector<PartOverlap> overlaps;
  for (std::size_t i = 0; i < placed.size(); ++i)
    for (std::size_t j = i + 1; j < placed.size(); ++j) {
      if (!near(placed[i].box, placed[j].box, 0.0)) continue;
      const SolidProbe &a = probe(i), &b = probe(j);
      const double thickness_m = 2.0 * std::min(a.box().half_B.minCoeff(), b.box().half_B.minCoeff());
      const double fit_m = margin_m + kLargestFit * thickness_m;
      const SolidOverlap found =
          solid_overlap(a, product.instances[i].X_WB, b, product.instances[j].X_WB, fit_m);
      if (found.depth_m > 0.0) overlaps.push_back({i, j, found.depth_m, found.p_W});
    }
  return overlaps;
}

}  // namespace takt::product
