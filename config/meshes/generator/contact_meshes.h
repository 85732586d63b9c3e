#pragma once
// The meshes of the small contact scenes (config/scenarios/contact), with their dimensions.
#include <filesystem>

namespace takt::meshes {

/// The committed ones.
void make_contact_meshes(const std::filesystem::path& directory);

/// The same bolt, socket, peg and hole with 100 000 triangles each: too large to be committed.
void make_large_contact_meshes(const std::filesystem::path& directory);

}  // namespace takt::meshes
