#pragma once
// How chunks of a recording are compressed, by the names that MCAP gives them: zstd and lz4 (as an LZ4 frame;
// larger files than with zstd, written and read with less work), or not at all.
#include <optional>
#include <string>
#include <string_view>

#include "client_lib/recording/message_types.h"

namespace takt::recording {

enum class Compression { none, lz4, zstd };

/// As in the file: "" for none.
std::string_view mcap_name(Compression compression);
/// As on the command line: none, lz4, zstd. Nothing for another name.
std::optional<Compression> compression_named(std::string_view name);

/// Makes `packed` of `bytes`. Throws RecordingError.
void compress(Compression compression, std::string_view bytes, std::string& packed);
/// The bytes that were `size` before, of a chunk compressed by the method of that name in the file. Throws
/// RecordingError for damaged ones and for a method that is not known.
std::string decompress(std::string_view mcap_name, std::string_view packed, std::size_t size);

}  // namespace takt::recording
