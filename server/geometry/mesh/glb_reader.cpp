#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <utility>

#include "server/geometry/mesh/readers.h"

namespace takt {
namespace {

using Json = nlohmann::json;

constexpr std::uint32_t kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;
constexpr std::size_t kGlbHeader = 12, kChunkHeader = 8;
constexpr std::uint64_t kMaxNumber = 0xFFFFFFFF;
constexpr std::uint64_t kByte = 5121, kShort = 5123, kInt = 5125, kFloat = 5126;
constexpr std::uint64_t kTriangles = 4, kStrip = 5, kFan = 6;

/// Little-endian.
std::uint32_t u32_at(std::string_view content, std::size_t offset) {
  std::uint32_t value = 0;
  std::memcpy(&value, content.data() + offset, sizeof(value));
  return value;
}

std::string named(const char* list, std::size_t index) {
  return std::string(list) + "[" + std::to_string(index) + "]";
}

const Json* member(const Json& object, const char* key) {
  if (!object.is_object()) return nullptr;
  const auto found = object.find(key);
  return found == object.end() ? nullptr : &*found;
}

std::uint64_t number(const Json& object, const char* key, const std::string& place,
                     const std::uint64_t* fallback = nullptr) {
  const Json* value = member(object, key);
  if (value == nullptr && fallback != nullptr) return *fallback;
  if (value == nullptr) throw MeshFault(place + " has no " + key);
  if (!value->is_number_unsigned() || value->get<std::uint64_t>() > kMaxNumber)
    throw MeshFault(place + ": its " + key + " must be a whole number below 2^32");
  return value->get<std::uint64_t>();
}
std::uint64_t number_or(const Json& object, const char* key, const std::string& place,
                        std::uint64_t fallback) {
  return number(object, key, place, &fallback);
}

/// `size` numbers, or none.
std::vector<double> numbers_of(const Json& object, const char* key, std::size_t size,
                               const std::string& place) {
  const Json* numbers = member(object, key);
  if (numbers == nullptr) return {};
  bool good = numbers->is_array() && numbers->size() == size;
  for (std::size_t i = 0; good && i < size; ++i) good = (*numbers)[i].is_number();
  if (!good) throw MeshFault(place + ": its " + key + " must be " + std::to_string(size) + " numbers");
  return numbers->get<std::vector<double>>();
}

/// Affine map of a node: glTF allows scale and shear, so this is not a Pose.
struct Affine {
  Mat3 A = Mat3::Identity();
  Vec3 p = Vec3::Zero();
};

/// Of the node's frame in that of its parent: its matrix, else translation, rotation and scale.
Affine transform_of(const Json& node, const std::string& place) {
  const std::vector<double> matrix = numbers_of(node, "matrix", 16, place),
                            translation = numbers_of(node, "translation", 3, place),
                            rotation = numbers_of(node, "rotation", 4, place),
                            scale = numbers_of(node, "scale", 3, place);
  Affine X;
  if (!matrix.empty()) {
    const Eigen::Map<const Eigen::Matrix4d> columns(matrix.data());
    return {columns.topLeftCorner<3, 3>(), columns.topRightCorner<3, 1>()};
  }
  if (!translation.empty()) X.p = Eigen::Map<const Vec3>(translation.data());
  if (!rotation.empty()) X.A = Quat(rotation[3], rotation[0], rotation[1], rotation[2]).toRotationMatrix();
  if (!scale.empty()) X.A *= Eigen::Map<const Vec3>(scale.data()).asDiagonal();
  return X;
}

class GlbReader {
 public:
  explicit GlbReader(std::string_view content) { split(content); }

  std::vector<NamedMesh> read() {
    for (const char* list : {"nodes", "meshes", "accessors", "bufferViews", "buffers", "scenes"}) {
      const Json* items = member(document_, list);
      if (items != nullptr && !items->is_array()) throw MeshFault(std::string(list) + " is no list");
    }
    meshes_.resize(count("meshes"));
    seen_.assign(count("nodes"), false);
    const Json& scene = item("scenes", number_or(document_, "scene", "the file", 0), "the file");
    for (const std::uint64_t node : references(scene, "nodes", "the scene")) read_tree(node);
    return builder_.take_objects();
  }

