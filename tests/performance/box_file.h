#pragma once
// Boxes as mesh files.
#include <filesystem>
#include <fstream>

#include "plant_models/spatial.h"

namespace takt::bench {

/// An OBJ file with a box between two corners, of twelve triangles.
inline void write_box(const std::filesystem::path& file, const Vec3& lower, const Vec3& upper) {
  std::ofstream out(file);
  out << "o " << file.stem().string() << "\n";
  for (const double z : {lower.z(), upper.z()})
    for (const double y : {lower.y(), upper.y()})
      for (const double x : {lower.x(), upper.x()}) out << "v " << x << " " << y << " " << z << "\n";
  constexpr int kSides[6][4] = {{1, 3, 4, 2}, {5, 6, 8, 7}, {1, 2, 6, 5},
                                {3, 7, 8, 4}, {1, 5, 7, 3}, {2, 4, 8, 6}};
  for (const auto& s : kSides) {
    out << "f " << s[0] << " " << s[1] << " " << s[2] << "\n";
    out << "f " << s[0] << " " << s[2] << " " << s[3] << "\n";
  }
}

}  // namespace takt::bench
