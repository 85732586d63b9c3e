// A recording that was cut off anywhere is read up to its last whole chunk, and never more or less.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>
#include <vector>

#include "client_lib/recording/mcap_reader.h"
#include "client_lib/recording/mcap_writer.h"
#include "client_lib/recording/sample.h"
#include "tests/support/cdr_bytes.h"
#include "tests/support/temporary_directory.h"

namespace {

using takt::recording::Compression;
using takt::recording::known_types;
using takt::recording::McapMessage;
using takt::recording::McapReader;
using takt::recording::McapWriter;
using takt::recording::RecordingError;
using takt::test::CdrWriter;

struct Flushed {
  std::uint64_t messages = 0, size = 0;
};

std::string event(std::uint64_t number, const std::string& message) {
  CdrWriter out;
  out.put(number);
  out.put(std::int32_t{3});
  out.put(std::uint32_t{7});
  out.put(number * 10);
  out.put(std::uint32_t{1});
  out.put(std::uint8_t{2});
  for (const std::string& text : {std::string("code"), std::string("P"), std::string(), message})
    out.put(text);
  return out.bytes();
}

/// A recording of 12 chunks on two topics, and its size after each.
std::vector<Flushed> write_recording(const std::filesystem::path& file, std::mt19937& random,
                                     Compression compression = Compression::zstd) {
  std::vector<Flushed> flushes;
  McapWriter writer(file, "a test", compression);
  const auto events = writer.add_channel("/cell/events", known_types(), "takt_msgs/msg/Event", {});
  const auto clock = writer.add_channel("/clock", known_types(), "rosgraph_msgs/msg/Clock", {});
  std::uint64_t number = 0;
  for (int chunk = 0; chunk < 12; ++chunk) {
    const int count = 20 + static_cast<int>(random() % 80);
    for (int i = 0; i < count; ++i) {
      ++number;
      std::string noise;  // incompressible, so that chunks have some length
      for (int k = 0; k < 40; ++k) noise.push_back(static_cast<char>('a' + random() % 26));
      writer.write(events, number * 1000, number, event(number, noise));
      if (i % 3 == 0) {
        CdrWriter time;
        time.put(static_cast<std::int32_t>(number));
        time.put(std::uint32_t{5});
        writer.write(clock, number * 1000, number, time.bytes());
      }
    }
    writer.flush();
    flushes.push_back({writer.message_count(), std::filesystem::file_size(file)});
  }
  writer.close();
  return flushes;
}

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Numbers of the events in a file, which must be consecutive; all messages are counted.
std::uint64_t count_messages(McapReader& reader) {
  std::uint64_t messages = 0, newest_event = 0;
  reader.read([&](const McapMessage& message) {
    ++messages;
    if (message.channel->topic == "/cell/events") {
      const auto json = takt::recording::to_json(reader.types(), message.channel->type, message.sample);
      EXPECT_EQ(json["sequence_number"], ++newest_event);
      EXPECT_EQ(message.log_time_ns, newest_event * 1000);
    }
    return true;
  });
  return messages;
}

class CutRecording : public testing::TestWithParam<Compression> {};

TEST_P(CutRecording, ARecordingCutAnywhereIsReadUpToItsLastWholeChunk) {
  std::mt19937 random(20240611);
  const takt::test::TemporaryDirectory directory;
  const auto whole = directory / "whole.mcap", cut = directory / "cut.mcap";
  const std::vector<Flushed> flushes = write_recording(whole, random, GetParam());
  const std::string bytes = bytes_of(whole);
  // Where each chunk's record ends, read here by hand: behind a flush the next chunk begins.
  std::vector<std::uint64_t> chunk_ends;
  std::uint64_t begin = 8 + 9;
  std::uint64_t header_length = 0;
  std::memcpy(&header_length, bytes.data() + 9, 8);
  begin += header_length;
  for (const Flushed& flushed : flushes) {
    ASSERT_EQ(bytes[begin], 0x06);
    std::uint64_t length = 0;
    std::memcpy(&length, bytes.data() + begin + 1, 8);
    chunk_ends.push_back(begin + 9 + length);
    begin = flushed.size;
  }
  {
    McapReader reader(whole);
    EXPECT_EQ(reader.cut_off(), "");
    EXPECT_EQ(reader.chunk_count(), flushes.size());
    EXPECT_EQ(count_messages(reader), flushes.back().messages);
  }
  int without_any = 0, with_all = 0;
  for (int i = 0; i < 1000; ++i) {
    const std::uint64_t place = 8 + random() % (bytes.size() - 8);
    {
      std::ofstream out(cut, std::ios::binary);
      out.write(bytes.data(), static_cast<std::streamsize>(place));
    }
    std::uint64_t expected = 0;
    std::size_t chunks = 0;
    for (; chunks < chunk_ends.size() && chunk_ends[chunks] <= place; ++chunks)
      expected = flushes[chunks].messages;
    McapReader reader(cut);
    EXPECT_NE(reader.cut_off(), "") << place;
    ASSERT_EQ(reader.chunk_count(), chunks) << place;
    ASSERT_EQ(count_messages(reader), expected) << place;
    without_any += expected == 0 ? 1 : 0;
    with_all += chunks == chunk_ends.size() ? 1 : 0;
  }
  EXPECT_GT(without_any, 0);
  EXPECT_GT(with_all, 0);
}

TEST_P(CutRecording, ADamagedChunkIsReportedAndNotHandedOut) {
  std::mt19937 random(7);
  const takt::test::TemporaryDirectory directory;
  const auto whole = directory / "whole.mcap", damaged = directory / "damaged.mcap";
  const std::vector<Flushed> flushes = write_recording(whole, random, GetParam());
  std::string bytes = bytes_of(whole);
  bytes[flushes[4].size + 200] =
      static_cast<char>(bytes[flushes[4].size + 200] ^ 0x10);  // in the sixth chunk
  {
    std::ofstream out(damaged, std::ios::binary);
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }
  McapReader reader(damaged);
  std::uint64_t messages = 0;
  std::string reported;
  try {
    reader.read([&](const McapMessage&) {
      ++messages;
      return true;
    });
  } catch (const RecordingError& error) {
    reported = error.what();
  }
  EXPECT_THAT(reported,
              testing::MatchesRegex("'.*damaged\\.mcap': a chunk is damaged; what was recorded from .* to "
                                    ".* s after its begin cannot be read\\."));
  EXPECT_EQ(messages, flushes[4].messages);
}

INSTANTIATE_TEST_SUITE_P(Compressions, CutRecording,
                         testing::Values(Compression::zstd, Compression::lz4, Compression::none),
                         [](const auto& test) {
                           const auto name = takt::recording::mcap_name(test.param);
                           return name.empty() ? std::string("none") : std::string(name);
                         });

/// One byte changed anywhere in a chunk's content: reported, or the same bytes (an insignificant bit).
TEST(Compression, DamagedLz4IsReportedOrUnchanged) {
  std::mt19937 random(11);
  std::string bytes;
  for (int i = 0; i < 20000; ++i) bytes.push_back(static_cast<char>('a' + random() % 4));
  std::string packed;
  takt::recording::compress(Compression::lz4, bytes, packed);
  ASSERT_LT(packed.size(), bytes.size());
  ASSERT_EQ(takt::recording::decompress("lz4", packed, bytes.size()), bytes);
  int reported = 0;
  const auto read = [&](const std::string& damaged, std::size_t size) {
    try {
      EXPECT_EQ(takt::recording::decompress("lz4", damaged, size).size(), size);
    } catch (const RecordingError&) {
      ++reported;
    }
  };
  for (int i = 0; i < 2000; ++i) {
    std::string damaged = packed;
    damaged[random() % packed.size()] ^= static_cast<char>(1U << (random() % 8));
    read(damaged, bytes.size());
  }
  EXPECT_GT(reported, 100);
  reported = 0;
  for (std::size_t length = 0; length < packed.size(); length += 97)
    read(packed.substr(0, length), bytes.size());
  EXPECT_EQ(reported, static_cast<int>((packed.size() + 96) / 97));
  EXPECT_THROW(takt::recording::decompress("lz4", packed, bytes.size() - 1), RecordingError);
  EXPECT_THROW(takt::recording::decompress("lz4", packed, bytes.size() + 1), RecordingError);
  EXPECT_THROW(takt::recording::decompress("lz4", packed + "x", bytes.size()), RecordingError);
  EXPECT_THROW(takt::recording::decompress("brotli", packed, bytes.size()), RecordingError);
}

TEST(McapRecording, AnotherFileIsRefusedWithItsName) {
  const takt::test::TemporaryDirectory directory;
  const auto file = directory / "notes.mcap";
  std::ofstream(file) << "not a recording at all";
  try {
    McapReader reader(file);
    FAIL() << "it was read";
  } catch (const RecordingError& error) {
    EXPECT_NE(std::string(error.what()).find("notes.mcap"), std::string::npos);
  }
}

}  // namespace
