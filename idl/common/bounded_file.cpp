#include "idl/common/bounded_file.h"

#include <algorithm>
#include <fstream>

namespace takt {

FileText read_bounded_file(const std::filesystem::path& file, std::size_t most_MB) {
  const std::size_t most_bytes = most_MB << 20U;
  const std::string too_large = "it has more than " + std::to_string(most_MB) + " MB";
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (status.type() == std::filesystem::file_type::not_found) return {{}, "there is no such file"};
  if (std::filesystem::is_directory(status)) return {{}, "it is a directory"};
  std::size_t step = std::size_t{1} << 16U;
  if (std::filesystem::is_regular_file(status)) {
    const std::uintmax_t size = std::filesystem::file_size(file, error);
    if (!error && size > most_bytes) return {{}, too_large};
    if (!error) step = static_cast<std::size_t>(size) + 1;
  }
  std::ifstream in(file, std::ios::binary);
  FileText result;
  while (in && result.text.size() <= most_bytes) {
    const std::size_t before = result.text.size();
    result.text.resize(before + step);
    in.read(result.text.data() + before, static_cast<std::streamsize>(step));
    result.text.resize(before + static_cast<std::size_t>(std::max<std::streamsize>(in.gcount(), 0)));
    step = std::size_t{1} << 20U;
  }
  if (!in.is_open() || in.bad()) return {{}, "it cannot be read"};
  if (result.text.size() > most_bytes) return {{}, too_large};
  return result;
}

}  // namespace takt
