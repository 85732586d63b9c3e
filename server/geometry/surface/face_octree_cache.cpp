#include "server/geometry/surface/face_octree_cache.h"

#include <algorithm>
#include <string_view>
#include <system_error>
#include <vector>

#include "idl/common/atomic_file.h"
#include "server/geometry/mesh/cache_entry.h"
#include "server/geometry/surface/contact_surface_data.h"

namespace takt {
namespace {

/// Changes with the members of FaceOctree, and with what its construction puts into them.
constexpr std::string_view kFormat = "takt face octree 1\n";
constexpr std::string_view kExtension = ".octree";

bool take(std::string_view& bytes, std::string_view expected) {
  if (!bytes.starts_with(expected)) return false;
  bytes.remove_prefix(expected.size());
  return true;
}

}  // namespace

std::string FaceOctreeCache::key(const TriangleMesh& mesh) {
  ContentHash hash;
  hash.add(kFormat);
  hash.add(mesh);
  return hash.text();
}

std::filesystem::path FaceOctreeCache::file_of(const std::string& key) const {
  return directory_ / (key + std::string(kExtension));
}

std::optional<FaceOctree> FaceOctreeCache::find(const std::string& key, std::size_t faces,
                                                std::size_t patches) const {
  if (directory_.empty()) return std::nullopt;
  const std::filesystem::path file = file_of(key);
  const auto entry = read_cache_entry(file, most_bytes_);
  if (!entry) return std::nullopt;
  std::string_view bytes = *entry;
  if (!take(bytes, kFormat) || !take(bytes, key)) return std::nullopt;
  const std::size_t digits = key.size();
  if (bytes.size() < digits || bytes.substr(0, digits) != checksum(bytes.substr(digits))) return std::nullopt;
  std::optional<FaceOctree> octree = FaceOctree::from_bytes(bytes.substr(digits), faces, patches);
  std::error_code error;  // the entry is good, even if its use cannot be noted
  if (octree) std::filesystem::last_write_time(file, std::filesystem::file_time_type::clock::now(), error);
  return octree;
}

bool FaceOctreeCache::store(const std::string& key, const FaceOctree& octree) const {
  if (directory_.empty()) return false;
  std::error_code error;
  std::filesystem::create_directories(directory_, error);
  const std::string bytes = octree.bytes();
  if (replace_file(file_of(key), {kFormat, key, checksum(bytes), bytes})) return false;
  remove_oldest();
  return true;
}

void FaceOctreeCache::remove_oldest() const {
  struct Entry {
    std::filesystem::file_time_type used;
    std::filesystem::path file;
    std::uintmax_t size;
    bool operator<(const Entry& other) const {
      return used != other.used ? used > other.used : file < other.file;
    }
  };
  std::vector<Entry> entries;
  std::error_code error;
  for (std::filesystem::directory_iterator i(directory_, error), end; !error && i != end;
       i.increment(error)) {
    if (i->path().extension() != kExtension) continue;
    std::error_code gone;  // another process may have removed it
    const std::filesystem::file_time_type used = i->last_write_time(gone);
    const std::uintmax_t size = gone ? 0 : i->file_size(gone);
    if (!gone) entries.push_back({used, i->path(), size});
  }
  std::sort(entries.begin(), entries.end());
  std::uintmax_t total = 0;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    total += entries[i].size;
    if (i > 0 && total > most_bytes_) std::filesystem::remove(entries[i].file, error);
  }
}

FaceOctree face_octree_cached(const ContactSurface::Data& surface, const TriangleMesh& mesh,
                              const FaceOctreeCache& cache) {
  const std::string key = FaceOctreeCache::key(mesh);
  if (auto known = cache.find(key, surface.faces.size(), surface.patches.size())) return std::move(*known);
  FaceOctree made(surface);
  cache.store(key, made);
  return made;
}

}  // namespace takt
