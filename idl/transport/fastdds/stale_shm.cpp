#include "idl/transport/fastdds/stale_shm.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <ctime>
#include <fstream>
#include <set>
#include <string>
#include <string_view>
#include <utility>
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

bool is_own(const std::filesystem::path& file) {
  struct stat status {};
  return lstat(file.c_str(), &status) == 0 && status.st_uid == geteuid();
}

bool is_port(std::string_view name) {
  if (!name.starts_with(kPortPrefix) || name.size() == kPortPrefix.size()) return false;
  name.remove_prefix(kPortPrefix.size());
  return std::all_of(name.begin(), name.end(), [](char c) { return c >= '0' && c <= '9'; });
}

/// Files of `directory` that a process of this user has mapped.
std::set<std::string> mapped_files(const std::filesystem::path& directory) {
  std::set<std::string> mapped;
  std::error_code error;
  for (auto process = std::filesystem::directory_iterator("/proc", error);
       !error && process != std::filesystem::directory_iterator(); process.increment(error)) {
    const std::string id = process->path().filename().string();
    if (id.find_first_not_of("0123456789") != std::string::npos) continue;
    std::ifstream maps(process->path() / "maps");
    for (std::string line; std::getline(maps, line);) {
      const auto path = line.find('/');
      if (path == std::string::npos) continue;
      const std::filesystem::path file(line.substr(path));
      if (file.parent_path() == directory) mapped.insert(file.filename().string());
    }
  }
  return mapped;
}

std::size_t remove_files(const std::filesystem::path& directory, const std::vector<std::string>& names) {
  std::size_t removed = 0;
  for (const std::string& name : names) removed += unlink((directory / name).c_str()) == 0 ? 1U : 0U;
  return removed;
}

/// Other files of a port than its exclusive lock.
std::vector<std::string> files_of_port(const std::string& name) {
  return {name, name + std::string(kShared), "sem." + name + "_mutex"};
}

/// Ports that their reader has left, and that a writer was killed with: they have no lock. Removed are those that no process
/// has mapped. Other users' files stay, as their processes hide their mappings.
std::size_t remove_left_ports(const std::filesystem::path& directory, std::set<std::string> left) {
  std::erase_if(left, [&](const std::string& name) {
    const TakenLock readers((directory / (name + std::string(kShared))).string());
    return !is_own(directory / name) || (!readers.taken() && !readers.missing());
  });
  if (left.empty()) return 0;  // the usual case: mappings of all processes are costly to read
  std::error_code error;
  const auto mapped = mapped_files(std::filesystem::canonical(directory, error));
  std::size_t removed = 0;
  for (const std::string& name : left)
    if (!mapped.contains(name)) removed += remove_files(directory, files_of_port(name));
  return removed;
}

}  // namespace

std::size_t remove_stale_shared_memory(const std::filesystem::path& directory, double older_than_s) {
  std::vector<std::string> names;
  std::set<std::string> left;
  std::error_code error;
  for (auto entry = std::filesystem::directory_iterator(directory, error);
       !error && entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (name.starts_with(kPrefix) && name.ends_with(kExclusive))
      names.push_back(name.substr(0, name.size() - kExclusive.size()));
    else if (is_port(name) && age_s(entry->path().string()) >= older_than_s)
      left.insert(name);
  }
  for (const std::string& name : names) left.erase(name);
  std::size_t removed = remove_left_ports(directory, std::move(left));
  for (const std::string& name : names) {
    const std::string file = (directory / name).string();
    if (age_s(file + std::string(kExclusive)) < older_than_s) continue;
    const TakenLock owner(file + std::string(kExclusive));
    if (!owner.taken()) continue;
    const bool port = name.starts_with(kPortPrefix);
    // Other processes may still write to the port of a dead one.
    const TakenLock writers(file + std::string(kShared));
    if (port && !writers.taken() && !writers.missing()) continue;
    removed += remove_files(directory, port ? files_of_port(name) : std::vector{name});
    removed += remove_files(directory, {name + std::string(kExclusive)});
  }
  return removed;
}

}  // namespace takt