 private:
  /// Items in the file's data.
  struct Accessor {
    std::size_t at = 0, stride = 0, count = 0, size = 0;  ///< all but the count in bytes
  };
  struct Primitive {
    std::uint64_t mode = kTriangles;
    Accessor positions;
    std::optional<Accessor> indices;
    std::size_t corners() const { return indices ? indices->count : positions.count; }
    /// Of a strip or fan an upper bound.
    std::size_t triangles() const { return mode == kTriangles ? corners() / 3 : corners(); }
  };

  void split(std::string_view content) {
    if (content.size() < kGlbHeader + kChunkHeader || !content.starts_with("glTF"))
      throw MeshFault("a GLB file starts with the word glTF and a header of 20 bytes, this file does not (" +
                      std::to_string(content.size()) + " bytes)");
    const std::uint32_t version = u32_at(content, 4), announced = u32_at(content, 8);
    if (version != 2)
      throw MeshFault("glTF version " + std::to_string(version) + " is not supported, only 2");
    if (announced != content.size())
      throw MeshFault("the header announces " + std::to_string(announced) + " bytes, but the file has " +
                      std::to_string(content.size()) + " bytes: it is truncated or has extra data");
    std::string_view json;
    for (std::size_t at = kGlbHeader; at < content.size();) {
      if (content.size() - at < kChunkHeader)
        throw MeshFault("a chunk at byte " + std::to_string(at) + " is cut");
      const std::size_t length = u32_at(content, at);
      const std::uint32_t type = u32_at(content, at + 4);
      if (length > content.size() - at - kChunkHeader)
        throw MeshFault("the chunk at byte " + std::to_string(at) + " announces " + std::to_string(length) +
                        " bytes, but there are " + std::to_string(content.size() - at - kChunkHeader));
      const std::string_view chunk = content.substr(at + kChunkHeader, length);
      if (at == kGlbHeader && type != kJsonChunk) throw MeshFault("the first chunk is no JSON");
      if (at == kGlbHeader) json = chunk;
      if (type == kBinaryChunk && binary_.empty()) binary_ = chunk;
      at += kChunkHeader + length;
    }
    try {
      document_ = Json::parse(json);
    } catch (const Json::exception& error) {
      throw MeshFault(std::string("it cannot be understood: ") + error.what());
    }
  }

  std::size_t count(const char* list) const {
    const Json* items = member(document_, list);
    return items == nullptr ? 0 : items->size();
  }
  const Json& item(const char* list, std::uint64_t index, const std::string& from) const {
    if (index >= count(list))
      throw MeshFault(from + " refers to " + named(list, index) + ", of which there are " +
                      std::to_string(count(list)));
    return document_[list][index];
  }
  static std::vector<std::uint64_t> references(const Json& object, const char* key,
                                               const std::string& place) {
    std::vector<std::uint64_t> numbers;
    const Json* list = member(object, key);
    if (list == nullptr) return numbers;
    if (!list->is_array()) throw MeshFault(place + ": its " + key + " is no list");
    for (const Json& entry : *list) {
      if (!entry.is_number_unsigned()) throw MeshFault(place + ": its " + key + " must be whole numbers");
      numbers.push_back(entry.get<std::uint64_t>());
    }
    return numbers;
  }

  void read_tree(std::uint64_t root) {
    struct Next {
      std::uint64_t node;
      std::size_t depth;
      std::string from;
      Affine X_FP;  ///< parent in the file
    };
    std::vector<Next> waiting{{root, 0, "the scene", {}}};
    while (!waiting.empty()) {
      const Next next = waiting.back();
      waiting.pop_back();
      const std::string place = named("nodes", next.node);
      const Json& node = item("nodes", next.node, next.from);
      if (next.depth > kMaxGlbDepth)
        throw MeshFault(place + " lies below " + std::to_string(next.depth) + " others; allowed are " +
                        std::to_string(kMaxGlbDepth));
      if (seen_[next.node]) throw MeshFault(place + " is there twice; every node has one place in a tree");
      seen_[next.node] = true;
      const Affine X_PN = transform_of(node, place);
      const Affine X_FN{next.X_FP.A * X_PN.A, next.X_FP.A * X_PN.p + next.X_FP.p};
      if (node.contains("mesh")) {
        const Json* name = member(node, "name");
        show_mesh(number(node, "mesh", place), place,
                  name != nullptr && name->is_string() ? name->get<std::string>() : place, X_FN);
      }
      const std::vector<std::uint64_t> children = references(node, "children", place);
      for (auto child = children.rbegin(); child != children.rend(); ++child)
        waiting.push_back({*child, next.depth + 1, place, X_FN});
    }
  }

