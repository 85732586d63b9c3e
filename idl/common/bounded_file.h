#pragma once
// Files of others, read as a whole up to a size: a sparse file of a terabyte, a device without an end and a damaged one
// must not take all memory.
#include <cstddef>
#include <filesystem>
#include <string>

namespace takt {

struct FileText {
  std::string text;
  /// What is wrong, to follow the name of the file: "it has more than 16 MB". Empty if nothing is.
  std::string problem;
};

/// A pipe is read up to its end.
FileText read_bounded_file(const std::filesystem::path& file, std::size_t most_MB);

}  // namespace takt
