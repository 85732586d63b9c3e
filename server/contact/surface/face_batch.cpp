#include "server/contact/surface/face_batch.h"

namespace takt {

void FaceBatch::find(const ContactSurface::Data& target, const Pose& X_TB, std::span<const Vec3> p_B,
                     std::span<const double> reach_m) {
  const std::size_t count = p_B.size();
  for (std::size_t i = 0; i < count; ++i) x_T[i] = X_TB * p_B[i];
  target.octree.find({x_T.data(), count}, leaf);
  for (std::size_t i = 0; i < count; ++i)
    at_least_m[i] =
        leaf[i] == nullptr ? target.octree.at_least_m(x_T[i]) : target.octree.at_least_m(*leaf[i], x_T[i]);
  const auto listed = [&](std::size_t i) {
    return leaf[i] != nullptr && FaceOctree::has_list(*leaf[i]) && at_least_m[i] <= reach_m[i];
  };
  std::array<std::int32_t, FaceOctree::kBatch> first;
  for (std::size_t i = 0; i < count; ++i)
    if (listed(i)) __builtin_prefetch(target.octree.faces(*leaf[i]).data());
  for (std::size_t i = 0; i < count; ++i) {
    first[i] = listed(i) ? target.octree.faces(*leaf[i]).front().face : 0;
    const ContactFace* face = &target.faces[static_cast<std::size_t>(first[i])];
    __builtin_prefetch(face);
    __builtin_prefetch(&face->inward[1]);
  }
  for (std::size_t i = 0; i < count; ++i)
    __builtin_prefetch(
        &target.patches[static_cast<std::size_t>(target.faces[static_cast<std::size_t>(first[i])].patch)]);
}

}  // namespace takt
