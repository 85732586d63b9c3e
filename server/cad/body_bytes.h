#pragma once
// A body as bytes, from one process to another of the same program.
#include <string>
#include <vector>

#include "server/product/product.h"

namespace takt::cad {

/// Mesh, faces, mass properties and deflection, and sentences; name, material and colour are not in it.
std::string bytes_of(const product::Body& body, const std::vector<std::string>& notes);
/// Puts them into `body` and behind `notes`.
void take_bytes(const std::string& bytes, product::Body& body, std::vector<std::string>& notes);

}  // namespace takt::cad
