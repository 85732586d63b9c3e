// Work in a process of its own: its result, its time, its crashes.
#include "server/cad/child_process.h"

#include <gmock/gmock.h>

#include <csignal>
#include <cstdlib>
#include <ctime>
#include <stdexcept>

#include "server/cad/body_bytes.h"
#include "server/cad/time_limit.h"
#include "tests/support/product_bodies.h"

namespace takt::cad {
namespace {

using testing::HasSubstr;

TEST(ChildProcess, ResultsLongerThanAPipeComeBackWhole) {
  std::string expected;
  for (int i = 0; i < 300000; ++i) expected += static_cast<char>(i * 7 % 251);
  const ChildResult result = run_in_child([&] { return expected; }, 10);
  EXPECT_EQ(result.problem, "");
  EXPECT_EQ(result.bytes, expected);
  EXPECT_EQ(run_in_child([] { return std::string(); }, 10).problem, "");
}

TEST(ChildProcess, WhatDoesNotEndIsStoppedAfterItsTimeOnTheProcessor) {
  const ChildResult result = run_in_child(
      [] {
        volatile unsigned n = 0;
        while (true) n = n + 1;
        return std::string("never");
      },
      1);
  EXPECT_EQ(result.problem, "it takes more than 1 s of computing");
  EXPECT_EQ(result.bytes, "");
}

/// The process computes for so long.
void compute(double seconds) {
  const std::clock_t end = std::clock() + static_cast<std::clock_t>(seconds * CLOCKS_PER_SEC);
  while (std::clock() < end) continue;
}

TEST(TimeLimitDeathTest, AProcessThatComputesLongerEndsWithTheSentence) {
  EXPECT_EXIT(
      {
        const TimeLimit limit("product.step: it takes long", 1);
        compute(60.0);
      },
      testing::ExitedWithCode(2), "product.step: it takes long\n");
}

TEST(TimeLimitDeathTest, OnlyTheWorkBesideItIsLimited) {
  EXPECT_EXIT(
      {
        {
          const TimeLimit limit("it takes long", 1);
          // A process of its own has a limit of its own.
          if (run_in_child([] { return compute(2.5), std::string("done"); }, 20).bytes != "done")
            std::_Exit(1);
        }
        compute(2.5);
        std::_Exit(0);
      },
      testing::ExitedWithCode(0), "");
}

TEST(ChildProcess, CrashesAndExceptionsAreProblems) {
  EXPECT_THAT(run_in_child(
                  []() -> std::string {
                    std::raise(SIGKILL);
                    return "whole";
                  },
                  10)
                  .problem,
              HasSubstr("more than"));
  EXPECT_THAT(run_in_child(
                  []() -> std::string {
                    std::raise(SIGSEGV);
                    return "whole";
                  },
                  10)
                  .problem,
              HasSubstr("it crashes: "));
  EXPECT_EQ(run_in_child([]() -> std::string { throw std::runtime_error("no"); }, 10).problem, "it fails");
}

TEST(ChildProcess, ABodyIsTheSameOnTheOtherSide) {
  product::Body body = test::plate_with_hole("plate", 0.1, 0.02, 0.03), other;
  body.faces[2].kind = product::SurfaceKind::helix;
  body.faces[2].pitch_m = -0.00125;
  body.deflection_m = 1e-4;
  std::vector<std::string> notes{"first"};
  take_bytes(bytes_of(body, {"second", ""}), other, notes);
  EXPECT_THAT(notes, testing::ElementsAre("first", "second", ""));
  EXPECT_EQ(other.mesh.vertices, body.mesh.vertices);
  EXPECT_EQ(other.mesh.triangles, body.mesh.triangles);
  EXPECT_EQ(other.triangle_faces, body.triangle_faces);
  EXPECT_EQ(other.exact.volume, body.exact.volume);
  EXPECT_EQ(other.exact.p_BBcm, body.exact.p_BBcm);
  EXPECT_EQ(other.exact.G_BBcm_B, body.exact.G_BBcm_B);
  EXPECT_EQ(other.deflection_m, body.deflection_m);
  ASSERT_EQ(other.faces.size(), body.faces.size());
  for (std::size_t f = 0; f < body.faces.size(); ++f) {
    EXPECT_EQ(other.faces[f].kind, body.faces[f].kind);
    EXPECT_EQ(other.faces[f].point_B, body.faces[f].point_B);
    EXPECT_EQ(other.faces[f].axis_B, body.faces[f].axis_B);
    EXPECT_EQ(other.faces[f].radius_m, body.faces[f].radius_m);
    EXPECT_EQ(other.faces[f].pitch_m, body.faces[f].pitch_m);
    EXPECT_EQ(other.faces[f].concave, body.faces[f].concave);
    EXPECT_EQ(other.faces[f].area_m2, body.faces[f].area_m2);
  }
  const std::string bytes = bytes_of(body, {});
  EXPECT_THROW(take_bytes(bytes.substr(0, bytes.size() / 2), other, notes), std::runtime_error);
}

}  // namespace
}  // namespace takt::cad
