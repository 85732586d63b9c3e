#include "idl/common/histogram.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace takt {
namespace {

TEST(DurationHistogram, AnEmptyHistogramIsZero) {
  const DurationHistogram histogram;
  EXPECT_EQ(histogram.count(), 0U);
  EXPECT_EQ(histogram.quantile_s(0.5), 0.0);
  EXPECT_EQ(histogram.max_s(), 0.0);
}

TEST(DurationHistogram, OneValueIsEveryQuantile) {
  DurationHistogram histogram;
  histogram.record_ns(123'456);
  for (const double q : {0.0, 0.5, 0.99, 1.0}) EXPECT_DOUBLE_EQ(histogram.quantile_s(q), 123'456e-9);
}

TEST(DurationHistogram, NegativeAndHugeDurationsAreKept) {
  DurationHistogram histogram;
  histogram.record_ns(-5);
  EXPECT_EQ(histogram.quantile_s(1.0), 0.0);
  histogram.record_ns(std::int64_t{1} << 62);
  EXPECT_EQ(histogram.count(), 2U);
  EXPECT_DOUBLE_EQ(histogram.max_s(), static_cast<double>(std::int64_t{1} << 62) * 1e-9);
}

TEST(DurationHistogram, QuantilesAreExactToOneBin) {
  std::mt19937_64 random(20240607);
  std::lognormal_distribution<double> distribution(11.0, 1.5);  // around 60 us, with a long tail
  DurationHistogram histogram;
  std::vector<std::int64_t> values;
  for (int i = 0; i < 100'000; ++i) {
    values.push_back(static_cast<std::int64_t>(distribution(random)));
    histogram.record_ns(values.back());
  }
  std::sort(values.begin(), values.end());
  for (const double q : {0.01, 0.5, 0.9, 0.99, 0.999}) {
    const auto rank = static_cast<std::size_t>(std::ceil(q * static_cast<double>(values.size()))) - 1;
    const double exact = static_cast<double>(values[rank]) * 1e-9;
    EXPECT_GE(histogram.quantile_s(q), exact);
    EXPECT_LE(histogram.quantile_s(q), exact * 1.126);  // a bin is at most an eighth of its lower edge wide
  }
  EXPECT_DOUBLE_EQ(histogram.max_s(), static_cast<double>(values.back()) * 1e-9);
  EXPECT_DOUBLE_EQ(histogram.quantile_s(1.0), histogram.max_s());
}

TEST(DurationHistogram, SmallValuesAreExact) {
  DurationHistogram histogram;
  for (int i = 0; i < 16; ++i) histogram.record_ns(i);
  EXPECT_DOUBLE_EQ(histogram.quantile_s(0.5), 7e-9);
}

}  // namespace
}  // namespace takt
