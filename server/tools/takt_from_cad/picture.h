#pragma once
// The exploded view of a product as a PNG.
#include <filesystem>

#include "server/product/exploded_view.h"

namespace takt {

/// Parts in their colours, those without in colours by body, with a line from each one to its place in the product. Throws
/// std::runtime_error when the file cannot be written.
void draw_exploded(const product::Product& product, const product::Explosion& explosion,
                   const std::filesystem::path& png);

}  // namespace takt
