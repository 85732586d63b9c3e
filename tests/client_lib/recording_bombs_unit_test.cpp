// Recordings of a few kB that claim or become gigabytes: a sentence, and no memory for them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <fstream>

#include "client_lib/recording/compression.h"
#include "client_lib/recording/mcap_format.h"
#include "client_lib/recording/mcap_reader.h"
#include "client_lib/recording/offered_qos.h"
#include "client_lib/recording/sample.h"
#include "tests/support/cdr_bytes.h"
#include "tests/support/temporary_directory.h"

namespace takt::recording {
namespace {

using mcap::Record;
using ::testing::HasSubstr;

constexpr std::uint64_t kMB = std::uint64_t{1} << 20U;

template <typename Action>
std::string refusal(const Action& action) {
  try {
    action();
  } catch (const RecordingError& error) {
    return error.what();
  }
  return "no error";
}

std::string chunk(std::uint64_t first_ns, std::uint64_t last_ns, std::string_view compression,
                  std::string_view packed, std::uint64_t size) {
  return Record(mcap::kChunk)
      .put(first_ns)
      .put(last_ns)
      .put(size)
      .put(std::uint32_t{0})
      .text(compression)
      .put(std::uint64_t{packed.size()})
      .raw(packed)
      .finished();
}

class RecordingBombs : public testing::Test {
 protected:
  /// A recording of these chunks that was not closed.
  std::filesystem::path unclosed(const std::vector<std::string>& chunks) {
    std::ofstream out(file_, std::ios::binary);
    out << mcap::kMagic << Record(mcap::kHeader).text("").text("a test").finished();
    for (const std::string& one : chunks) out << one;
    return file_;
  }
  /// With an index that names the chunk this many times.
  std::filesystem::path indexed(const std::string& one, int times) {
    std::string bytes(mcap::kMagic);
    bytes += Record(mcap::kHeader).text("").text("a test").finished();
    const std::uint64_t place = bytes.size();
    bytes += one + Record(mcap::kDataEnd).put(std::uint32_t{0}).finished();
    const std::uint64_t begin = bytes.size();
    for (int i = 0; i < times; ++i)
      bytes += Record(mcap::kChunkIndex)
                   .put(std::uint64_t{0})
                   .put(std::uint64_t{9})
                   .put(place)
                   .put(std::uint64_t{one.size()})
                   .finished();
    bytes += Record(mcap::kFooter).put(begin).put(std::uint64_t{0}).put(std::uint32_t{0}).finished();
    std::ofstream(file_, std::ios::binary) << bytes << mcap::kMagic;
    return file_;
  }

