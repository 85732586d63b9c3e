#include "idl/transport/fastdds/stale_shm.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <ctime>
#include <string>
#include <string_view>
#include <vector>

namespace takt {
namespace {

constexpr std::string_view kPrefix = "fastrtps_", kPortPrefix = "fastrtps_port";
constexpr std::string_view kExclusive = "_el", kShared = "_sl";

/// The lock file, with its lock; or not.
class TakenLock {
 public:
  explicit TakenLock(const std::string& file) : fd_(open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW)) {
    taken_ = fd_ >= 0 && flock(fd_, LOCK_EX | LOCK_NB) == 0;
    missing_ = fd_ < 0 && errno == ENOENT;
  }
  ~TakenLock() {
    if (fd_ >= 0) close(fd_);
  }
  TakenLock(const TakenLock&) = delete;
  TakenLock& operator=(const TakenLock&) = delete;
  bool taken() const { return taken_; }
  bool missing() const { return missing_; }

 private:
  int fd_;
  bool taken_ = false, missing_ = false;
};

double age_s(const std::string& file) {
  struct stat status {};
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  if (lstat(file.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return -1.0;
  return static_cast<double>(now.tv_sec - status.st_mtim.tv_sec);
}

}  // namespace

std::size_t remove_stale_shared_memory(const std::filesystem::path& directory, double older_than_s) {
  std::vector<std::string> names;
  std::error_code error;
  for (auto entry = std::filesystem::directory_iterator(directory, error);
       !error && entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (name.starts_with(kPrefix) && name.ends_with(kExclusive))
      names.push_back(name.substr(0, name.size() - kExclusive.size()));
  }
  std::size_t removed = 0;
  const auto remove = [&](const std::string& name) {
    removed += unlink((directory / name).c_str()) == 0 ? 1U : 0U;
  };
  for (const std::string& name : names) {
    const std::string file = (directory / name).string();
    if (age_s(file + std::string(kExclusive)) < older_than_s) continue;
    const TakenLock owner(file + std::string(kExclusive));
    if (!owner.taken()) continue;
    const bool port = name.starts_with(kPortPrefix);
    // Other processes may still write to the port of a dead one.
    const TakenLock writers(file + std::string(kShared));
    if (port && !writers.taken() && !writers.missing()) continue;
    remove(name);
    if (port) {
      remove(name + std::string(kShared));
      remove("sem." + name + "_mutex");
    }
    remove(name + std::string(kExclusive));
  }
  return removed;
}

}  // namespace takt
