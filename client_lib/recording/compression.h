#pragma once
// Compression of the chunks of a recording, with the names of MCAP: zstd, lz4 (an LZ4 frame) or none. lz4 makes larger
// files than zstd with less processor time.
#include <optional>
#include <string>
#include <string_view>

#include "client_lib/recording/message_types.h"

namespace takt::recording {

enum class Compression { none, lz4, zstd };

/// As in the file: "" for none.
std::string_view mcap_name(Compression compression);
/// As on the command line: none, lz4, zstd. Empty for another name.
std::optional<Compression> compression_named(std::string_view name);

/// Compresses `bytes` into `packed`. Throws RecordingError.
void compress(Compression compression, std::string_view bytes, std::string& packed);
/// The `size` bytes of a chunk that is compressed by the method of that name in the file. Throws RecordingError for a
/// damaged chunk and for an unknown method.
std::string decompress(std::string_view mcap_name, std::string_view packed, std::size_t size);

}  // namespace takt::recording