  void show_mesh(std::uint64_t index, const std::string& from, const std::string& name, const Affine& X_FN) {
    if (index >= meshes_.size() || meshes_[index].empty()) read_mesh(index, from);
    for (const Primitive& primitive : meshes_[index]) shown_ += primitive.triangles();
    if (shown_ > kMaxGlbTriangles)
      throw MeshFault("with " + from + " there are more than " + std::to_string(kMaxGlbTriangles) +
                      " triangles to be seen");
    builder_.begin_object(name);
    builder_.forget_positions();
    for (const Primitive& primitive : meshes_[index]) add_primitive(name, primitive, X_FN);
  }

  void read_mesh(std::uint64_t index, const std::string& from) {
    const Json* primitives = member(item("meshes", index, from), "primitives");
    const std::string place = named("meshes", index);
    if (primitives == nullptr || !primitives->is_array() || primitives->empty())
      throw MeshFault(place + " has no primitives");
    for (std::size_t p = 0; p < primitives->size(); ++p)
      meshes_[index].push_back(
          read_primitive((*primitives)[p], place + ".primitives[" + std::to_string(p) + "]"));
  }

  Primitive read_primitive(const Json& source, const std::string& place) const {
    Primitive made;
    made.mode = number_or(source, "mode", place, kTriangles);
    if (made.mode < kTriangles) throw MeshFault(place + ": lines and points are not allowed, only faces");
    if (made.mode > kFan) throw MeshFault(place + ": the mode " + std::to_string(made.mode) + " is unknown");
    const Json* attributes = member(source, "attributes");
    if (attributes == nullptr) throw MeshFault(place + " has no attributes");
    made.positions = read_accessor(number(*attributes, "POSITION", place), {kFloat}, "VEC3", 3, place);
    if (source.contains("indices")) {
      made.indices =
          read_accessor(number(source, "indices", place), {kByte, kShort, kInt}, "SCALAR", 1, place);
      check_indices(*made.indices, made.positions.count, place);
    }
    if (made.mode > kTriangles && made.corners() < 3)
      throw MeshFault(place + " has " + std::to_string(made.corners()) +
                      " corners; a strip or fan has 3 or more");
    return made;
  }

  Accessor read_accessor(std::uint64_t index, const std::set<std::uint64_t>& types, const char* shape,
                         std::uint64_t components, const std::string& from) const {
    const Json& accessor = item("accessors", index, from);
    const std::string place = named("accessors", index);
    const std::uint64_t type = number(accessor, "componentType", place);
    const Json* given = member(accessor, "type");
    if (!types.contains(type) || given == nullptr || *given != shape)
      throw MeshFault(place + ": positions are VEC3 of 5126 (float), indices SCALAR of 5121, 5123 or 5125");
    if (accessor.contains("sparse")) throw MeshFault(place + ": sparse accessors are not supported");
    if (!accessor.contains("bufferView"))
      throw MeshFault(place + " has no bufferView; compressed meshes are not supported");
    const std::uint64_t view = number(accessor, "bufferView", place);
    const std::uint64_t offset = number_or(accessor, "byteOffset", place, 0);
    const std::uint64_t items = number(accessor, "count", place);
    const std::uint64_t size = components * (type == kByte ? 1 : type == kShort ? 2 : 4);
    const View bytes = read_view(view, place);
    const std::uint64_t stride = bytes.stride == 0 ? size : bytes.stride;
    if (items == 0) throw MeshFault(place + ": its count is 0");
    if (stride < size || offset + stride * (items - 1) + size > bytes.length)
      throw MeshFault(place + ": " + std::to_string(items) + " items of " + std::to_string(size) +
                      " bytes from byte " + std::to_string(offset) + " on, " + std::to_string(stride) +
                      " bytes apart, do not fit into the " + std::to_string(bytes.length) + " bytes of " +
                      named("bufferViews", view));
    return {bytes.offset + offset, stride, items, size};
  }

