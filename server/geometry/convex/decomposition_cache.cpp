#include "server/geometry/convex/decomposition_cache.h"

#include <stdlib.h>

#include <array>
#include <charconv>
#include <cstdint>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "idl/common/atomic_file.h"
#include "server/geometry/mesh/cache_entry.h"

namespace takt {
namespace {

constexpr std::string_view kFormat = "takt convex parts 2";
constexpr std::uintmax_t kLargestEntry = 256U << 20;  // more than 1024 parts of 1024 vertices

void append_number(std::string& text, double value) {
  std::array<char, 32> digits{};
  const auto [end, error] =
      std::to_chars(digits.data(), digits.data() + digits.size(), value, std::chars_format::hex);
  text.append(digits.data(), end);
}

std::string to_text(const std::string& key, const std::vector<ConvexShape>& shapes) {
  std::string text =
      std::string(kFormat) + "\nkey " + key + "\nparts " + std::to_string(shapes.size()) + "\n";
  for (const ConvexShape& shape : shapes) {
    text += "vertices " + std::to_string(shape.vertices.size()) + "\n";
    for (const Vec3& v : shape.vertices) {
      for (int i = 0; i < 3; ++i) {
        append_number(text, v[i]);
        text += i < 2 ? ' ' : '\n';
      }
    }
  }
  return text + "checksum " + checksum(text) + "\n";
}

/// Reads an entry word by word; the first fault sets `ok` to false for good.
class EntryReader {
 public:
  explicit EntryReader(std::string_view text) : rest_(text) {}

  void expect(std::string_view word) { ok = ok && take(word); }
  template <typename Number, typename... Format>
  Number number(char terminator, Format... format) {
    Number value{};
    const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), value, format...);
    ok = ok && error == std::errc();
    if (!ok) return {};
    rest_.remove_prefix(static_cast<std::size_t>(end - rest_.data()));
    ok = take({&terminator, 1});
    return value;
  }
  bool at_end() const { return rest_.empty(); }

  bool ok = true;

 private:
  bool take(std::string_view word) {
    if (!rest_.starts_with(word)) return false;
    rest_.remove_prefix(word.size());
    return true;
  }
  std::string_view rest_;
};

std::optional<std::vector<ConvexShape>> from_text(const std::string& key, std::string_view text) {
  const std::size_t end = text.rfind("checksum ");
  if (end == std::string_view::npos) return std::nullopt;
  if (text.substr(end) != "checksum " + checksum(text.substr(0, end)) + "\n") return std::nullopt;
  EntryReader reader(text.substr(0, end));
  reader.expect(kFormat);
  reader.expect("\nkey " + key + "\nparts ");
  const auto parts = reader.number<std::uint32_t>('\n');
  std::vector<ConvexShape> shapes;
  for (std::uint32_t i = 0; i < parts && reader.ok; ++i) {
    reader.expect("vertices ");
    const auto count = reader.number<std::uint32_t>('\n');
    std::vector<Vec3> vertices;
    for (std::uint32_t k = 0; k < count && reader.ok; ++k) {
      const double x = reader.number<double>(' ', std::chars_format::hex);
      const double y = reader.number<double>(' ', std::chars_format::hex);
      const double z = reader.number<double>('\n', std::chars_format::hex);
      vertices.emplace_back(x, y, z);
    }
    if (!reader.ok) return std::nullopt;
    try {
      shapes.push_back(ConvexShape::from_points(std::move(vertices)));
    } catch (const std::invalid_argument&) {
      return std::nullopt;
    }
  }
  if (!reader.ok || !reader.at_end() || shapes.empty()) return std::nullopt;
  return shapes;
}

}  // namespace

std::string DecompositionCache::key(const TriangleMesh& solid, const DecompositionParameters& parameters) {
  ContentHash hash;
  hash.add(kFormat);
  hash.add(decomposition_version());
  hash.add(static_cast<std::uint64_t>(parameters.max_hulls));
  hash.add(static_cast<std::uint64_t>(parameters.resolution));
  hash.add(parameters.max_volume_error);
  hash.add(static_cast<std::uint64_t>(parameters.max_vertices_per_hull));
  hash.add(static_cast<std::uint64_t>(parameters.best_plane));
  hash.add(solid);
  return hash.text();
}

std::filesystem::path DecompositionCache::file_of(const std::string& key) const {
  return directory_ / (key + ".convex");
}

std::optional<std::vector<ConvexShape>> DecompositionCache::find(const std::string& key) const {
  if (directory_.empty()) return std::nullopt;
  const auto text = read_cache_entry(file_of(key), kLargestEntry);
  return text ? from_text(key, *text) : std::nullopt;
}

bool DecompositionCache::store(const std::string& key, const std::vector<ConvexShape>& shapes) const {
  if (directory_.empty()) return false;
  std::error_code error;
  std::filesystem::create_directories(directory_, error);
  return !replace_file(file_of(key), {to_text(key, shapes)});
}

std::filesystem::path user_cache_directory() {
  const auto variable = [](const char* name) { return ::getenv(name); };
  if (const char* own = variable("TAKT_CACHE_DIR")) return own;
  const char* base = variable("XDG_CACHE_HOME");
  // XDG base directory specification (freedesktop.org): relative paths are ignored.
  if (base != nullptr && base[0] == '/') return std::filesystem::path(base) / "takt";
  const char* home = variable("HOME");
  if (home != nullptr && home[0] == '/') return std::filesystem::path(home) / ".cache" / "takt";
  return {};
}

CachedDecomposition decompose_cached(const TriangleMesh& solid, const DecompositionParameters& parameters,
                                     const DecompositionCache& cache,
                                     const std::function<void(double)>& progress) {
  const std::string key = DecompositionCache::key(solid, parameters);
  if (auto known = cache.find(key)) return {std::move(*known), true};
  CachedDecomposition result{decompose(solid, parameters, progress), false};
  cache.store(key, result.shapes);
  return result;
}

}  // namespace takt
