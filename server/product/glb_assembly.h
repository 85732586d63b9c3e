#pragma once
// Reads an assembly from a glTF file (GLB, or .gltf and its buffers) into a product: its nodes, names, places, colours and materials.
#include <filesystem>
#include <map>
#include <string>

#include "server/product/product.h"

namespace takt::product {

/// One instance for each node with faces of its own; nodes that show one mesh, or equal ones under one name, share a body,
/// mirrored and stretched ones by their stretch. Lengths are in m, and y, which points up in the file, becomes z (upright()). Faces are found in the
/// meshes (find_faces), mass properties are those of the meshes. `densities` as in material_of(). A mesh that bounds no
/// solid is left out, with the node and the reason in a note. Throws MeshError for an unusable file, and one without a
/// closed mesh. The same file gives the same product.
Product read_glb_assembly(const std::filesystem::path& file,
                          const std::map<std::string, double>& densities = {});

}  // namespace takt::product
