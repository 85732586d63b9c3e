#include "server/geometry/mesh/builder.h"

#include <algorithm>
#include <charconv>
#include <system_error>

namespace takt {

Vec3 shortest_decimals(const std::array<float, 3>& p) {
  Vec3 result(p[0], p[1], p[2]);
  for (std::size_t i = 0; i < 3; ++i) {
    std::array<char, 32> text{};
    const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), p[i]);
    if (error == std::errc()) std::from_chars(text.data(), end, result[static_cast<Eigen::Index>(i)]);
  }
  return result;
}

void MeshBuilder::grow() {
  slots_.assign(std::max<std::size_t>(1024, 2 * slots_.size()), kFree);
  for (std::size_t i = first_; i < keys_.size(); ++i) {
    std::size_t slot = slot_of(keys_[i]);
    while (slots_[slot] != kFree) slot = (slot + 1) & (slots_.size() - 1);
    slots_[slot] = static_cast<std::uint32_t>(i);
  }
}

std::vector<NamedMesh> MeshBuilder::take_objects() {
  std::erase_if(objects_, [](const NamedMesh& object) { return object.mesh.triangles.empty(); });
  for (std::size_t i = 0; i < objects_.size(); ++i)
    if (objects_[i].name.empty()) objects_[i].name = "object " + std::to_string(i + 1);
  return std::move(objects_);
}

}  // namespace takt
