#pragma once
// Entries of caches: their names, a hash of all that an entry is made from, and their files.
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>

#include "server/geometry/mesh/triangle_mesh.h"

namespace takt {

/// Two independent 64-bit chains (multiply-xorshift as in splitmix64). Not cryptographic: it detects
/// accidental differences only.
class ContentHash {
 public:
  void add(std::uint64_t word) {
    for (std::size_t i = 0; i < state_.size(); ++i) {
      std::uint64_t z = (state_[i] ^ word) * kFactors[i];
      z ^= z >> 31;
      state_[i] = z * 0x94D049BB133111EBULL + kSeeds[i];
    }
  }
  void add(double value) { add(std::bit_cast<std::uint64_t>(value)); }
  void add(std::string_view bytes) {
    add(std::uint64_t{bytes.size()});
    for (; !bytes.empty(); bytes.remove_prefix(std::min(bytes.size(), sizeof(std::uint64_t)))) {
      std::uint64_t word = 0;
      std::memcpy(&word, bytes.data(), std::min(bytes.size(), sizeof(word)));
      add(word);
    }
  }
  /// Bits of all vertices and triangles.
  void add(const TriangleMesh& mesh) {
    add(std::uint64_t{mesh.vertices.size()});
    for (const Vec3& v : mesh.vertices)
      for (int i = 0; i < 3; ++i) add(v[i]);
    add(std::uint64_t{mesh.triangles.size()});
    for (const auto& t : mesh.triangles)
      for (const std::uint32_t v : t) add(std::uint64_t{v});
  }
  /// 32 hexadecimal digits.
  std::string text() const {
    std::array<char, 33> digits{};
    std::snprintf(digits.data(), digits.size(), "%016llx%016llx", static_cast<unsigned long long>(state_[0]),
                  static_cast<unsigned long long>(state_[1]));
    return digits.data();
  }

 private:
  static constexpr std::array<std::uint64_t, 2> kSeeds{0x9E3779B97F4A7C15ULL, 0xD1B54A32D192ED03ULL};
  static constexpr std::array<std::uint64_t, 2> kFactors{0xBF58476D1CE4E5B9ULL, 0xFF51AFD7ED558CCDULL};
  std::array<std::uint64_t, 2> state_ = kSeeds;
};

inline std::string checksum(std::string_view bytes) {
  ContentHash hash;
  hash.add(bytes);
  return hash.text();
}

/// All bytes of a regular file; std::nullopt if there is none, it is larger than `most_bytes`, or it cannot be read.
inline std::optional<std::string> read_cache_entry(const std::filesystem::path& file,
                                                   std::uintmax_t most_bytes) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) return std::nullopt;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error || size > most_bytes) return std::nullopt;
  std::string bytes(static_cast<std::size_t>(size), '\0');
  std::ifstream stream(file, std::ios::binary);
  if (!stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()))) return std::nullopt;
  return bytes;
}

}  // namespace takt