  struct View {
    std::uint64_t offset, length, stride;
  };
  View read_view(std::uint64_t index, const std::string& from) const {
    const Json& view = item("bufferViews", index, from);
    const std::string place = named("bufferViews", index);
    const std::uint64_t buffer = number(view, "buffer", place);
    const Json& of = item("buffers", buffer, place);
    if (buffer != 0 || of.contains("uri"))
      throw MeshFault(place + ": " + named("buffers", buffer) + " does not lie in this file, which it must");
    const std::uint64_t offset = number_or(view, "byteOffset", place, 0);
    const std::uint64_t length = number(view, "byteLength", place);
    if (offset + length > binary_.size())
      throw MeshFault(place + ": " + std::to_string(length) + " bytes from byte " + std::to_string(offset) +
                      " on do not fit into the " + std::to_string(binary_.size()) +
                      " bytes of the file's data");
    const std::uint64_t stride = number_or(view, "byteStride", place, 0);
    if (stride > 252) throw MeshFault(place + ": its byteStride must be at most 252");
    return {offset, length, stride};
  }

  std::uint32_t index_at(const Accessor& indices, std::size_t i) const {
    std::uint32_t index = 0;
    std::memcpy(&index, binary_.data() + indices.at + i * indices.stride, indices.size);  // little endian
    return index;
  }
  void check_indices(const Accessor& indices, std::size_t vertices, const std::string& place) const {
    for (std::size_t i = 0; i < indices.count; ++i)
      if (const std::uint32_t index = index_at(indices, i); index >= vertices)
        throw MeshFault(place + ": index " + std::to_string(i) + " is " + std::to_string(index) +
                        ", which is out of range: there are " + std::to_string(vertices) +
                        " vertices, counted from 0");
  }

  void add_primitive(const std::string& object, const Primitive& primitive, const Affine& X_FN) {
    const auto in_file = [&](const MeshBuilder::Single& p_N) -> Vec3 {
      return X_FN.A * shortest_decimals(p_N) + X_FN.p;
    };
    std::vector<std::uint32_t> vertices;
    for (std::size_t i = 0; i < primitive.positions.count; ++i) {
      MeshBuilder::Single p_N{};
      std::memcpy(p_N.data(), binary_.data() + primitive.positions.at + i * primitive.positions.stride,
                  sizeof(p_N));
      if (!in_file(p_N).allFinite()) {
        std::ostringstream text;
        text << "object '" << object << "', vertex " << i << ": the position (" << p_N[0] << ", " << p_N[1]
             << ", " << p_N[2] << ") or its place in the scene is not finite";
        throw MeshFault(text.str());
      }
      vertices.push_back(builder_.vertex(builder_.position(p_N, in_file)));
    }
    // glTF 2.0, 3.7.4: a mirroring transform turns the order of the vertices round.
    const bool mirrored = X_FN.A.determinant() < 0.0;
    const auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
      const auto vertex = [&](std::size_t corner) {
        return vertices[primitive.indices ? index_at(*primitive.indices, corner) : corner];
      };
      if (mirrored) std::swap(b, c);
      builder_.add_triangle({vertex(a), vertex(b), vertex(c)});
    };
    const std::size_t corners = primitive.corners();
    if (primitive.mode == kTriangles)
      for (std::size_t i = 0; i + 2 < corners; i += 3) add(i, i + 1, i + 2);
    else
      for (std::size_t i = 0; i + 2 < corners; ++i)  // every second triangle of a strip runs the other way
        if (primitive.mode == kStrip)
          add(i + i % 2, i + 1 - i % 2, i + 2);
        else
          add(0, i + 1, i + 2);
  }

  Json document_;
  std::string_view binary_;
  std::vector<std::vector<Primitive>> meshes_;  ///< those of nodes that have been read
  std::vector<bool> seen_;                      ///< by node
  std::size_t shown_ = 0;                       ///< triangles
  MeshBuilder builder_;
};

}  // namespace

std::vector<NamedMesh> read_glb(std::string_view content) {
  return GlbReader(content).read();
}

}  // namespace takt
