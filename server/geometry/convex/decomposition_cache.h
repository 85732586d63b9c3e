#pragma once
// Decompositions kept as files, so that the seconds they take are spent once for each mesh. An entry is named
// by the content of mesh and parameters, never by a file name or a date.
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "server/geometry/convex/decomposition.h"

namespace takt {

class DecompositionCache {
 public:
  /// An empty directory: nothing is kept. It is created when the first entry is stored.
  explicit DecompositionCache(std::filesystem::path directory = {}) : directory_(std::move(directory)) {}

  /// Bits of all vertices and triangles, parameters and version of the algorithm, as 32 hexadecimal digits.
  static std::string key(const TriangleMesh& solid, const DecompositionParameters& parameters);

  /// The entry's shapes, the same bits as were stored; nothing if there is none, or if it is damaged.
  std::optional<std::vector<ConvexShape>> find(const std::string& key) const;

  /// Stores an entry in one piece: readers see all of it or none. False if that was not possible (no space,
  /// no permission), which costs time at the next import and nothing else.
  bool store(const std::string& key, const std::vector<ConvexShape>& shapes) const;

  std::filesystem::path file_of(const std::string& key) const;

 private:
  std::filesystem::path directory_;
};

/// $TAKT_CACHE_DIR, else $XDG_CACHE_HOME/takt, else ~/.cache/takt; empty if none of these variables is set,
/// or if TAKT_CACHE_DIR is set and empty. For main programs: the core itself asks no environment.
std::filesystem::path user_cache_directory();

struct CachedDecomposition {
  std::vector<ConvexShape> shapes;
  bool from_cache = false;
};

/// decompose(), but only if the cache has not got it.
CachedDecomposition decompose_cached(const TriangleMesh& solid, const DecompositionParameters& parameters,
                                     const DecompositionCache& cache,
                                     const std::function<void(double)>& progress = {});

}  // namespace takt