  const test::TemporaryDirectory directory_;
  const std::filesystem::path file_ = directory_ / "bomb.mcap";
};

TEST_F(RecordingBombs, AChunkThatClaimsGigabytesIsRefused) {
  for (const char* compression : {"zstd", "lz4", ""}) {
    for (const std::uint64_t claim : {257 * kMB, 2048 * kMB}) {
      McapReader reader(indexed(chunk(0, 9, compression, "x", claim), 1));
      EXPECT_THAT(refusal([&] { reader.read([](const McapMessage&) { return true; }); }),
                  HasSubstr("a chunk has " + std::to_string(claim / kMB) + " MB; takt reads up to 256 MB"));
      EXPECT_THAT(McapReader(unclosed({chunk(0, 9, compression, "x", claim)})).cut_off(),
                  HasSubstr("takt reads up to 256 MB"));
    }
  }
}

TEST_F(RecordingBombs, AChunkThatBecomesMoreThanItClaimsIsDamaged) {
  std::string packed;
  for (const Compression compression : {Compression::zstd, Compression::lz4}) {
    compress(compression, std::string(32 * kMB, '\0'), packed);
    EXPECT_LT(packed.size(), kMB);
    EXPECT_EQ(refusal([&] { decompress(mcap_name(compression), packed, 1000); }), "a chunk is damaged");
  }
}

TEST_F(RecordingBombs, ASparseFileIsRefused) {
  std::string head = chunk(0, 9, "", "", 0);
  const std::uint64_t length = 300 * kMB;
  std::memcpy(head.data() + 1, &length, sizeof length);
  std::filesystem::resize_file(unclosed({head}), 1024 * kMB);
  EXPECT_THAT(McapReader(file_).cut_off(), HasSubstr("a record has 300 MB; takt reads up to 256 MB"));
}

TEST_F(RecordingBombs, OneChunkNamedTwiceIsADamagedIndex) {
  const std::string message = Record(mcap::kMessage)
                                  .put(std::uint16_t{1})
                                  .put(std::uint32_t{1})
                                  .put(std::uint64_t{5})
                                  .put(std::uint64_t{5})
                                  .finished();
  EXPECT_EQ(refusal([&] { McapReader reader(indexed(chunk(0, 9, "", message, message.size()), 1)); }),
            "no error");
  EXPECT_THAT(refusal([&] { McapReader reader(indexed(chunk(0, 9, "", message, message.size()), 2)); }),
              HasSubstr("has a damaged index of its chunks"));
}

TEST_F(RecordingBombs, ChunksThatOverlapAreBoundedTogether) {
  const std::string message = Record(mcap::kMessage)
                                  .put(std::uint16_t{1})
                                  .put(std::uint32_t{1})
                                  .put(std::uint64_t{5})
                                  .put(std::uint64_t{5})
                                  .raw(std::string(1000, 'x'))
                                  .finished();
  const McapLimits limits{.record_bytes = 10'000, .overlap_bytes = 4500};
  const auto read = [&](const std::vector<std::string>& chunks) {
    return refusal([&] {
      McapReader reader(unclosed(chunks), limits);
      reader.read([](const McapMessage&) { return true; });
    });
  };
  const auto at = [&](std::uint64_t first_ns, std::uint64_t time_ns) {
    std::string moved = message;
    std::memcpy(moved.data() + mcap::kRecordHead_bytes + 6, &time_ns, sizeof time_ns);
    return chunk(first_ns, time_ns, "", moved, moved.size());
  };
  EXPECT_EQ(read({at(0, 9), at(0, 9), at(0, 9), at(0, 9)}), "no error");
  EXPECT_THAT(read({at(0, 9), at(0, 9), at(0, 9), at(0, 9), at(0, 9)}),
              HasSubstr("overlap in time and hold more"));
  std::vector<std::string> sequence;
  for (std::uint64_t i = 0; i < 50; ++i) sequence.push_back(at(10 * i, 10 * i + 9));
  EXPECT_EQ(read(sequence), "no error");
}

std::string json_refusal(const std::string& schema, const std::string& sample) {
  MessageTypes types;
  types.add_ros2msg("a/msg/T", schema);
  return refusal([&] { to_json(types, "a/msg/T", sample); });
}

TEST(SchemaBombs, MessagesThatTakeNoByteAreBounded) {
  std::string doubled = "L0 a\nL0 b\n";
  for (int i = 0; i < 59; ++i) {
    const std::string next = "L" + std::to_string(i + 1);
    doubled += "MSG: a/L" + std::to_string(i) + "\n" + next + " a\n" + next + " b\n";
  }
  doubled += "MSG: a/L59\n\n";
  EXPECT_THAT(json_refusal(doubled, std::string("\0\1\0\0", 4)),
              HasSubstr("more values than its bytes can hold"));

  // Lists of a thousand messages without members, each of a count of four bytes.
  std::string lists = "E[] a0\n";
  for (int i = 1; i < 200; ++i) lists += "E[] a" + std::to_string(i) + "\n";
  test::CdrWriter counts;
  for (int i = 0; i < 400; ++i) counts.put(std::uint32_t{700});
  EXPECT_THAT(json_refusal(lists + "MSG: a/E\n\n", counts.bytes()),
              HasSubstr("more values than its bytes can hold"));
}

TEST(SchemaBombs, DeepTypesAreRefused) {
  std::string deep = "L0 a\n";
  for (int i = 0; i < 50'000; ++i)
    deep += "MSG: a/L" + std::to_string(i) + "\nL" + std::to_string(i + 1) + " a\n";
  deep += "MSG: a/L50000\nuint8 x\n";
  EXPECT_THAT(json_refusal(deep, std::string("\0\1\0\0\7", 5)), HasSubstr("is nested deeper than 64 types"));
}

TEST(SchemaBombs, LongQosProfilesAreIgnored) {
  const std::string profile = "- reliability: 1\n  durability: 1\n";
  EXPECT_TRUE(read_offered_qos(profile).has_value());
  std::string many;
  while (many.size() < 70'000) many += profile;
  EXPECT_FALSE(read_offered_qos(many).has_value());
}

}  // namespace
}  // namespace takt::recording
