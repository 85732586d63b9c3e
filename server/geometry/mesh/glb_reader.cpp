#include "server/geometry/mesh/glb_reader.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <tuple>
#include <utility>
#include <vector>

#include "server/geometry/mesh/builder.h"

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

using Triangle = TriangleMesh::Triangle;

/// Numbers in the file's data: items `stride` bytes apart.
struct Column {
  const char* at = nullptr;
  std::uint64_t count = 0, stride = 0, type = kFloat;

  std::uint32_t index(std::uint64_t i) const {
    std::uint32_t value = 0;
    std::memcpy(&value, at + i * stride,
                type == kByte    ? 1
                : type == kShort ? 2
                                 : 4);  // little endian, as the file
    return value;
  }
  MeshBuilder::Single position(std::uint64_t i) const {
    MeshBuilder::Single p{};
    std::memcpy(p.data(), at + i * stride, sizeof(p));
    return p;
  }
};

}  // namespace

class GlbFile::Content {
 public:
  explicit Content(std::string content) : content_(std::move(content)) {
    split();
    for (const char* list : {"nodes", "meshes", "accessors", "bufferViews", "buffers", "scenes"}) {
      const Json* items = member(document_, list);
      if (items != nullptr && !items->is_array()) throw MeshFault(std::string(list) + " is no list");
    }
    seen_.assign(count("nodes"), false);
    const Json& scene = item("scenes", number_or(document_, "scene", "the file", 0), "the file");
    for (const std::uint64_t node : references(scene, "nodes", "the scene")) read_node(node, "the scene");
  }

  const GlbNodes& nodes() const { return found_; }

  std::vector<NamedMesh> objects(const std::string& node) const {
    std::size_t first = 0, last = found_.size();
    if (!node.empty()) std::tie(first, last) = find_glb_node(found_, node);
    std::vector<Affine> X(found_.size());  // in the axes of the result
    Reading reading;
    for (std::size_t i = first; i < last; ++i) {
      const GlbNode& here = found_[i];
      if (!node.empty() && i == first)
        X[i] = rigid_part(glb_node_in_file(found_, i), here.name).second;
      else
        X[i] = here.parent < 0 ? here.X_PN : X[static_cast<std::size_t>(here.parent)] * here.X_PN;
      if (!here.mesh) continue;
      reading.object = glb_node_path(found_, i);
      reading.builder.begin_object(reading.object);
      reading.builder.forget_positions();
      add_mesh(*here.mesh, named("nodes", here.number), X[i], reading);
    }
    std::vector<NamedMesh> objects = reading.builder.take_objects();
    if (reading.passed_over.empty() || objects.empty()) return objects;
    objects.front().findings.push_back(
        {MeshDiagnosticKind::no_faces, MeshSeverity::info, reading.passed_over.size(), 0.0, Vec3::Zero(),
         counted(reading.passed_over.size(), "primitive draws", "primitives draw") +
             " lines or points, which bound nothing, the first is " + reading.first_passed_over,
         std::string(remedy_of(MeshDiagnosticKind::no_faces))});
    return objects;
  }

 private:
  struct Reading {
    MeshBuilder builder;
    std::string object;
    std::set<std::pair<std::uint64_t, std::size_t>> passed_over;  ///< mesh, primitive
    std::string first_passed_over;
    std::uint64_t shown = 0;  ///< triangles
  };

  void split() {
    const std::string_view content = content_;
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

  void read_node(std::uint64_t root, const std::string& from) {
    struct Next {
      std::uint64_t node;
      std::size_t depth;
      int parent;
      std::string from;
    };
    std::vector<Next> waiting{{root, 0, -1, from}};
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
      GlbNode found{next.node, next.parent, name_of(node), {}, {}, false};
      read_transform(node, place, found);
      if (node.contains("mesh")) {
        found.mesh = number(node, "mesh", place);
        const Json& mesh = item("meshes", *found.mesh, place);
        if (found.name.empty()) found.name = name_of(mesh);
        found.has_faces = has_faces(mesh);
      }
      if (found.name.empty()) found.name = place;
      const auto index = static_cast<int>(found_.size());
      found_.push_back(std::move(found));
      std::vector<std::uint64_t> children = references(node, "children", place);
      for (auto child = children.rbegin(); child != children.rend(); ++child)
        waiting.push_back({*child, next.depth + 1, index, place});
    }
  }

  static std::string name_of(const Json& object) {
    const Json* name = member(object, "name");
    return name != nullptr && name->is_string() ? name->get<std::string>() : std::string();
  }

