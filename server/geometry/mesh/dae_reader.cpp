#include "server/geometry/mesh/dae_reader.h"

#include <tinyxml2.h>

#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numbers>
#include <string>

#include "server/geometry/mesh/polygon.h"

namespace takt {
namespace {

using tinyxml2::XMLElement;
using Affine = Eigen::Matrix4d;

constexpr int kDeepestNode = 100;
constexpr std::size_t kMostNodes = 1'000'000;  ///< instances count
constexpr std::size_t kMostCorners = 60'000'000;
constexpr std::size_t kMostPositions = 20'000'000;  ///< with those of each instance

class DaeReader {
 public:
  explicit DaeReader(std::string_view content) {
    if (document_.Parse(content.data(), content.size()) != tinyxml2::XML_SUCCESS)
      throw MeshFault("line " + std::to_string(document_.ErrorLineNum()) + ": this is not well-formed XML");
    root_ = document_.RootElement();
    if (root_ == nullptr || std::string_view(root_->Name()) != "COLLADA")
      throw MeshFault("the root element is not <COLLADA>");
  }

  std::vector<NamedMesh> read() {
    collect(*root_);
    Affine unit = Affine::Identity();
    unit.topLeftCorner<3, 3>() *= metres();
    const XMLElement* scene = root_->FirstChildElement("scene");
    if (scene != nullptr) scene = scene->FirstChildElement("instance_visual_scene");
    if (scene != nullptr) {
      for_each(find(*scene, "visual_scene"), "node",
               [&](const XMLElement& node) { add_node(node, unit, 0); });
    } else if (const XMLElement* library = root_->FirstChildElement("library_geometries")) {
      for_each(*library, "geometry", [&](const XMLElement& geometry) { add_geometry(geometry, unit); });
    }
    std::vector<NamedMesh> objects = builder_.take_objects();
    if (objects.empty()) throw MeshFault("there are no faces in it");
    return objects;
  }

 private:
  [[noreturn]] static void fail(const XMLElement& element, const std::string& reason) {
    throw MeshFault("line " + std::to_string(element.GetLineNum()) + ": <" + element.Name() + ">: " + reason);
  }
  static std::string_view text(const char* text) { return text != nullptr ? text : ""; }

  template <class Function>
  static void for_each(const XMLElement& parent, const char* name, Function function) {
    for (const XMLElement* e = parent.FirstChildElement(name); e != nullptr; e = e->NextSiblingElement(name))
      function(*e);
  }

  void collect(const XMLElement& element) {
    if (const char* id = element.Attribute("id")) by_id_.emplace(id, &element);
    for_each(element, nullptr, [&](const XMLElement& child) { collect(child); });
  }

  /// The element that `url` or `source` names.
  const XMLElement& find(const XMLElement& element, std::string_view kind) const {
    std::string_view name = text(element.Attribute("url"));
    if (name.empty()) name = text(element.Attribute("source"));
    const auto found = name.starts_with('#') ? by_id_.find(name.substr(1)) : by_id_.end();
    if (found == by_id_.end() || found->second->Name() != kind)
      fail(element, "found '" + std::string(name) + "'; allowed: # and the id of a <" + std::string(kind) +
                        "> of the file");
    return *found->second;
  }

  /// Calls `take(number)` for each number between white space.
  template <class Number, class Function>
  static void for_numbers(const XMLElement& element, Function take) {
    const std::string_view all = text(element.GetText());
    const char *at = all.data(), *end = at + all.size();
    for (;;) {
      while (at != end && (*at == ' ' || *at == '\t' || *at == '\n' || *at == '\r')) ++at;
      if (at == end) return;
      Number number{};
      const auto [next, error] = std::from_chars(*at == '+' ? at + 1 : at, end, number);
      const bool apart = next == end || *next == ' ' || *next == '\t' || *next == '\n' || *next == '\r';
      if (error != std::errc() || !apart)
        fail(element, "found '" +
                          std::string(at, std::min<std::size_t>(20, static_cast<std::size_t>(end - at))) +
                          "'; allowed: numbers between white space");
      if constexpr (std::is_floating_point_v<Number>)
        if (!std::isfinite(static_cast<float>(number))) fail(element, "found a number that is not finite");
      take(number);
      at = next;
    }
  }

