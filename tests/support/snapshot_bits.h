#pragma once
// Snapshots, number by number.
#include <gtest/gtest.h>

#include <cstring>

#include "server/simulation/model/snapshot.h"

namespace takt::test {

inline void expect_same_bits(const Snapshot& a, const Snapshot& b) {
  ASSERT_EQ(a.state_hash, b.state_hash) << a.step;
  ASSERT_EQ(a.components.size(), b.components.size());
  for (std::size_t i = 0; i < a.components.size(); ++i) {
    const ComponentSample& x = a.components[i];
    const ComponentSample& y = b.components[i];
    const auto same = [](const Vec3& one, const Vec3& other) {
      return std::memcmp(one.data(), other.data(), 3 * sizeof(double)) == 0;
    };
    ASSERT_TRUE(same(x.p_WB, y.p_WB)) << a.step << " " << i;
    ASSERT_EQ(std::memcmp(x.q_WB.coeffs().data(), y.q_WB.coeffs().data(), 4 * sizeof(double)), 0) << i;
    ASSERT_TRUE(same(x.V_WB.v, y.V_WB.v) && same(x.V_WB.w, y.V_WB.w)) << a.step << " " << i;
    ASSERT_TRUE(same(x.F_Bo_W.f, y.F_Bo_W.f) && same(x.F_Bo_W.t, y.F_Bo_W.t)) << a.step << " " << i;
    ASSERT_EQ(x.partner, y.partner) << a.step << " " << i;
    ASSERT_EQ(x.state, y.state) << a.step << " " << i;
  }
}

}  // namespace takt::test
