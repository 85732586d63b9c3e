#include "server/geometry/mesh/glb_check.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
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
constexpr std::uint64_t kSignedByte = 5120, kByte = 5121, kSignedShort = 5122, kShort = 5123, kInt = 5125,
                        kFloat = 5126;
constexpr std::uint64_t kTriangles = 4, kFan = 6;  // 5: strip

/// Little-endian.
std::uint32_t u32_at(std::string_view content, std::size_t offset) {
  std::uint32_t value = 0;
  std::memcpy(&value, content.data() + offset, sizeof(value));
  return value;
}
void put_u32(std::string& bytes, std::size_t value) {
  const auto number = static_cast<std::uint32_t>(value);
  char raw[sizeof(number)];
  std::memcpy(raw, &number, sizeof(number));
  bytes.append(raw, sizeof(raw));
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

}  // namespace

/// The chunks of a file, and the nodes of its scene.
class GlbDescription {
 public:
  explicit GlbDescription(std::string content) : content_(std::move(content)) {
    split();
    read_nodes();
  }

  const GlbNodes& nodes() const { return found_; }
  std::string_view binary() const { return binary_; }
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

 private:
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

  void read_nodes() {
    for (const char* list :
         {"nodes", "meshes", "accessors", "bufferViews", "buffers", "scenes", "materials"}) {
      const Json* items = member(document_, list);
      if (items != nullptr && !items->is_array()) throw MeshFault(std::string(list) + " is no list");
    }
    seen_.assign(count("nodes"), false);
    const Json& scene = item("scenes", number_or(document_, "scene", "the file", 0), "the file");
    for (const std::uint64_t node : references(scene, "nodes", "the scene")) read_node(node, "the scene");
  }

 public:
  GlbMaterial material_of(std::uint64_t mesh) const {
    const Json* primitives = member(item("meshes", mesh, "a node"), "primitives");
    if (primitives == nullptr || !primitives->is_array()) return {};
    const std::string place = named("meshes", mesh);
    for (const Json& primitive : *primitives) {
      if (number_or(primitive, "mode", place, kTriangles) < kTriangles || !primitive.contains("material"))
        continue;
      const std::uint64_t index = number(primitive, "material", place);
      const Json& material = item("materials", index, place);
      GlbMaterial result{name_of(material), {}};
      const Json* metallic = member(material, "pbrMetallicRoughness");
      if (metallic == nullptr) return result;
      const std::vector<double> linear =
          numbers(*metallic, "baseColorFactor", 4, named("materials", index), {1.0, 1.0, 1.0, 1.0});
      std::array<float, 4>& colour = result.colour.emplace();
      for (std::size_t k = 0; k < 4; ++k) {
        const double c = std::clamp(linear[k], 0.0, 1.0);
        // IEC 61966-2-1; alpha is linear in both.
        const double curved = c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1.0 / 2.4) - 0.055;
        colour[k] = static_cast<float>(k == 3 ? c : curved);
      }
      return result;
    }
    return {};
  }

 private:
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
      if (const Json* extensions = member(node, "extensions");
          extensions != nullptr && member(*extensions, "EXT_mesh_gpu_instancing") != nullptr)
        throw MeshFault(place + ": EXT_mesh_gpu_instancing is not supported; a node for each use is allowed");
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

  /// As far as its description says; read_meshes() checks it.
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

  std::string content_;
  Json document_;
  std::string_view binary_;  ///< in content_
  GlbNodes found_;
  std::vector<bool> seen_;  ///< by node
};

namespace {

/// Checks the meshes of some nodes, and keeps what assimp needs of them.
class MeshSelection {
 public:
  explicit MeshSelection(const GlbDescription& file) : file_(file) {}

