#pragma once
// Octrees of curved surfaces kept as files, so that each is made once. An entry is named by the content of the mesh, never by
// a file name or a date. The entries that were used last stay when there are too many.
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "server/geometry/mesh/triangle_mesh.h"
#include "server/geometry/surface/face_octree.h"

namespace takt {

class FaceOctreeCache {
 public:
  /// With an empty directory the cache keeps no entries. The first stored entry creates the directory. Entries together are
  /// no larger than `most_bytes` after a store, unless the last one is.
  explicit FaceOctreeCache(std::filesystem::path directory = {}, std::uintmax_t most_bytes = kMostBytes)
      : directory_(std::move(directory)), most_bytes_(most_bytes) {}

  /// Bits of all vertices and triangles, and the version of the octree, as 32 hexadecimal digits.
  static std::string key(const TriangleMesh& mesh);

  /// The entry, bit for bit as stored; std::nullopt if it is missing, damaged, or of another number of faces.
  std::optional<FaceOctree> find(const std::string& key, std::size_t faces, std::size_t patches) const;

  /// Stores an entry atomically: readers see all of it or no entry. False if the write failed (no space, no permission); the
  /// next import then makes the octree again.
  bool store(const std::string& key, const FaceOctree& octree) const;

  std::filesystem::path file_of(const std::string& key) const;

 private:
  static constexpr std::uintmax_t kMostBytes = std::uintmax_t{1} << 30U;

  void remove_oldest() const;

  std::filesystem::path directory_;
  std::uintmax_t most_bytes_;
};

/// The octree of `surface`, which is made from `mesh`: the cached one, or FaceOctree(surface), which is stored.
FaceOctree face_octree_cached(const ContactSurface::Data& surface, const TriangleMesh& mesh,
                              const FaceOctreeCache& cache);

}  // namespace takt
