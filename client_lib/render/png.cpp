#include <png.h>

#include <stdexcept>

#include "client_lib/render/renderer.h"

namespace takt::render {

namespace {

png_image header_of(const Image& image) {
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(image.width);
  header.height = static_cast<png_uint_32>(image.height);
  header.format = PNG_FORMAT_RGB;
  return header;
}

}  // namespace

void write_png(const Image& image, const std::string& file) {
  png_image header = header_of(image);
  if (png_image_write_to_file(&header, file.c_str(), 0, image.rgb.data(), 0, nullptr) == 0) {
    throw std::runtime_error(file + ": cannot write the picture: " + header.message);
  }
}

std::string png_bytes(const Image& image) {
  png_image header = header_of(image);
  std::string bytes(PNG_IMAGE_PNG_SIZE_MAX(header), '\0');
  png_alloc_size_t size = bytes.size();
  if (png_image_write_to_memory(&header, bytes.data(), &size, 0, image.rgb.data(), 0, nullptr) == 0)
    throw std::runtime_error(std::string("cannot make the picture: ") + header.message);
  bytes.resize(size);
  return bytes;
}

void render(const Scene& scene, const Camera& camera, const std::string& png_file) {
  write_png(rasterise(scene, camera), png_file);
}

}  // namespace takt::render
