#pragma once
// glTF in several files (a description and its buffers) as one GLB file.
#include <cstddef>
#include <filesystem>
#include <string>

namespace takt::product {

/// The GLB file with the description of `file` and the content of its buffers: files of the same folder or below it, or
/// base64 in the description. Pictures stay where they are. Throws MeshFault, with the place, for a description that is
/// missing or no JSON, and for a buffer that is missing, lies elsewhere or is shorter than it says. Description and buffers
/// have at most `most_MB`. Source: glTF 2.0, sections 3.6.1 (buffers) and 4.4 (GLB).
std::string glb_of_gltf(const std::filesystem::path& file, std::size_t most_MB = 1024);

}  // namespace takt::product
