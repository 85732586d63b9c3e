#pragma once
// A directory of its own for one test, gone at its end.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "server/geometry/mesh/triangle_mesh.h"

namespace takt::test {

class TemporaryDirectory {
 public:
  TemporaryDirectory() {
    std::string name = (std::filesystem::temp_directory_path() /
                        ("takt_test_" + std::to_string(::getpid()) + "_" + std::string(6, 'X')))
                           .string();
    if (::mkdtemp(name.data()) == nullptr) ADD_FAILURE() << "cannot create " << name;
    path_ = name;
  }
  ~TemporaryDirectory() {
    std::error_code error;
    std::filesystem::remove_all(path_, error);
  }
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

  void write(const std::string& name, const std::string& text) const { std::ofstream(path_ / name) << text; }

 private:
  std::filesystem::path path_;
};

/// One object of an OBJ file; `first` counts the vertices written before it.
inline std::string obj_text(const std::string& object, const TriangleMesh& mesh, std::size_t first = 0) {
  std::string text = "o " + object + "\n";
  for (const Vec3& v : mesh.vertices)
    text += "v " + std::to_string(v.x()) + " " + std::to_string(v.y()) + " " + std::to_string(v.z()) + "\n";
  for (const auto& t : mesh.triangles) {
    text += "f";
    for (const std::uint32_t v : t) text += " " + std::to_string(v + 1 + first);
    text += "\n";
  }
  return text;
}

}  // namespace takt::test
