#pragma once
// A file that others see as it was or as it is to be, never in between, whenever the machine stops.
#include <filesystem>
#include <initializer_list>
#include <string_view>
#include <system_error>

namespace takt {

/// Writes the pieces, one after the other, to a temporary file beside `file` (of a name that no other process uses),
/// then fsync, rename, fsync of the directory. Mode 0644. On an error `file` is as it was and the temporary one is gone.
/// Several processes may replace one file: the last one wins.
[[nodiscard]] std::error_code replace_file(const std::filesystem::path& file,
                                           std::initializer_list<std::string_view> pieces);

}  // namespace takt
