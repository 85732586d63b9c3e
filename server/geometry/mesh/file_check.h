#pragma once
// What must hold of a mesh file before it is given to assimp, which reads over some faults (a coordinate
// `nan`, a face out of range in GLB) and reports others without their place. Text only: no file is opened
// here.
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace takt {

enum class MeshFormat { obj, stl, glb };

/// The first fault of the file's content with its place (line or triangle), or an empty string. Checks what
/// assimp does not: numbers that are numbers and fit single precision, face indices in range, facets and
/// files that are complete.
std::string find_mesh_file_fault(MeshFormat format, std::string_view content);

/// An OBJ file without fault as vertices, faces of vertex numbers, objects and groups alone: all of it that
/// was checked. assimp takes any line for a face that begins with an f, and reads normals and texture
/// coordinates that are not there.
std::string geometry_of_obj(std::string_view content);
/// The same of an STL file: solids and corners. Normals and colours are left out.
std::string geometry_of_stl(std::string_view content);

/// The number at `offset`, as binary STL and GLB write it (little-endian, as takt's machines are). The
/// content goes that far.
std::uint32_t mesh_file_u32(std::string_view content, std::size_t offset);

}  // namespace takt
