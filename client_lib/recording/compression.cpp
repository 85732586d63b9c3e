#include "client_lib/recording/compression.h"

#include <lz4frame.h>
#include <zstd.h>

#include <memory>

namespace takt::recording {
namespace {

constexpr int kZstdLevel = 1;  // a cell at 1 kHz costs the recorder a few percent of one core

[[noreturn]] void damaged() {
  throw RecordingError("a chunk is damaged");
}

struct FreeLz4 {
  void operator()(LZ4F_dctx* context) const { LZ4F_freeDecompressionContext(context); }
};

void decompress_lz4(std::string_view packed, std::string& bytes) {
  LZ4F_dctx* made = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION)) != 0)
    throw RecordingError("lz4 cannot decompress: there is no memory.");
  const std::unique_ptr<LZ4F_dctx, FreeLz4> context(made);
  std::size_t read = 0, written = 0;
  for (;;) {
    std::size_t taken = packed.size() - read, given = bytes.size() - written;
    const std::size_t left =
        LZ4F_decompress(context.get(), bytes.data() + written, &given, packed.data() + read, &taken, nullptr);
    if (LZ4F_isError(left) != 0) damaged();
    read += taken;
    written += given;
    if (left == 0) break;                     // the frame is whole
    if (taken == 0 && given == 0) damaged();  // it is not, or it holds more than was said
  }
  if (read != packed.size() || written != bytes.size()) damaged();
}

}  // namespace

std::string_view mcap_name(Compression compression) {
  switch (compression) {
    case Compression::lz4:
      return "lz4";
    case Compression::zstd:
      return "zstd";
    case Compression::none:
      break;
  }
  return "";
}

std::optional<Compression> compression_named(std::string_view name) {
  if (name == "none") return Compression::none;
  for (const Compression compression : {Compression::lz4, Compression::zstd})
    if (name == mcap_name(compression)) return compression;
  return std::nullopt;
}

void compress(Compression compression, std::string_view bytes, std::string& packed) {
  if (compression == Compression::zstd) {
    packed.resize(ZSTD_compressBound(bytes.size()));
    const std::size_t size =
        ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), kZstdLevel);
    if (ZSTD_isError(size) != 0)
      throw RecordingError("zstd cannot compress a chunk: " + std::string(ZSTD_getErrorName(size)) + ".");
    packed.resize(size);
  } else if (compression == Compression::lz4) {
    LZ4F_preferences_t preferences{};
    preferences.frameInfo.contentSize = bytes.size();
    packed.resize(LZ4F_compressFrameBound(bytes.size(), &preferences));
    const std::size_t size =
        LZ4F_compressFrame(packed.data(), packed.size(), bytes.data(), bytes.size(), &preferences);
    if (LZ4F_isError(size) != 0)
      throw RecordingError("lz4 cannot compress a chunk: " + std::string(LZ4F_getErrorName(size)) + ".");
    packed.resize(size);
  } else {
    packed.assign(bytes);
  }
}

std::string decompress(std::string_view method, std::string_view packed, std::size_t size) {
  if (method.empty()) {
    if (packed.size() != size) damaged();
    return std::string(packed);
  }
  std::string bytes(size, '\0');
  if (method == "zstd") {
    const std::size_t got = ZSTD_decompress(bytes.data(), bytes.size(), packed.data(), packed.size());
    if (ZSTD_isError(got) != 0 || got != size) damaged();
  } else if (method == "lz4") {
    decompress_lz4(packed, bytes);
  } else {
    throw RecordingError("its chunks are compressed by '" + std::string(method) +
                         "'; takt reads zstd, lz4 and what is not compressed ('mcap compress' converts it)");
  }
  return bytes;
}

}  // namespace takt::recording
