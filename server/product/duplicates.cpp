#include "server/product/duplicates.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace takt::product {

namespace {

constexpr double kEqual = 1e-6;  ///< relative difference of what is equal but for rounding

/// What an instance fills, in W.
struct Filled {
  std::size_t instance = 0;
  double volume = 0.0;
  Vec3 centre = Vec3::Zero();
  Mat3 inertia = Mat3::Zero();  ///< for unit mass, about the centre
  Eigen::AlignedBox3d box;

  double size() const { return std::sqrt(inertia.trace()); }
};

Filled filled(const Product& product, std::size_t i) {
  const Instance& instance = product.instances[i];
  const Body& body = product.bodies[instance.body];
  Filled result;
  result.instance = i;
  result.volume = body.exact.volume;
  result.centre = instance.X_WB * body.exact.p_BBcm;
  result.inertia = instance.X_WB.R * body.exact.G_BBcm_B * instance.X_WB.R.transpose();
  for (const Vec3& v : body.mesh.vertices) result.box.extend(instance.X_WB * v);
  return result;
}

bool equal(const Filled& a, const Filled& b) {
  const double near = kEqual * a.size();
  return std::abs(a.volume - b.volume) <= kEqual * std::abs(a.volume) &&
         (a.centre - b.centre).norm() <= near && (a.inertia - b.inertia).norm() <= near * a.size() &&
         (a.box.min() - b.box.min()).norm() <= near && (a.box.max() - b.box.max()).norm() <= near;
}

}  // namespace

void leave_out_duplicates(Product& product) {
  std::vector<Filled> all;
  for (std::size_t i = 0; i < product.instances.size(); ++i) all.push_back(filled(product, i));
  std::sort(all.begin(), all.end(), [](const Filled& a, const Filled& b) {
    return std::pair(a.centre.x(), a.instance) < std::pair(b.centre.x(), b.instance);
  });
  // By instance: the first one that stands at its place, which may be itself.
  std::vector<std::size_t> original(all.size());
  for (std::size_t i = 0; i < all.size(); ++i) original[i] = i;
  for (std::size_t i = 0; i < all.size(); ++i)
    for (std::size_t k = i + 1;
         k < all.size() && all[k].centre.x() - all[i].centre.x() <= kEqual * all[i].size(); ++k) {
      if (!equal(all[i], all[k])) continue;
      const auto [first, second] = std::minmax(all[i].instance, all[k].instance);
      original[second] = std::min(original[second], first);
    }
  std::vector<Instance> kept;
  for (std::size_t i = 0; i < original.size(); ++i) {
    if (original[i] == i)
      kept.push_back(product.instances[i]);
    else
      product.notes.push_back(product.instances[i].name +
                              " is left out: the same solid stands at the same place as " +
                              product.instances[original[i]].name +
                              "; in the CAD program, delete one of them, or hide it from the export");
  }
  product.instances = std::move(kept);
}

}  // namespace takt::product
