#include "idl/common/atomic_file.h"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <string>

namespace takt {
namespace {

bool write_all(int descriptor, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

}  // namespace

std::error_code replace_file(const std::filesystem::path& file,
                             std::initializer_list<std::string_view> pieces) {
  const auto last_error = [] { return std::error_code(errno, std::generic_category()); };
  std::string temporary = file.string() + "." + std::string(6, 'X');
  const int descriptor = ::mkostemp(temporary.data(), O_CLOEXEC);
  if (descriptor < 0) return last_error();
  bool done = ::fchmod(descriptor, 0644) == 0;
  for (const std::string_view piece : pieces) done = done && write_all(descriptor, piece);
  std::error_code error = done && ::fsync(descriptor) == 0 ? std::error_code() : last_error();
  if (::close(descriptor) != 0 && !error) error = last_error();
  if (!error && ::rename(temporary.c_str(), file.c_str()) != 0) error = last_error();
  if (error) {
    ::unlink(temporary.c_str());
    return error;
  }
  // Writes the new name to the disk too.
  const std::string directory = file.has_parent_path() ? file.parent_path().string() : ".";
  const int folder = ::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder >= 0) static_cast<void>(::fsync(folder)), static_cast<void>(::close(folder));
  return {};
}

}  // namespace takt