  /// As far as its description says; add_mesh() checks it.
  static bool has_faces(const Json& mesh) {
    const Json* primitives = member(mesh, "primitives");
    if (primitives == nullptr || !primitives->is_array()) return true;
    for (const Json& primitive : *primitives) {
      const Json* mode = member(primitive, "mode");
      if (mode == nullptr || !mode->is_number_unsigned() || mode->get<std::uint64_t>() >= kTriangles)
        return true;
    }
    return false;
  }

  static std::vector<double> numbers(const Json& node, const char* key, std::size_t size,
                                     const std::string& place, std::vector<double> fallback) {
    const Json* given = member(node, key);
    if (given == nullptr) return fallback;
    bool good = given->is_array() && given->size() == size;
    for (std::size_t i = 0; good && i < size; ++i) good = (*given)[i].is_number();
    if (!good) throw MeshFault(place + ": its " + key + " must be " + std::to_string(size) + " numbers");
    return given->get<std::vector<double>>();
  }

  static void read_transform(const Json& node, const std::string& place, GlbNode& found) {
    const std::vector<double> m = numbers(node, "matrix", 16, place, {});
    const std::vector<double> t = numbers(node, "translation", 3, place, {0.0, 0.0, 0.0});
    const std::vector<double> q = numbers(node, "rotation", 4, place, {0.0, 0.0, 0.0, 1.0});
    const std::vector<double> s = numbers(node, "scale", 3, place, {1.0, 1.0, 1.0});
    if (!m.empty()) {  // column by column
      found.X_PN.A << m[0], m[4], m[8], m[1], m[5], m[9], m[2], m[6], m[10];
      found.X_PN.p << m[12], m[13], m[14];
      return;
    }
    const Quat rotation(q[3], q[0], q[1], q[2]);
    if (!(std::abs(rotation.norm() - 1.0) < 0.01))
      throw MeshFault(place + ": its rotation has the length " + std::to_string(rotation.norm()) +
                      "; a quaternion of length 1 is allowed");
    found.X_PN.A = rotation.normalized().toRotationMatrix() * Vec3(s[0], s[1], s[2]).asDiagonal();
    found.X_PN.p << t[0], t[1], t[2];
  }

  void add_mesh(std::uint64_t index, const std::string& from, const Affine& X, Reading& reading) const {
    const Json& mesh = item("meshes", index, from);
    const std::string place = named("meshes", index);
    const Json* primitives = member(mesh, "primitives");
    if (primitives == nullptr || !primitives->is_array() || primitives->empty())
      throw MeshFault(place + " has no primitives");
    for (std::size_t p = 0; p < primitives->size(); ++p) {
      const std::string primitive_place = place + ".primitives[" + std::to_string(p) + "]";
      if (number_or((*primitives)[p], "mode", primitive_place, kTriangles) < kTriangles) {
        if (reading.passed_over.empty()) reading.first_passed_over = primitive_place;
        reading.passed_over.emplace(index, p);
        continue;
      }
      add_primitive((*primitives)[p], primitive_place, from, X, reading);
    }
  }

  void add_primitive(const Json& source, const std::string& place, const std::string& node, const Affine& X,
                     Reading& reading) const {
    const std::uint64_t mode = number_or(source, "mode", place, kTriangles);
    if (mode > kFan) throw MeshFault(place + ": the mode " + std::to_string(mode) + " is unknown");
    const Json* attributes = member(source, "attributes");
    if (attributes == nullptr) throw MeshFault(place + " has no attributes");
    const Column positions = column(number(*attributes, "POSITION", place), true, place);
    Column indices{nullptr, positions.count, 0, kInt};
    if (source.contains("indices")) indices = column(number(source, "indices", place), false, place);
    const std::uint64_t corners = indices.count;
    if (mode > kTriangles && corners < 3)
      throw MeshFault(place + " has " + std::to_string(corners) + " corners; a strip or fan has 3 or more");
    const std::uint64_t triangles = mode == kTriangles ? corners / 3 : corners - 2;
    reading.shown += triangles;
    if (reading.shown > kMaxGlbTriangles)
      throw MeshFault("with " + node + " there are more than " + std::to_string(kMaxGlbTriangles) +
                      " triangles to be seen");
    const std::vector<std::uint32_t> corner = corners_of(indices, positions.count, place);
    const std::vector<std::uint32_t> vertex = vertices(positions, corner, X, reading);
    // glTF 2.0, 3.7.4: a mirroring transform turns the order of the vertices round.
    const bool mirrored = X.A.determinant() < 0.0;
    for (std::uint64_t i = 0; i < triangles; ++i) {
      std::array<std::uint64_t, 3> at{3 * i, 3 * i + 1, 3 * i + 2};
      if (mode == kStrip) at = {i, i + 1 + i % 2, i + 2 - i % 2};
      if (mode == kFan) at = {i + 1, i + 2, 0};
      Triangle t{vertex[corner[at[0]]], vertex[corner[at[1]]], vertex[corner[at[2]]]};
      if (mirrored) std::swap(t[1], t[2]);
      reading.builder.add_triangle(t);
    }
  }

