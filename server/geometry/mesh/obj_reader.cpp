#include "server/geometry/mesh/obj_reader.h"

#include <charconv>
#include <cstddef>
#include <cstdint>
#include <string>
#include <system_error>

#include "idl/common/text.h"
#include "server/geometry/mesh/line_reader.h"
#include "server/geometry/mesh/polygon.h"

namespace takt {
namespace {

class ObjReader {
 public:
  explicit ObjReader(std::string_view content) : content_(content) {}

  std::vector<NamedMesh> read() {
    read_vertices();
    read_faces();
    if (positions_.empty() && content_.find('\0') != content_.npos)
      throw MeshFault("there are zero bytes in it, as in UTF-16; an OBJ file is plain text (UTF-8)");
    if (positions_.empty()) throw MeshFault("there are no vertices (lines starting with v)");
    std::vector<NamedMesh> objects = builder_.take_objects();
    if (objects.empty()) throw MeshFault("there are no faces (lines starting with f)");
    if (passed_over_ > 0)
      objects.front().findings.push_back(
          {MeshDiagnosticKind::no_faces, MeshSeverity::info, passed_over_, 0.0, Vec3::Zero(),
           counted(passed_over_, "statement draws", "statements draw") +
               " lines or points (l, p), which bound nothing, the first in line " +
               std::to_string(first_passed_over_) + " of the file",
           std::string(remedy_of(MeshDiagnosticKind::no_faces))});
    return objects;
  }

 private:
  void read_vertices() {
    for (LineReader reader(content_, true); reader.next();) {
      if (reader.word != "v") continue;
      const std::vector<double>& x = reader.coordinates(positions_.size() + 1);
      const double weight = x.size() == 4 ? x[3] : 1.0;
      if (weight == 0.0)
        reader.fail("the weight of vertex " + std::to_string(positions_.size() + 1) + " is 0");
      positions_.push_back(builder_.position(Vec3(x[0], x[1], x[2]) / weight));
    }
  }

  void read_faces() {
    std::string name;
    for (LineReader reader(content_, true); reader.next();) {
      if (reader.word == "v") ++defined_;
      if (reader.word == "f") read_face(reader);
      if (reader.word == "l" || reader.word == "p") {
        if (passed_over_++ == 0) first_passed_over_ = reader.line;
      }
      if ((reader.word == "o" || reader.word == "g") && reader.arguments != name)
        builder_.begin_object(name = reader.arguments);
    }
  }

  void read_face(LineReader& reader) {
    const std::vector<std::string_view>& words = reader.words();
    if (words.size() < 3)
      reader.fail("a face needs three vertices or more, found " + std::to_string(words.size()));
    if (words.size() > kMaxPolygonCorners)
      reader.fail("a face has " + std::to_string(words.size()) + " corners; allowed are " +
                  std::to_string(kMaxPolygonCorners));
    places_.clear();
    numbers_.clear();
    for (std::size_t i = 0; i < words.size(); ++i) {
      const std::uint32_t position = positions_[vertex_index(reader, i, words[i])];
      places_.push_back(builder_.place(position));
      numbers_.push_back(builder_.vertex(position));
    }
    triangles_.clear();
    cut_polygon(places_, triangles_);
    for (const auto& t : triangles_) builder_.add_triangle({numbers_[t[0]], numbers_[t[1]], numbers_[t[2]]});
  }

  /// Index of a corner VERTEX/TEXTURE/NORMAL, by its first number: from 1 through the file, or backwards from
  /// this line if it is negative.
  std::size_t vertex_index(const LineReader& reader, std::size_t corner, std::string_view word) const {
    const std::string_view number = word.substr(0, word.find('/'));
    const auto total = static_cast<std::int64_t>(positions_.size());
    std::int64_t index = 0;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), index);
    const std::string subject = "vertex " + std::to_string(corner + 1) + " of the face: ";
    if (error != std::errc() || end != number.data() + number.size())
      reader.fail(subject + quoted(word) + " is not an index");
    if (index == 0 || index > total || index < -defined_)
      reader.fail(subject + "index " + std::to_string(index) + " is out of range, the file has " +
                  std::to_string(total) + " vertices, counted from 1");
    return static_cast<std::size_t>(index > 0 ? index - 1 : defined_ + index);
  }

  std::string_view content_;
  MeshBuilder builder_;
  std::vector<std::uint32_t> positions_;                 ///< by vertex of the file
  std::int64_t defined_ = 0;                             ///< vertices above the present line
  std::size_t passed_over_ = 0, first_passed_over_ = 0;  ///< lines and points: their number, line of the file
  // Of the present face:
  std::vector<Vec3> places_;
  std::vector<std::uint32_t> numbers_;
  std::vector<TriangleMesh::Triangle> triangles_;
};

}  // namespace

std::vector<NamedMesh> read_obj(std::string_view content) {
  return ObjReader(content).read();
}

}  // namespace takt
