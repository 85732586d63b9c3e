// What a sample may look like before it is decoded, against samples that the generated types serialise.
#include <gtest/gtest.h>

#include <random>

#include "idl/transport/rtps_guard/cdr_layout.h"
#include "tests/support/effort.h"

namespace takt {
namespace {

/// Plain XCDR1 in either byte order.
class EncodedSample {
 public:
  explicit EncodedSample(bool big) : big_(big), bytes_{0, static_cast<std::uint8_t>(big ? 0 : 1), 0, 0} {}
  EncodedSample& number(std::uint64_t value, std::size_t size) {
    while ((bytes_.size() - 4) % size != 0) bytes_.push_back(0xEE);
    for (std::size_t i = 0; i < size; ++i) {
      const std::size_t shift = 8 * (big_ ? size - 1 - i : i);
      bytes_.push_back(static_cast<std::uint8_t>(value >> shift));
    }
    return *this;
  }
  EncodedSample& text(const std::string& value) {
    number(value.size() + 1, 4);
    bytes_.insert(bytes_.end(), value.begin(), value.end());
    bytes_.push_back(0);
    return *this;
  }
  std::vector<std::uint8_t>& all() { return bytes_; }

 private:
  bool big_;
  std::vector<std::uint8_t> bytes_;
};

EncodedSample trajectory_bytes(bool big, std::uint64_t claimed_points) {
  EncodedSample bytes(big);
  bytes.number(3, 4).number(5, 4).text("frame").number(2, 4).text("a").text("joint").number(claimed_points,
                                                                                            4);
  for (int i = 0; i < 2; ++i) {
    bytes.number(1, 4).number(7, 8).number(0, 4).number(2, 4).number(1, 8).number(2, 8).number(0, 4);
    bytes.number(1, 4).number(2, 4);
  }
  return bytes;
}

constexpr WireShape kTrajectory = "44s[s][[8][8][8][8]44]";

TEST(WireShape, WholeSamplesAreAcceptedInBothByteOrders) {
  for (const bool big : {false, true}) {
    EncodedSample good = trajectory_bytes(big, 2);
    EXPECT_TRUE(has_shape(good.all(), kTrajectory));
    EXPECT_FALSE(has_shape(trajectory_bytes(big, 3).all(), kTrajectory)) << "one point is missing";
    EXPECT_FALSE(has_shape(trajectory_bytes(big, 0xFFFFFFFF).all(), kTrajectory));
    EXPECT_FALSE(has_shape(trajectory_bytes(big, 100'000'000).all(), kTrajectory));
    // Cut anywhere.
    std::vector<std::uint8_t> cut = good.all();
    while (!cut.empty()) {
      cut.pop_back();
      EXPECT_FALSE(has_shape(cut, kTrajectory)) << cut.size();
    }
    // Longer than its fields: the rest is padding.
    good.all().push_back(0);
    EXPECT_TRUE(has_shape(good.all(), kTrajectory));
  }
}

TEST(WireShape, LengthsLargerThanTheSampleAreRefused) {
  std::mt19937 dice(7);
  for (std::size_t round = 0; round < 20'000 * test::effort(); ++round) {
    EncodedSample bytes = trajectory_bytes(dice() % 2 == 0, dice() % 4);
    for (unsigned i = 0; i < 1 + dice() % 4; ++i)
      bytes.all()[dice() % bytes.all().size()] = static_cast<std::uint8_t>(dice());
    (void)has_shape(bytes.all(), kTrajectory);  // the sanitizers look on
  }
  EncodedSample names(false);
  names.number(0, 4).number(0, 4).text("").number(50, 4);
  for (int i = 0; i < 50; ++i) names.text("j");
  EXPECT_TRUE(has_shape(names.all(), "44s[s]"));
  names.all()[4 + 4 + 4 + 4 + 1 + 3] = 51;
  EXPECT_FALSE(has_shape(names.all(), "44s[s]"));
}

}  // namespace
}  // namespace takt
