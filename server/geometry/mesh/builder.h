#pragma once
// Shared parts of the readers of mesh files: the objects they build, the numbering of vertices, the error.
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "server/geometry/mesh/diagnostic.h"
#include "server/geometry/mesh/triangle_mesh.h"

namespace takt {

/// A file's content is invalid. what() has the place (line, triangle, node), the value found and the values
/// allowed, without the name of the file and the full stop.
struct MeshFault : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct NamedMesh {
  std::string name;  ///< object or group name in the file, else "object N"
  TriangleMesh mesh;
  std::vector<MeshDiagnostic> findings;  ///< of the reader
};

/// The shortest decimal number with this single precision value: 0.0295 and not 0.029500000178814.
Vec3 shortest_decimals(const std::array<float, 3>& p);

/// Positions of a file and the objects that use them. Positions that are equal in single precision become
/// one, at the place of the first: STL has no shared vertices, and many programs write the copies of one
/// vertex with different last digits. The vertices of an object are numbered in the order of their first use.
class MeshBuilder {
 public:
  using Single = std::array<float, 3>;

  /// The number of a position in double precision (finite).
  std::uint32_t position(const Vec3& p) {
    const Eigen::Vector3f single = p.cast<float>();
    return position({single.x(), single.y(), single.z()}, [&](const Single&) { return p; });
  }
  /// The number of a position in single precision (finite); `place(p)` converts a new one to the file's
  /// frame.
  template <class Place>
  std::uint32_t position(const Single& p, const Place& place) {
    const Single key{p[0] + 0.0F, p[1] + 0.0F, p[2] + 0.0F};  // -0 becomes 0
    if (2 * (keys_.size() - first_) >= slots_.size()) grow();
    std::size_t slot = slot_of(key);
    while (slots_[slot] != kFree && keys_[slots_[slot]] != key) slot = (slot + 1) & (slots_.size() - 1);
    if (slots_[slot] == kFree) {
      slots_[slot] = static_cast<std::uint32_t>(keys_.size());
      keys_.push_back(key);
      positions_.push_back(place(p) + Vec3::Zero());
    }
    return slots_[slot];
  }
  /// Later positions are not merged with earlier ones, even if they are equal.
  void forget_positions() { slots_.clear(), first_ = keys_.size(); }
  const Vec3& place(std::uint32_t position) const { return positions_[position]; }

  /// Later faces belong to a new object.
  void begin_object(std::string name) { objects_.push_back({std::move(name), {}, {}}); }
  /// The vertex of the current object at this position.
  std::uint32_t vertex(std::uint32_t position) {
    if (objects_.empty()) begin_object("");
    used_.resize(positions_.size());
    auto& [object, number] = used_[position];
    auto& vertices = objects_.back().mesh.vertices;
    if (object != objects_.size()) {
      object = static_cast<std::uint32_t>(objects_.size());
      number = static_cast<std::uint32_t>(vertices.size());
      vertices.push_back(positions_[position]);
    }
    return number;
  }
  void add_triangle(const TriangleMesh::Triangle& t) { objects_.back().mesh.triangles.push_back(t); }

  /// Moves out the objects that have faces.
  std::vector<NamedMesh> take_objects();

 private:
  static constexpr std::uint32_t kFree = 0xFFFFFFFF;

  std::size_t slot_of(const Single& key) const {
    std::uint64_t hash = 0;
    for (const float x : key) {
      hash ^= std::bit_cast<std::uint32_t>(x);
      hash *= 0x9E3779B97F4A7C15ULL;  // 2^64 / golden ratio: spreads neighbouring numbers
      hash ^= hash >> 32;
    }
    return hash & (slots_.size() - 1);
  }
  void grow();

  struct Use {
    std::uint32_t object = 0;  ///< the last object that used the position, from 1
    std::uint32_t number = 0;  ///< of the vertex in this object
  };

  std::vector<Single> keys_;  ///< by position
  std::vector<Vec3> positions_;
  std::vector<Use> used_;  ///< by position
  /// Hash table of the positions from `first_` on: open addressing, a power of two.
  std::vector<std::uint32_t> slots_;
  std::size_t first_ = 0;
  std::vector<NamedMesh> objects_;
};

}  // namespace takt