  template <std::size_t N>
  static std::array<double, N> values(const XMLElement& element) {
    std::array<double, N> result{};
    std::size_t count = 0;
    for_numbers<double>(element, [&](double x) {
      if (count < N) result[count] = x;
      ++count;
    });
    if (count != N)
      fail(element, "found " + std::to_string(count) + " numbers; allowed: " + std::to_string(N));
    return result;
  }

  double metres() const {
    const XMLElement* asset = root_->FirstChildElement("asset");
    const XMLElement* unit = asset != nullptr ? asset->FirstChildElement("unit") : nullptr;
    if (unit == nullptr || unit->Attribute("meter") == nullptr) return 1.0;
    double metres = 0.0;
    const std::string_view value = text(unit->Attribute("meter"));
    const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), metres);
    if (error != std::errc() || end != value.data() + value.size() || !(metres > 0.0) ||
        !std::isfinite(metres))
      fail(*unit, "meter: found '" + std::string(value) + "'; allowed: a number > 0");
    return metres;
  }

  static Affine transform(const XMLElement& element) {
    Affine X = Affine::Identity();
    const std::string_view kind = element.Name();
    if (kind == "matrix") {
      const auto m = values<16>(element);
      for (int i = 0; i < 16; ++i) X(i / 4, i % 4) = m[static_cast<std::size_t>(i)];
    } else if (kind == "translate") {
      const auto t = values<3>(element);
      X.topRightCorner<3, 1>() = Vec3(t[0], t[1], t[2]);
    } else if (kind == "scale") {
      const auto s = values<3>(element);
      X.diagonal().head<3>() = Vec3(s[0], s[1], s[2]);
    } else if (kind == "rotate") {
      const auto r = values<4>(element);
      const Vec3 axis(r[0], r[1], r[2]);
      if (axis.norm() > 0.0)
        X.topLeftCorner<3, 3>() =
            Eigen::AngleAxisd(r[3] * std::numbers::pi / 180.0, axis.normalized()).toRotationMatrix();
    } else if (kind == "lookat" || kind == "skew") {
      fail(element, "this transformation is not supported; allowed: matrix, translate, rotate, scale");
    }
    return X;
  }

  void add_node(const XMLElement& node, Affine X, int depth) {
    if (depth > kDeepestNode || ++nodes_ > kMostNodes)
      fail(node, "nodes are nested in themselves, or deeper than " + std::to_string(kDeepestNode));
    for_each(node, nullptr, [&](const XMLElement& child) { X = X * transform(child); });
    for_each(node, "instance_geometry",
             [&](const XMLElement& instance) { add_geometry(find(instance, "geometry"), X); });
    for_each(node, "instance_controller", [&](const XMLElement& instance) {
      const XMLElement* skin = find(instance, "controller").FirstChildElement("skin");
      if (skin != nullptr) add_geometry(find(*skin, "geometry"), X);
    });
    for_each(node, "instance_node",
             [&](const XMLElement& instance) { add_node(find(instance, "node"), X, depth + 1); });
    for_each(node, "node", [&](const XMLElement& child) { add_node(child, X, depth + 1); });
  }

  void add_geometry(const XMLElement& geometry, const Affine& X) {
    const XMLElement* mesh = geometry.FirstChildElement("mesh");
    if (mesh == nullptr) mesh = geometry.FirstChildElement("convex_mesh");
    if (mesh == nullptr) return;  // splines bound nothing
    if (mesh->Attribute("convex_hull_of") != nullptr)
      fail(*mesh, "convex_hull_of is not supported; export the triangles of the hull");
    std::string name(text(geometry.Attribute("name")));
    if (name.empty()) name = text(geometry.Attribute("id"));
    builder_.begin_object(name);
    builder_.forget_positions();
    numbers_.clear();
    mirrored_ = X.topLeftCorner<3, 3>().determinant() < 0.0;
    for (const char* kind : {"triangles", "polylist", "polygons", "tristrips", "trifans"})
      for_each(*mesh, kind, [&](const XMLElement& faces) { add_faces(faces, X); });
  }

