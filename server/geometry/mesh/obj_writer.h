#pragma once
// Triangle meshes as the text of an OBJ file.
#include <string>
#include <vector>

#include "server/geometry/mesh/builder.h"

namespace takt {

/// Each mesh as an object of its name, with nine significant digits.
std::string obj_text(const std::vector<NamedMesh>& objects);

}  // namespace takt
