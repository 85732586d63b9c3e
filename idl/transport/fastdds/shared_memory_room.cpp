#include "idl/transport/fastdds/shared_memory_room.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <set>
#include <string>

namespace takt {
namespace {

bool reserve(const std::string& file) {
  const int fd = open(file.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW);
  if (fd < 0) return true;  // unlinked, or of another user
  struct stat status {};
  const bool reserved =
      fstat(fd, &status) != 0 || status.st_size == 0 || posix_fallocate(fd, 0, status.st_size) == 0;
  close(fd);
  return reserved;
}

}  // namespace

bool reserve_shared_memory(const std::filesystem::path& directory) {
  const std::string prefix = directory.string() + "/";
  std::set<std::string> files;
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) {
    const std::size_t place = line.find(prefix);
    if (place == std::string::npos || line.ends_with(" (deleted)")) continue;
    if (line.find("fastrtps_", place) != std::string::npos) files.insert(line.substr(place));
  }
  bool all = true;
  for (const std::string& file : files) all = reserve(file) && all;
  return all;
}

}  // namespace takt