  /// Those of the last array are kept, as many instances of one geometry often follow each other.
  const std::vector<double>& values_of(const XMLElement& array) {
    if (array_ == &array) return array_values_;
    array_ = nullptr, array_values_.clear();
    for_numbers<double>(array, [&](double value) { array_values_.push_back(value); });
    array_ = &array;
    return array_values_;
  }

  /// The places of the corners, and the stride and offset of their indices.
  struct Corners {
    std::vector<std::uint32_t> positions;  ///< by index, in the builder
    std::size_t stride = 1, offset = 0;
  };

  Corners corners_of(const XMLElement& faces, const Affine& X) {
    Corners result;
    const XMLElement* vertices = nullptr;
    for_each(faces, "input", [&](const XMLElement& input) {
      const auto offset = static_cast<std::size_t>(input.UnsignedAttribute("offset", 0));
      if (offset > 64) fail(input, "offset: found " + std::to_string(offset) + "; allowed: 0 to 64");
      result.stride = std::max(result.stride, offset + 1);
      if (text(input.Attribute("semantic")) == "VERTEX") vertices = &input, result.offset = offset;
    });
    if (vertices == nullptr) fail(faces, "found no <input> with the semantic VERTEX");
    const XMLElement* position = nullptr;
    for_each(find(*vertices, "vertices"), "input", [&](const XMLElement& input) {
      if (text(input.Attribute("semantic")) == "POSITION") position = &input;
    });
    if (position == nullptr) fail(*vertices, "its <vertices> have no <input> with the semantic POSITION");
    const XMLElement& source = find(*position, "source");
    const auto known = numbers_.find(&source);
    if (known != numbers_.end()) {
      result.positions = known->second;
      return result;
    }
    const XMLElement* array = source.FirstChildElement("float_array");
    if (array == nullptr) fail(source, "found no <float_array>");
    const std::vector<double>& x = values_of(*array);
    const XMLElement* accessor = source.FirstChildElement("technique_common");
    if (accessor != nullptr) accessor = accessor->FirstChildElement("accessor");
    const std::size_t stride = accessor != nullptr ? accessor->UnsignedAttribute("stride", 1) : 3;
    const std::size_t begin = accessor != nullptr ? accessor->UnsignedAttribute("offset", 0) : 0;
    if (stride < 3 || stride > 64)
      fail(source, "stride: found " + std::to_string(stride) + "; allowed: 3 to 64");
    positions_ += x.size() / 3;
    if (positions_ > kMostPositions)
      fail(*array, "with all instances of geometries the file has more than " +
                       std::to_string(kMostPositions) + " positions");
    for (std::size_t i = begin; i + 3 <= x.size(); i += stride) {
      const Eigen::Vector4d p = X * Eigen::Vector4d(x[i], x[i + 1], x[i + 2], 1.0);
      if (!p.head<3>().cast<float>().allFinite()) fail(*array, "found a position that is not finite");
      result.positions.push_back(builder_.position(Vec3(p.head<3>())));
    }
    numbers_[&source] = result.positions;
    return result;
  }