  void read_meshes(CheckedGlb& glb) {
    Json nodes = Json::array(), roots = Json::array();
    std::uint64_t triangles = 0, positions = 0;
    for (std::size_t i = glb.first; i < glb.last; ++i) {
      const GlbNode& node = file_.nodes()[i];
      if (!node.mesh) continue;
      const std::string place = named("nodes", node.number);
      const Mesh& mesh = read_mesh(*node.mesh, place);
      triangles += mesh.triangles, positions += mesh.positions;
      check_shown(triangles, kMaxGlbTriangles, "triangles", place);
      check_shown(positions, kMaxGlbPositions, "positions", place);
      if (!mesh.kept) continue;
      roots.push_back(nodes.size());
      nodes.push_back({{"name", std::to_string(i)}, {"mesh", *mesh.kept}});
    }
    const Json result{{"asset", {{"version", "2.0"}}},
                      {"scene", 0},
                      {"scenes", {{{"nodes", roots}}}},
                      {"nodes", nodes},
                      {"meshes", meshes_},
                      {"accessors", accessors_},
                      {"bufferViews", views_},
                      {"buffers", {{{"byteLength", data_.size()}}}}};
    if (!nodes.empty()) glb.bytes = glb_bytes(result.dump(), data_);
    glb.passed_over = passed_over_;
    glb.first_passed_over = first_passed_over_;
  }

 private:
  struct Mesh {
    std::uint64_t triangles = 0, positions = 0;
    std::optional<std::size_t> kept;  ///< its number in the result; none without faces
  };
  struct Accessor {
    std::size_t kept = 0;  ///< its number in the result
    std::uint64_t count = 0, size = 0, stride = 0;
    std::uint64_t offset = 0;  ///< in the file's data
  };

  static void check_shown(std::uint64_t number, std::uint64_t most, const char* kind,
                          const std::string& place) {
    if (number > most)
      throw MeshFault("with " + place + " there are more than " + std::to_string(most) + " " + kind +
                      " to be seen");
  }

  const Mesh& read_mesh(std::uint64_t index, const std::string& from) {
    const auto [known, is_new] = mesh_of_.try_emplace(index);
    Mesh& result = known->second;
    if (!is_new) return result;
    const Json& mesh = file_.item("meshes", index, from);
    const std::string place = named("meshes", index);
    const Json* primitives = member(mesh, "primitives");
    if (primitives == nullptr || !primitives->is_array() || primitives->empty())
      throw MeshFault(place + " has no primitives");
    Json kept = Json::array();
    for (std::size_t p = 0; p < primitives->size(); ++p) {
      const std::string primitive_place = place + ".primitives[" + std::to_string(p) + "]";
      if (number_or((*primitives)[p], "mode", primitive_place, kTriangles) < kTriangles) {
        if (passed_over_++ == 0) first_passed_over_ = primitive_place;
        continue;
      }
      kept.push_back(primitive((*primitives)[p], primitive_place, result));
    }
    if (!kept.empty()) {
      result.kept = meshes_.size();
      meshes_.push_back({{"primitives", kept}});
    }
    return result;
  }

  Json primitive(const Json& source, const std::string& place, Mesh& mesh) {
    const std::uint64_t mode = number_or(source, "mode", place, kTriangles);
    if (mode > kFan) throw MeshFault(place + ": the mode " + std::to_string(mode) + " is unknown");
    const Json* attributes = member(source, "attributes");
    if (attributes == nullptr) throw MeshFault(place + " has no attributes");
    const Accessor positions = read_accessor(number(*attributes, "POSITION", place), Use::positions, place);
    std::uint64_t corners = positions.count;
    Json kept{{"attributes", {{"POSITION", positions.kept}}}, {"mode", mode}};
    if (source.contains("indices")) {
      const Accessor indices = read_accessor(number(source, "indices", place), Use::indices, place);
      corners = indices.count;
      check_indices(indices, positions.count, place);
      kept["indices"] = indices.kept;
    }
    // assimp 5.2.5 counts the triangles of a strip or fan as corners - 2 without a sign.
    if (mode > kTriangles && corners < 3)
      throw MeshFault(place + " has " + std::to_string(corners) + " corners; a strip or fan has 3 or more");
    mesh.triangles += mode == kTriangles ? corners / 3 : corners;
    mesh.positions += positions.count;
    return kept;
  }

  enum class Use : std::uint8_t { positions, indices };

