#pragma once
// Draws a Scene in software: no window, no graphics card, the same picture on every machine.
//
// Triangles go through a z-buffer. Their visible pixels are lit by one sun-like light with a shadow map and by a soft
// light from the sky. Anti-aliasing averages several pictures that are shifted by fractions of a
// pixel.
#include <cstdint>
#include <string>
#include <vector>

#include "client_lib/render/scene.h"

namespace takt::render {

/// Eight bits each of red, green, blue per pixel, rows from the top.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

/// Throws std::invalid_argument with the fault for an invalid camera (no pixels, eye at target, view angle outside
/// 0..pi) and for a mesh with the index of a missing vertex.
Image rasterise(const Scene& scene, const Camera& camera);

/// Throws std::runtime_error with the file and the reason when it cannot be written.
void write_png(const Image& image, const std::string& file);

/// The bytes of such a file. Throws std::runtime_error with the reason when there is no memory for them.
std::string png_bytes(const Image& image);

/// rasterise() and write_png().
void render(const Scene& scene, const Camera& camera, const std::string& png_file);

}  // namespace takt::render