  static std::vector<std::uint32_t> corners_of(const Column& indices, std::uint64_t vertices,
                                               const std::string& place) {
    std::vector<std::uint32_t> corner(indices.count);
    for (std::uint64_t i = 0; i < indices.count; ++i) {
      corner[i] = indices.at == nullptr ? static_cast<std::uint32_t>(i) : indices.index(i);
      if (corner[i] >= vertices)
        throw MeshFault(place + ": index " + std::to_string(i) + " is " + std::to_string(corner[i]) +
                        ", which is out of range: there are " + std::to_string(vertices) +
                        " vertices, counted from 0");
    }
    return corner;
  }

  /// Numbers in the object, by vertex of the file. Vertices that no corner names have none: primitives share lists.
  static std::vector<std::uint32_t> vertices(const Column& positions,
                                             const std::vector<std::uint32_t>& corner, const Affine& X,
                                             Reading& reading) {
    std::vector<std::uint8_t> used(positions.count, 0);
    for (const std::uint32_t c : corner) used[c] = 1;
    const auto place = [&](const MeshBuilder::Single& p_N) -> Vec3 { return X * shortest_decimals(p_N); };
    std::vector<std::uint32_t> numbers(positions.count, 0);
    for (std::uint64_t i = 0; i < positions.count; ++i) {
      if (used[i] == 0) continue;
      const MeshBuilder::Single p_N = positions.position(i);
      if (!place(p_N).allFinite()) {
        std::ostringstream text;
        text << "object '" << reading.object << "', vertex " << i << ": the position (" << p_N[0] << ", "
             << p_N[1] << ", " << p_N[2] << ") or its place in the scene is not finite";
        throw MeshFault(text.str());
      }
      numbers[i] = reading.builder.vertex(reading.builder.position(p_N, place));
    }
    return numbers;
  }

  Column column(std::uint64_t index, bool of_positions, const std::string& from) const {
    const Json& accessor = item("accessors", index, from);
    const std::string place = named("accessors", index);
    const std::uint64_t type = number(accessor, "componentType", place);
    const Json* shape = member(accessor, "type");
    const bool fits = of_positions ? type == kFloat : type == kByte || type == kShort || type == kInt;
    if (!fits || shape == nullptr || *shape != (of_positions ? "VEC3" : "SCALAR"))
      throw MeshFault(place + ": positions are VEC3 of 5126 (float), indices SCALAR of 5121, 5123 or 5125");
    if (accessor.contains("sparse"))
      throw MeshFault(place +
                      ": sparse accessors are not supported; Blender writes none (File > Export > glTF)");
    if (!accessor.contains("bufferView"))
      throw MeshFault(place +
                      " has no bufferView; compressed meshes are not supported; in Blender, switch "
                      "Compression off in the panel Data of the export");
    const std::uint64_t view = number(accessor, "bufferView", place);
    const std::uint64_t offset = number_or(accessor, "byteOffset", place, 0);
    const std::uint64_t size = of_positions ? 12 : type == kByte ? 1 : type == kShort ? 2 : 4;
    const auto [bytes, given_stride] = read_view(view, place);
    Column found{nullptr, number(accessor, "count", place), given_stride == 0 ? size : given_stride, type};
    if (found.count == 0) throw MeshFault(place + ": its count is 0");
    if (found.stride < size || offset + found.stride * (found.count - 1) + size > bytes.size())
      throw MeshFault(place + ": " + std::to_string(found.count) + " items of " + std::to_string(size) +
                      " bytes from byte " + std::to_string(offset) + " on, " + std::to_string(found.stride) +
                      " bytes apart, do not fit into the " + std::to_string(bytes.size()) + " bytes of " +
                      named("bufferViews", view));
    found.at = bytes.data() + offset;
    return found;
  }

  /// Its bytes and its stride.
  std::pair<std::string_view, std::uint64_t> read_view(std::uint64_t index, const std::string& from) const {
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
    return {binary_.substr(offset, length), stride};
  }

  const std::string content_;
  Json document_;
  std::string_view binary_;
  GlbNodes found_;
  std::vector<bool> seen_;  ///< by node
};

GlbFile::GlbFile(std::string content) : content_(std::make_unique<Content>(std::move(content))) {}
GlbFile::~GlbFile() = default;
const GlbNodes& GlbFile::nodes() const {
  return content_->nodes();
}
std::vector<NamedMesh> GlbFile::objects(const std::string& node) const {
  return content_->objects(node);
}

}  // namespace takt
