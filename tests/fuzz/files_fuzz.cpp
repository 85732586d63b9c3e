// libFuzzer over one reader of files, named by TAKT_FUZZ_FORMAT (./dev soak files). An exception that is not
// of the reader's own type ends the run, as a crash does.
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>

#include "tests/fuzz/file_readers.h"

namespace {

std::string format_asked_for() {
  const char* name = std::getenv("TAKT_FUZZ_FORMAT");
  return name != nullptr ? name : "obj";
}

std::filesystem::path own_directory() {
  auto directory = std::filesystem::temp_directory_path() / ("takt_fuzz_" + std::to_string(getpid()));
  std::filesystem::create_directories(directory);
  takt::test::write_named_files(directory);
  return directory;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::string format = format_asked_for();
  static const std::filesystem::path directory = own_directory();
  (void)takt::test::read_fuzzed_bytes(format, directory, {reinterpret_cast<const char*>(data), size});
  return 0;
}
