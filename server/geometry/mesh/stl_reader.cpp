#include "server/geometry/mesh/stl_reader.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>

#include "server/geometry/mesh/line_reader.h"

namespace takt {
namespace {

constexpr std::size_t kHeader = 84, kFacet = 50;  // bytes of binary STL

std::vector<NamedMesh> read_binary(std::string_view content) {
  const std::size_t facets = (content.size() - kHeader) / kFacet;
  if (facets == 0) throw MeshFault("there are no triangles");
  MeshBuilder builder;
  for (std::size_t i = 0; i < facets; ++i) {
    std::array<MeshBuilder::Single, 3> corners{};  // behind the normal
    std::memcpy(corners.data(), content.data() + kHeader + kFacet * i + 12, sizeof(corners));
    TriangleMesh::Triangle t{};
    for (std::size_t k = 0; k < 3; ++k) {
      const MeshBuilder::Single& p = corners[k];
      for (std::size_t j = 0; j < 3; ++j)
        if (!std::isfinite(p[j]))
          throw MeshFault("triangle " + std::to_string(i) + ", corner " + std::to_string(k) +
                          ": coordinate " + std::to_string(j + 1) + " is not finite");
      t[k] = builder.vertex(builder.position(p, shortest_decimals));
    }
    builder.add_triangle(t);
  }
  return builder.take_objects();
}

std::vector<NamedMesh> read_text(std::string_view content) {
  MeshBuilder builder;
  LineReader reader(content, false);
  TriangleMesh::Triangle corners{};
  std::size_t count = 0, facets = 0;
  bool in_solid = false, in_facet = false;
  while (reader.next()) {
    const std::string_view word = reader.word;
    if (word == "solid") {
      if (!in_solid) builder.begin_object(std::string(reader.arguments));
      in_solid = true;
    } else if (word == "endsolid") {
      if (in_facet) reader.fail("endsolid inside a facet, endfacet is missing");
      in_solid = false;
    } else if (word == "facet") {
      if (!in_solid || in_facet) reader.fail("facet in the wrong place");
      in_facet = true;
      count = 0;
      ++facets;
    } else if (word == "vertex") {
      if (!in_facet) reader.fail("vertex outside a facet");
      const std::vector<double>& x = reader.coordinates();
      const std::uint32_t vertex = builder.vertex(builder.position(Vec3(x[0], x[1], x[2])));
      if (count < 3) corners[count] = vertex;
      ++count;
    } else if (word == "endfacet") {
      if (count != 3) reader.fail("a facet needs exactly three vertices, found " + std::to_string(count));
      builder.add_triangle(corners);
      in_facet = false;
    } else if (word != "outer" && word != "endloop") {
      reader.fail("unknown word " + quoted(word) + " in a text STL file");
    }
  }
  if (in_facet || in_solid)
    throw MeshFault("the file ends at line " + std::to_string(reader.line) + " inside " +
                    (in_facet ? "facet " + std::to_string(facets) : "a solid, endsolid is missing") +
                    ": it is truncated");
  if (facets == 0) throw MeshFault("there are no facets");
  return builder.take_objects();
}

}  // namespace

std::vector<NamedMesh> read_stl(std::string_view content) {
  std::uint32_t facets = 0;
  if (content.size() >= kHeader) std::memcpy(&facets, content.data() + 80, sizeof(facets));
  const std::size_t announced = kHeader + kFacet * facets;
  if (content.size() == announced) return read_binary(content);
  const std::size_t begin = content.find_first_not_of(" \t\r\n");
  if (begin != content.npos && content.substr(begin).starts_with("solid")) return read_text(content);
  if (content.size() < kHeader)
    throw MeshFault("a binary STL file has a header of 84 bytes, this file has " +
                    std::to_string(content.size()) + " bytes; a text STL file starts with the word solid");
  throw MeshFault("the header announces " + std::to_string(facets) + " triangles, that is " +
                  std::to_string(announced) + " bytes, but the file has " + std::to_string(content.size()) +
                  " bytes: it is truncated or has extra data");
}

}  // namespace takt
