#include "config/meshes/generator/mesh_families.h"

#include <array>
#include <string>

#include "config/meshes/generator/screw_meshes.h"
#include "config/meshes/generator/shapes.h"
#include "config/meshes/generator/write_meshes.h"

namespace takt::meshes {

namespace {

struct ScrewLevel {
  double size;                    ///< of elements, relative to those of ScrewParameters
  int bolt_columns, nut_columns;  ///< multiples of 12
};

constexpr std::array<ScrewLevel, 3> kScrewLevels{{{1.4, 60, 72}, {1.0, 84, 96}, {0.7, 120, 132}}};

}  // namespace

void make_mesh_families(const std::filesystem::path& directory) {
  std::filesystem::create_directories(directory);
  for (int level = 3; level <= 6; ++level) {
    const std::string name = "sphere_" + std::to_string(level);
    write_solids(directory, name, "Radius 25 mm, corners on the sphere. Origin: its centre.",
                 {make_icosphere(name, 0.025, level)});
  }
  for (std::size_t i = 0; i < kScrewLevels.size(); ++i) {
    ScrewParameters screw;
    screw.contact_edge *= kScrewLevels[i].size;
    screw.bolt_columns = kScrewLevels[i].bolt_columns;
    screw.nut_columns = kScrewLevels[i].nut_columns;
    const std::string level = std::to_string(i + 1);
    write_solids(directory, "bolt_" + level, "Hexagon bolt with an ISO metric thread.", {make_bolt(screw)});
    write_solids(directory, "nut_" + level, "Hexagon nut with an ISO metric thread.", {make_nut(screw)});
  }
}

}  // namespace takt::meshes