  Accessor read_accessor(std::uint64_t index, Use use, const std::string& from) {
    const Json& accessor = file_.item("accessors", index, from);
    const std::string place = named("accessors", index);
    const std::uint64_t type = number(accessor, "componentType", place);
    const Json* given = member(accessor, "type");
    const bool of_positions = use == Use::positions;
    const bool known_type =
        type == kByte || type == kShort ||
        (of_positions ? type == kFloat || type == kSignedByte || type == kSignedShort : type == kInt);
    if (!known_type || given == nullptr || *given != (of_positions ? "VEC3" : "SCALAR"))
      throw MeshFault(place + ": found type " + (given == nullptr ? "(missing)" : given->dump()) +
                      " of componentType " + std::to_string(type) +
                      "; allowed: positions as VEC3 of 5126 (float), 5120 to 5123 (KHR_mesh_quantization), "
                      "indices as SCALAR of 5121, 5123 or 5125");
    if (accessor.contains("sparse")) throw MeshFault(place + ": sparse accessors are not supported");
    if (!accessor.contains("bufferView"))
      throw MeshFault(place + " has no bufferView; compressed meshes are not supported");
    const std::uint64_t view = number(accessor, "bufferView", place);
    const std::uint64_t offset = number_or(accessor, "byteOffset", place, 0);
    const std::uint64_t items = number(accessor, "count", place);
    const std::uint64_t size = (of_positions ? 3 : 1) * bytes_of(type);
    const View bytes = read_view(view, place);
    const std::uint64_t stride = bytes.stride == 0 ? size : bytes.stride;
    if (items == 0) throw MeshFault(place + ": its count is 0");
    if (stride < size || offset + stride * (items - 1) + size > bytes.length)
      throw MeshFault(place + ": " + std::to_string(items) + " items of " + std::to_string(size) +
                      " bytes from byte " + std::to_string(offset) + " on, " + std::to_string(stride) +
                      " bytes apart, do not fit into the " + std::to_string(bytes.length) + " bytes of " +
                      named("bufferViews", view));
    Accessor result{0, items, size, stride, bytes.offset + offset};
    const auto [known, is_new] = accessor_of_.try_emplace(index, accessors_.size());
    result.kept = known->second;
    if (!is_new) return result;
    // Accessors may share their bytes, so that a short file can have any number of items.
    items_ += items;
    if (items_ > 2 * kMaxGlbPositions)
      throw MeshFault("with " + place + " there are more than " + std::to_string(2 * kMaxGlbPositions) +
                      " positions and indices");
    const Json* normalized = member(accessor, "normalized");
    keep(result, type, of_positions, normalized != nullptr && *normalized == true);
    return result;
  }

  static std::uint64_t bytes_of(std::uint64_t type) {
    return type == kByte || type == kSignedByte ? 1 : type == kShort || type == kSignedShort ? 2 : 4;
  }

  /// The items of one accessor become a view of their own, without gaps, as assimp 5.2.5 wants the last one to be as long as
  /// the stride; positions as floats.
  void keep(const Accessor& accessor, std::uint64_t type, bool positions, bool normalized) {
    const std::size_t begin = data_.size();
    const char* item = file_.binary().data() + accessor.offset;
    for (std::uint64_t i = 0; i < accessor.count; ++i, item += accessor.stride) {
      if (!positions || type == kFloat)
        data_.append(item, accessor.size);
      else
        for (std::size_t k = 0; k < 3; ++k) put_float(component(item + k * bytes_of(type), type, normalized));
    }
    accessors_.push_back({{"bufferView", views_.size()},
                          {"byteOffset", 0},
                          {"componentType", positions ? kFloat : type},
                          {"count", accessor.count},
                          {"type", positions ? "VEC3" : "SCALAR"}});
    views_.push_back({{"buffer", 0}, {"byteOffset", begin}, {"byteLength", data_.size() - begin}});
    data_.resize((data_.size() + 3) / 4 * 4, '\0');
  }

  /// KHR_mesh_quantization; glTF 2.0, 3.11: the values of normalised integers.
  static float component(const char* at, std::uint64_t type, bool normalized) {
    const auto read = [at](auto value) {
      std::memcpy(&value, at, sizeof(value));
      return static_cast<float>(value);
    };
    const bool is_signed = type == kSignedByte || type == kSignedShort;
    const float value = type == kByte         ? read(std::uint8_t{})
                        : type == kSignedByte ? read(std::int8_t{})
                        : type == kShort      ? read(std::uint16_t{})
                                              : read(std::int16_t{});
    if (!normalized) return value;
    const float most = static_cast<float>((1U << (8 * bytes_of(type) - (is_signed ? 1U : 0U))) - 1U);
    return std::max(value / most, -1.0F);
  }

