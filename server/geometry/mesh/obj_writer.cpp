#include "server/geometry/mesh/obj_writer.h"

#include "idl/common/text.h"

namespace takt {

std::string obj_text(const std::vector<NamedMesh>& objects) {
  std::string text;
  std::size_t first = 1;
  for (const NamedMesh& object : objects) {
    text += "o " + object.name + "\n";
    for (const Vec3& v : object.mesh.vertices)
      text += "v " + number_text(v.x(), 9) + " " + number_text(v.y(), 9) + " " + number_text(v.z(), 9) + "\n";
    for (const TriangleMesh::Triangle& t : object.mesh.triangles)
      text += "f " + std::to_string(first + t[0]) + " " + std::to_string(first + t[1]) + " " +
              std::to_string(first + t[2]) + "\n";
    first += object.mesh.vertices.size();
  }
  return text;
}

}  // namespace takt
