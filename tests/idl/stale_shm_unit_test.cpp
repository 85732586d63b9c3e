// Stale files in shared memory: those whose lock is free.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <unistd.h>

#include <fstream>
#include <set>

#include "idl/transport/fastdds/stale_shm.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

class HeldLock {
 public:
  HeldLock(const std::filesystem::path& file, int kind) : fd_(open(file.c_str(), O_RDONLY | O_CLOEXEC)) {
    EXPECT_EQ(flock(fd_, kind | LOCK_NB), 0);
  }
  ~HeldLock() { close(fd_); }
  HeldLock(const HeldLock&) = delete;
  HeldLock& operator=(const HeldLock&) = delete;

 private:
  int fd_;
};

TEST(StaleSharedMemory, OnlyFilesWithoutAnOwnerAreRemoved) {
  const test::TemporaryDirectory directory;
  const auto make = [&](const std::string& name) { std::ofstream(directory / name) << "x"; };
  const auto names = [&] {
    std::set<std::string> all;
    for (const auto& entry : std::filesystem::directory_iterator(directory / ""))
      all.insert(entry.path().filename().string());
    return all;
  };
  for (const char* name :
       {"fastrtps_dead", "fastrtps_dead_el", "fastrtps_alive", "fastrtps_alive_el", "fastrtps_port7411",
        "fastrtps_port7411_el", "sem.fastrtps_port7411_mutex", "fastrtps_port7413", "fastrtps_port7413_el",
        "sem.fastrtps_port7413_mutex", "fastrtps_port7400", "fastrtps_port7400_el", "fastrtps_port7400_sl",
        "other_el", "fastrtps_without_lock"})
    make(name);
  const HeldLock owner(directory / "fastrtps_alive_el", LOCK_EX);
  const HeldLock port(directory / "fastrtps_port7413_el", LOCK_EX);
  const HeldLock writer(directory / "fastrtps_port7400_sl", LOCK_SH);
  EXPECT_EQ(remove_stale_shared_memory(directory / "", 60.0), 0U) << "all are new";
  EXPECT_EQ(remove_stale_shared_memory(directory / "", 0.0), 5U);
  EXPECT_EQ(names(), (std::set<std::string>{"fastrtps_alive", "fastrtps_alive_el", "fastrtps_port7413",
                                            "fastrtps_port7413_el", "sem.fastrtps_port7413_mutex",
                                            "fastrtps_port7400", "fastrtps_port7400_el",
                                            "fastrtps_port7400_sl", "other_el", "fastrtps_without_lock"}));
  EXPECT_EQ(remove_stale_shared_memory(directory / "nowhere", 0.0), 0U);
}

TEST(StaleSharedMemory, APortThatItsReaderHasLeftStaysWhileAProcessHasItMapped) {
  const test::TemporaryDirectory directory;
  for (const char* name : {"fastrtps_port7411", "sem.fastrtps_port7411_mutex", "fastrtps_port7413",
                           "sem.fastrtps_port7413_mutex", "fastrtps_portal"})
    std::ofstream(directory / name) << "x";
  const int file = open((directory / "fastrtps_port7413").c_str(), O_RDONLY | O_CLOEXEC);
  void* mapped = mmap(nullptr, 1, PROT_READ, MAP_SHARED, file, 0);
  close(file);
  ASSERT_NE(mapped, MAP_FAILED);
  EXPECT_EQ(remove_stale_shared_memory(directory / "", 60.0), 0U) << "all are new";
  const std::size_t removed = remove_stale_shared_memory(directory / "", 0.0);
  munmap(mapped, 1);
  EXPECT_EQ(removed, 2U);
  EXPECT_TRUE(std::filesystem::exists(directory / "fastrtps_port7413"));
  EXPECT_TRUE(std::filesystem::exists(directory / "fastrtps_portal"));
  EXPECT_EQ(remove_stale_shared_memory(directory / "", 0.0), 2U);
  EXPECT_FALSE(std::filesystem::exists(directory / "fastrtps_port7413"));
}

}  // namespace
}  // namespace takt
