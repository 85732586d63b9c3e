// Programs whose output cannot be written report it and fail, whatever the result of their work.
#include "idl/command_line/output.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <iostream>

namespace takt::command_line {
namespace {

/// Standard output goes elsewhere for as long as this lives.
class RedirectedOutput {
 public:
  explicit RedirectedOutput(int to) : kept_(::dup(STDOUT_FILENO)) {
    std::fflush(stdout);
    ::dup2(to, STDOUT_FILENO);
    ::close(to);
  }
  ~RedirectedOutput() {
    std::clearerr(stdout);
    std::cout.clear();
    ::dup2(kept_, STDOUT_FILENO);
    ::close(kept_);
  }
  RedirectedOutput(const RedirectedOutput&) = delete;
  RedirectedOutput& operator=(const RedirectedOutput&) = delete;

 private:
  int kept_;
};

int code_after_printing(int to, int code) {
  const RedirectedOutput redirected(to);
  std::fputs("a table", stdout);
  return with_output_written("takt-test", code);
}

TEST(CommandLineOutput, OutputThatCannotBeWrittenIsAFailure) {
  const char* sentence = "takt-test: Standard output cannot be written on;";
  for (const auto& [code, expected] : {std::pair{0, 1}, {3, 3}}) {
    testing::internal::CaptureStderr();
    EXPECT_EQ(code_after_printing(::open("/dev/full", O_WRONLY), code), expected);
    EXPECT_EQ(testing::internal::GetCapturedStderr().find(sentence), 0U);
  }
  // An earlier failure that the state of the file does not show.
  testing::internal::CaptureStderr();
  {
    const RedirectedOutput redirected(::open("/dev/null", O_WRONLY));
    std::cout.setstate(std::ios::badbit);
    EXPECT_EQ(with_output_written("takt-test", 0), 1);
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr().find(sentence), 0U);
}

TEST(CommandLineOutput, WrittenOutputKeepsTheExitCode) {
  EXPECT_EQ(code_after_printing(::open("/dev/null", O_WRONLY), 0), 0);
  EXPECT_EQ(code_after_printing(::open("/dev/null", O_WRONLY), 2), 2);
}

}  // namespace
}  // namespace takt::command_line
