#include "config/meshes/generator/write_meshes.h"

#include <fstream>
#include <stdexcept>

namespace takt::meshes {

void write_solids(const std::filesystem::path& directory, const std::string& name, const std::string& what,
                  const std::vector<Solid>& solids) {
  const std::filesystem::path file = directory / (name + ".obj");
  std::ofstream out(file, std::ios::binary);
  write_obj(out, {"Made by: takt-make-meshes. Metres, z up.", what}, solids);
  out.close();
  if (!out) throw std::runtime_error("cannot write " + file.string());
}

}  // namespace takt::meshes
