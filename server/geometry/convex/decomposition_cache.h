#pragma once
// Decompositions kept as files, so that each mesh is decomposed once. An entry is named by the content of
// mesh and parameters, never by a file name or a date.
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "server/geometry/convex/decomposition.h"

namespace takt {

class DecompositionCache {
 public:
  /// With an empty directory the cache keeps no entries. The first stored entry creates the directory.
  explicit DecompositionCache(std::filesystem::path directory = {}) : directory_(std::move(directory)) {}

  /// Bits of all vertices and triangles, parameters and version of the algorithm, as 32 hexadecimal digits.
  static std::string key(const TriangleMesh& solid, const DecompositionParameters& parameters);

  /// The entry's shapes, bit for bit as stored; std::nullopt if the entry is missing or damaged.
  std::optional<std::vector<ConvexShape>> find(const std::string& key) const;

  /// Stores an entry atomically: readers see all of it or no entry. False if the write failed (no space, no
  /// permission); the next import then decomposes the mesh again.
  bool store(const std::string& key, const std::vector<ConvexShape>& shapes) const;

  std::filesystem::path file_of(const std::string& key) const;

 private:
  std::filesystem::path directory_;
};

/// $TAKT_CACHE_DIR, else $XDG_CACHE_HOME/takt, else ~/.cache/takt; empty if no variable is set, or if
/// TAKT_CACHE_DIR is set and empty. For main programs: the core itself reads no environment.
std::filesystem::path user_cache_directory();

struct CachedDecomposition {
  std::vector<ConvexShape> shapes;
  bool from_cache = false;
};

/// Returns the cached decomposition, or runs decompose() and stores the result.
CachedDecomposition decompose_cached(const TriangleMesh& solid, const DecompositionParameters& parameters,
                                     const DecompositionCache& cache,
                                     const std::function<void(double)>& progress = {});

}  // namespace takt
