// Files found by the fuzzer or made to break readers (tests/fuzz/corpus), and mutations of them: every reader
// returns a mesh, a robot, a scenario, or its own error with the file's name.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <random>

#include "tests/fuzz/file_readers.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

using ::testing::HasSubstr;

struct Seed {
  std::string name, bytes;
};

std::vector<Seed> corpus_of(const std::string& format) {
  std::vector<Seed> seeds;
  const auto directory = std::filesystem::path(TAKT_SOURCE_DIR) / "tests" / "fuzz" / "corpus" / format;
  for (const auto& entry : std::filesystem::directory_iterator(directory)) {
    std::ifstream in(entry.path(), std::ios::binary);
    seeds.push_back({entry.path().filename(), {std::istreambuf_iterator<char>(in), {}}});
  }
  std::sort(seeds.begin(), seeds.end(), [](const Seed& a, const Seed& b) { return a.name < b.name; });
  return seeds;
}

/// Words that are difficult for readers, in text and in binary.
const std::string kWords[] = {"nan",
                              "-inf",
                              "1e999",
                              "-1",
                              "0",
                              "4294967295",
                              "18446744073709551616",
                              "9e37",
                              "[",
                              "{",
                              "\"",
                              "<a>",
                              "&a ",
                              "*a",
                              "\n",
                              " ",
                              "\\\n",
                              "1e-400",
                              "2147483648",
                              std::string("\0", 1),
                              std::string("\xff\xff\xff\xff", 4),
                              std::string("\0\0\xc0\x7f", 4),
                              std::string("\0\0\0\x80", 4)};

class Mutator {
 public:
  std::string mutated(const std::vector<Seed>& seeds) {
    std::string bytes = one_of(seeds).bytes;
    const std::size_t changes = 1 + below(4);
    for (std::size_t i = 0; i < changes && !bytes.empty(); ++i) change(bytes, seeds);
    return bytes;
  }

 private:
  std::size_t below(std::size_t n) { return dice_() % n; }
  const Seed& one_of(const std::vector<Seed>& seeds) { return seeds[below(seeds.size())]; }
  void change(std::string& bytes, const std::vector<Seed>& seeds) {
    const std::size_t at = below(bytes.size());
    const std::size_t some = std::min(bytes.size() - at, 1 + below(40));
    switch (below(8)) {
      case 0:
        bytes[at] = static_cast<char>(below(256));
        break;
      case 1:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << below(8)));
        break;
      case 2:
        bytes.insert(at, kWords[below(std::size(kWords))]);
        break;
      case 3: {
        const std::string& word = kWords[below(std::size(kWords))];
        bytes.replace(at, std::min(word.size(), bytes.size() - at), word);
        break;
      }
      case 4:
        bytes.erase(at, some);
        break;
      case 5:
        bytes.insert(below(bytes.size()), bytes.substr(at, some));
        break;
      case 6:
        if (below(4) == 0) bytes.resize(at);
        break;
      default: {
        const std::string& other = one_of(seeds).bytes;
        const std::size_t from = below(other.size());
        bytes.replace(at, some, other, from, some);
      }
    }
  }

  std::mt19937 dice_{20261122};
};

class FuzzedFiles : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { test::write_named_files(directory_.path()); }
  /// The text of the error, which has the file's name; empty without one.
  std::string read(const std::string& bytes) {
    const std::string error = test::read_fuzzed_bytes(GetParam(), directory_.path(), bytes);
    if (!error.empty()) {
      EXPECT_THAT(error, testing::AnyOf(HasSubstr("fuzzed." + GetParam()), HasSubstr("part.obj")));
    }
    return error;
  }
  test::TemporaryDirectory directory_;
};

TEST_P(FuzzedFiles, FilesOfTheCorpusAreReadOrRefused) {
  std::size_t good = 0;
  for (const Seed& seed : corpus_of(GetParam())) {
    SCOPED_TRACE(seed.name);
    good += read(seed.bytes).empty() ? 1U : 0U;
  }
  EXPECT_GE(good, 1U);
}

TEST_P(FuzzedFiles, MutatedFilesAreReadOrRefused) {
  constexpr std::size_t kMutations = 1500;
  auto seeds = corpus_of(GetParam());
  std::erase_if(seeds, [](const Seed& seed) { return seed.bytes.size() > 5000; });  // the others are quicker
  Mutator mutator;
  std::size_t good = 0;
  for (std::size_t i = 0; i < kMutations; ++i) {
    const std::string bytes = mutator.mutated(seeds);
    SCOPED_TRACE("mutation " + std::to_string(i));
    ASSERT_NO_THROW(good += read(bytes).empty() ? 1U : 0U);
  }
  EXPECT_GT(good, kMutations / 1000) << "mutations that are all refused at once find nothing";
  EXPECT_LT(good, kMutations * 95 / 100);
}

INSTANTIATE_TEST_SUITE_P(Formats, FuzzedFiles, testing::ValuesIn(test::kFuzzedFormats),
                         [](const auto& of) { return of.param; });

}  // namespace
}  // namespace takt