  void put_float(float value) {
    char raw[sizeof(value)];
    std::memcpy(raw, &value, sizeof(value));
    data_.append(raw, sizeof(raw));
  }

  struct View {
    std::uint64_t offset = 0, length = 0, stride = 0;  ///< stride 0: none is given
  };
  View read_view(std::uint64_t index, const std::string& from) const {
    const Json& view = file_.item("bufferViews", index, from);
    const std::string place = named("bufferViews", index);
    const std::uint64_t buffer = number(view, "buffer", place);
    const Json& of = file_.item("buffers", buffer, place);
    if (buffer != 0 || of.contains("uri"))
      throw MeshFault(place + ": " + named("buffers", buffer) + " does not lie in this file, which it must");
    const View result{number_or(view, "byteOffset", place, 0), number(view, "byteLength", place),
                      number_or(view, "byteStride", place, 0)};
    if (result.offset + result.length > file_.binary().size())
      throw MeshFault(place + ": " + std::to_string(result.length) + " bytes from byte " +
                      std::to_string(result.offset) + " on do not fit into the " +
                      std::to_string(file_.binary().size()) + " bytes of the file's data");
    if (result.stride > 252) throw MeshFault(place + ": its byteStride must be at most 252");
    return result;
  }

  void check_indices(const Accessor& indices, std::uint64_t vertices, const std::string& place) const {
    std::uint64_t at = indices.offset;
    for (std::uint64_t i = 0; i < indices.count; ++i, at += indices.stride) {
      std::uint32_t index = 0;
      std::memcpy(&index, file_.binary().data() + at, indices.size);  // little endian, as the file
      if (index >= vertices)
        throw MeshFault(place + ": index " + std::to_string(i) + " is " + std::to_string(index) +
                        ", which is out of range: there are " + std::to_string(vertices) +
                        " vertices, counted from 0");
    }
  }

  const GlbDescription& file_;
  // What is kept, and its numbers by those in the file.
  Json meshes_ = Json::array(), accessors_ = Json::array(), views_ = Json::array();
  std::string data_;
  std::map<std::uint64_t, Mesh> mesh_of_;
  std::map<std::uint64_t, std::size_t> accessor_of_;
  std::uint64_t items_ = 0;      ///< of all accessors that are kept
  std::size_t passed_over_ = 0;  ///< primitives of lines and points
  std::string first_passed_over_;
};

}  // namespace

std::string glb_bytes(std::string json, const std::string& data) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  std::string bytes = "glTF";
  put_u32(bytes, 2);
  put_u32(bytes, kGlbHeader + 2 * kChunkHeader + json.size() + data.size());
  put_u32(bytes, json.size());
  put_u32(bytes, kJsonChunk);
  bytes += json;
  put_u32(bytes, data.size());
  put_u32(bytes, kBinaryChunk);
  return bytes + data;
}

GlbDocument::GlbDocument(std::string content)
    : description_(std::make_unique<const GlbDescription>(std::move(content))) {}
GlbDocument::~GlbDocument() = default;

const GlbNodes& GlbDocument::nodes() const {
  return description_->nodes();
}

GlbMaterial GlbDocument::material_of(std::uint64_t mesh) const {
  return description_->material_of(mesh);
}

CheckedGlb GlbDocument::checked_alone(std::size_t node) const {
  CheckedGlb result;
  result.first = node;
  result.last = node + 1;
  MeshSelection(*description_).read_meshes(result);
  return result;
}

CheckedGlb GlbDocument::checked(const std::string& node) const {
  CheckedGlb result;
  result.last = nodes().size();
  if (!node.empty()) std::tie(result.first, result.last) = find_glb_node(nodes(), node);
  MeshSelection(*description_).read_meshes(result);
  return result;
}

}  // namespace takt
