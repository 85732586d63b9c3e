// Room in shared memory: pages of mapped files of Fast DDS.
#include "idl/transport/fastdds/shared_memory_room.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

constexpr std::size_t kSize_bytes = 1U << 20U;

/// A sparse file that this process has mapped.
class Mapped {
 public:
  explicit Mapped(const std::filesystem::path& file)
      : fd_(open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600)) {
    EXPECT_EQ(ftruncate(fd_, kSize_bytes), 0);
    memory_ = mmap(nullptr, kSize_bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd_, 0);
    EXPECT_NE(memory_, MAP_FAILED);
  }
  ~Mapped() {
    munmap(memory_, kSize_bytes);
    close(fd_);
  }
  Mapped(const Mapped&) = delete;
  Mapped& operator=(const Mapped&) = delete;
  std::size_t allocated_bytes() const {
    struct stat status {};
    fstat(fd_, &status);
    return static_cast<std::size_t>(status.st_blocks) * 512;
  }

 private:
  int fd_;
  void* memory_;
};

TEST(SharedMemoryRoom, PagesOfMappedFilesOfFastDdsAreReserved) {
  const test::TemporaryDirectory directory;
  const Mapped segment(directory / "fastrtps_0123"), other(directory / "other");
  ASSERT_LT(segment.allocated_bytes(), kSize_bytes);
  EXPECT_TRUE(reserve_shared_memory(directory.path()));
  EXPECT_GE(segment.allocated_bytes(), kSize_bytes);
  EXPECT_LT(other.allocated_bytes(), kSize_bytes);
}

TEST(SharedMemoryRoom, AnUnlinkedFileIsNoFailure) {
  const test::TemporaryDirectory directory;
  const Mapped segment(directory / "fastrtps_0123");
  std::filesystem::remove(directory / "fastrtps_0123");
  EXPECT_TRUE(reserve_shared_memory(directory.path()));
}

}  // namespace
}  // namespace takt
