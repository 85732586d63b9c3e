// Room for the stacks of DDS threads, under a limit on the address space.
#include "idl/transport/fastdds/thread_room.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

namespace takt {
namespace {

TEST(ThreadRoom, ThereIsRoomWithoutALimit) {
  EXPECT_EQ(lack_of_thread_room(), "");
}

TEST(ThreadRoom, ALimitThatIsTooLowIsReportedWithTheRemedy) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto limited = [] {
    // What this process has already stays; of more there is a megabyte.
    std::size_t pages = 0;
    std::FILE* file = std::fopen("/proc/self/statm", "r");
    if (file == nullptr || std::fscanf(file, "%zu", &pages) != 1) std::exit(2);
    const rlim_t bytes = pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE)) + (1U << 20U);
    const rlimit limit{bytes, bytes};
    if (setrlimit(RLIMIT_AS, &limit) != 0) std::exit(3);
    std::fprintf(stderr, "%s\n", lack_of_thread_room().c_str());
    std::exit(0);
  };
  EXPECT_EXIT(limited(), testing::ExitedWithCode(0), "MB of address space.*ulimit -v");
}

}  // namespace
}  // namespace takt
