#include "server/cad/body_bytes.h"

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <type_traits>

namespace takt::cad {

namespace {

using product::Body;
using product::Face;

class Writer {
 public:
  std::string bytes;
  template <class T>
  requires std::is_arithmetic_v<T> || std::is_enum_v<T>
  void visit(const T& value) {
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    bytes.append(raw, sizeof(T));
  }
  template <class T>
  void list(const std::vector<T>& items) {
    visit(static_cast<std::uint64_t>(items.size()));
  }
};

class Reader {
 public:
  explicit Reader(const std::string& bytes) : bytes_(bytes) {}
  template <class T>
  requires std::is_arithmetic_v<T> || std::is_enum_v<T>
  void visit(T& value) {
    if (bytes_.size() - at_ < sizeof(T)) throw std::runtime_error("the bytes of a body are cut");
    std::memcpy(&value, bytes_.data() + at_, sizeof(T));
    at_ += sizeof(T);
  }
  template <class T>
  void list(std::vector<T>& items) {
    std::uint64_t size = 0;
    visit(size);
    if (size > bytes_.size()) throw std::runtime_error("the bytes of a body are cut");
    items.resize(size);
  }

 private:
  const std::string& bytes_;
  std::size_t at_ = 0;
};

// One list of fields for both ways; `Field` is const for a writer.
template <class Way, class Matrix>
void numbers(Way& way, Matrix& matrix) {
  for (Eigen::Index i = 0; i < matrix.size(); ++i) way.visit(matrix.data()[i]);
}

template <class Way, class F>
void face(Way& way, F& f) {
  way.visit(f.kind), numbers(way, f.point_B), numbers(way, f.axis_B);
  way.visit(f.radius_m), way.visit(f.pitch_m), way.visit(f.concave), way.visit(f.area_m2);
}

template <class Way, class B, class Notes>
void fields(Way& way, B& body, Notes& notes) {
  way.list(body.mesh.vertices);
  for (auto& v : body.mesh.vertices) numbers(way, v);
  way.list(body.mesh.triangles);
  for (auto& t : body.mesh.triangles)
    for (auto& corner : t) way.visit(corner);
  way.list(body.faces);
  for (auto& f : body.faces) face(way, f);
  way.list(body.triangle_faces);
  for (auto& index : body.triangle_faces) way.visit(index);
  way.visit(body.exact.volume), numbers(way, body.exact.p_BBcm), numbers(way, body.exact.G_BBcm_B);
  way.visit(body.deflection_m);
  way.list(notes);
  for (auto& note : notes) {
    std::vector<char> text(note.begin(), note.end());
    way.list(text);
    for (char& c : text) way.visit(c);
    if constexpr (!std::is_const_v<Notes>) note.assign(text.begin(), text.end());
  }
}

}  // namespace

std::string bytes_of(const Body& body, const std::vector<std::string>& notes) {
  Writer writer;
  fields(writer, body, notes);
  return std::move(writer.bytes);
}

void take_bytes(const std::string& bytes, Body& body, std::vector<std::string>& notes) {
  Reader reader(bytes);
  std::vector<std::string> added;
  fields(reader, body, added);
  notes.insert(notes.end(), added.begin(), added.end());
}

}  // namespace takt::cad
