// A file is replaced as a whole or not at all.
#include "idl/common/atomic_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

std::string content(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

std::size_t file_count(const std::filesystem::path& directory) {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(directory), {}));
}

TEST(AtomicFile, IsMadeAndReplacedOfItsPieces) {
  const test::TemporaryDirectory directory;
  const auto file = directory / "a.txt";
  EXPECT_FALSE(replace_file(file, {"one ", std::string_view("\0two", 4), "", " three"}));
  EXPECT_EQ(content(file), std::string("one \0two three", 14));
  struct stat status {};
  ASSERT_EQ(::stat(file.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0644U);
  EXPECT_FALSE(replace_file(file, {}));
  EXPECT_EQ(content(file), "");
  EXPECT_EQ(file_count(file.parent_path()), 1U) << "the temporary file stays";
}

TEST(AtomicFile, AFailureLeavesEverythingAsItWas) {
  const test::TemporaryDirectory directory;
  EXPECT_EQ(replace_file(directory / "no" / "a.txt", {"x"}), std::errc::no_such_file_or_directory);
  const auto folder = directory / "folder";
  std::filesystem::create_directory(folder);
  EXPECT_EQ(replace_file(folder, {"x"}), std::errc::is_a_directory);
  EXPECT_EQ(file_count(folder.parent_path()), 1U) << "the temporary file stays";
}

TEST(AtomicFile, AWriteThatFailsHalfWayLeavesTheOldContent) {
  const test::TemporaryDirectory directory;
  directory.write("a.txt", "before");
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{1000, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  const std::error_code error = replace_file(directory / "a.txt", {std::string(5000, 'x')});
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(error, std::errc::file_too_large);
  EXPECT_EQ(content(directory / "a.txt"), "before");
  EXPECT_EQ(file_count(directory.path()), 1U);
}

TEST(AtomicFile, ManyWritersLeaveOneOfTheirs) {
  const test::TemporaryDirectory directory;
  const auto file = directory / "a.txt";
  std::vector<std::thread> writers;
  for (const char letter : {'a', 'b', 'c', 'd'}) {
    writers.emplace_back([&file, letter] {
      for (int i = 0; i < 20; ++i) EXPECT_FALSE(replace_file(file, {std::string(5000, letter)}));
    });
  }
  for (std::thread& writer : writers) writer.join();
  const std::string left = content(file);
  EXPECT_EQ(left, std::string(5000, left.at(0)));
  EXPECT_EQ(file_count(file.parent_path()), 1U);
}

}  // namespace
}  // namespace takt