  void add_faces(const XMLElement& faces, const Affine& X) {
    const Corners corners = corners_of(faces, X);
    const std::string_view kind = faces.Name();
    std::vector<std::size_t> sizes;  // of the polygons of a polylist
    if (const XMLElement* counts = faces.FirstChildElement("vcount"))
      for_numbers<std::uint32_t>(*counts, [&](std::uint32_t count) { sizes.push_back(count); });
    if (kind == "polygons" && faces.FirstChildElement("ph") != nullptr)
      fail(faces, "polygons with holes are not supported; export triangles");
    std::size_t next_size = 0;
    for_each(faces, "p", [&](const XMLElement& p) {
      std::vector<std::uint32_t> indices;
      std::size_t number = 0;
      for_numbers<std::uint32_t>(p, [&](std::uint32_t index) {
        if (number++ % corners.stride == corners.offset) {
          if (index >= corners.positions.size())
            fail(p, "index " + std::to_string(index) + " is out of range; there are " +
                        std::to_string(corners.positions.size()) + " positions");
          indices.push_back(corners.positions[index]);
        }
      });
      corners_ += indices.size();
      if (corners_ > kMostCorners)
        fail(p, "the file has more than " + std::to_string(kMostCorners) + " corners");
      add_primitive(p, kind, indices, sizes, next_size);
    });
  }

  void add_primitive(const XMLElement& p, std::string_view kind, const std::vector<std::uint32_t>& indices,
                     const std::vector<std::size_t>& sizes, std::size_t& next_size) {
    const std::size_t count = indices.size();
    if (kind == "tristrips" || kind == "trifans") {
      for (std::size_t i = 2; i < count; ++i) {
        const bool fan = kind == "trifans", odd = i % 2 == 1;
        const std::uint32_t a = indices[fan ? 0 : i - 2], b = indices[i - 1], c = indices[i];
        odd && !fan ? add_polygon({b, a, c}) : add_polygon({a, b, c});
      }
    } else if (kind == "polylist") {
      for (std::size_t at = 0; at < count; at += sizes[next_size++]) {
        if (next_size >= sizes.size() || sizes[next_size] == 0 || at + sizes[next_size] > count)
          fail(p, "<vcount> does not fit the number of corners");
        check_size(p, sizes[next_size]);
        add_polygon({indices.begin() + static_cast<std::ptrdiff_t>(at),
                     indices.begin() + static_cast<std::ptrdiff_t>(at + sizes[next_size])});
      }
    } else if (kind == "polygons") {
      check_size(p, count);
      add_polygon(indices);
    } else {
      for (std::size_t i = 0; i + 2 < count; i += 3)
        add_polygon({indices[i], indices[i + 1], indices[i + 2]});
    }
  }
  static void check_size(const XMLElement& p, std::size_t size) {
    if (size > kMaxPolygonCorners)
      fail(p, "a face has " + std::to_string(size) + " corners; allowed are " +
                  std::to_string(kMaxPolygonCorners));
  }

  void add_polygon(const std::vector<std::uint32_t>& positions) {
    if (positions.size() < 3) return;  // a line
    std::vector<Vec3> places;
    std::vector<std::uint32_t> vertices;
    for (const std::uint32_t position : positions) {
      places.push_back(builder_.place(position));
      vertices.push_back(builder_.vertex(position));
    }
    std::vector<TriangleMesh::Triangle> triangles;
    cut_polygon(places, triangles);
    for (const auto& [a, b, c] : triangles)
      builder_.add_triangle(mirrored_ ? TriangleMesh::Triangle{vertices[a], vertices[c], vertices[b]}
                                      : TriangleMesh::Triangle{vertices[a], vertices[b], vertices[c]});
  }

  tinyxml2::XMLDocument document_;
  const XMLElement* root_ = nullptr;
  std::map<std::string, const XMLElement*, std::less<>> by_id_;
  MeshBuilder builder_;
  std::map<const XMLElement*, std::vector<std::uint32_t>> numbers_;  ///< of the present geometry, by source
  const XMLElement* array_ = nullptr;                                ///< the last <float_array> that was read
  std::vector<double> array_values_;
  bool mirrored_ = false;
  std::size_t corners_ = 0, positions_ = 0, nodes_ = 0;
};

}  // namespace

std::vector<NamedMesh> read_dae(std::string_view content) {
  return DaeReader(content).read();
}

}  // namespace takt
