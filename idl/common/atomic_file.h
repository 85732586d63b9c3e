#pragma once
// Atomic replacement of a file: readers, and a crash of the machine, see either the old or the new content.
#include <filesystem>
#include <initializer_list>
#include <string_view>
#include <system_error>

namespace takt {

/// Writes the pieces in sequence to a temporary file beside `file` (with a name unique among processes), then
/// fsync, rename, fsync of the directory. Mode 0644. After an error `file` is unchanged and the temporary
/// file is removed. If several processes replace one file, the last one wins.
[[nodiscard]] std::error_code replace_file(const std::filesystem::path& file,
                                           std::initializer_list<std::string_view> pieces);

}  // namespace takt
