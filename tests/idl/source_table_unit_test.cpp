// Which sender the guard believes when several send in the name of one participant.
#include "idl/transport/rtps_guard/source_table.h"

#include <gtest/gtest.h>

namespace takt {
namespace {

constexpr std::uint64_t kServer = 77U << 20U, kOwn = 1001, kSecondSource = 1002, kForeign = 6666;

/// As many packets as prove a source, one each second.
void prove(SourceTable& table, std::uint64_t source, std::uint32_t from_s) {
  for (std::uint32_t i = 0; i < SourceTable::kProof; ++i) table.admits(kServer, source, from_s + i);
}

TEST(SourceTable, AnySourceIsAdmittedBeforeOneIsProven) {
  SourceTable table;
  EXPECT_TRUE(table.admits(kServer, kForeign, 10));
  EXPECT_TRUE(table.admits(kServer, kOwn, 10));
  EXPECT_TRUE(table.admits(kServer, kSecondSource, 10));
}

TEST(SourceTable, AProvenSourceKeepsOthersOut) {
  SourceTable table;
  prove(table, kOwn, 10);
  EXPECT_FALSE(table.admits(kServer, kForeign, 14));
  EXPECT_TRUE(table.admits(kServer, kOwn, 14));
  EXPECT_TRUE(table.admits(kServer + (1U << 20U), kForeign, 14)) << "another participant";
}

TEST(SourceTable, OnePacketAheadOfTheOwnOnesDoesNotKeepThemOut) {
  SourceTable table;
  EXPECT_TRUE(table.admits(kServer, kForeign, 10));
  prove(table, kOwn, 11);
  EXPECT_TRUE(table.admits(kServer, kOwn, 16));
  EXPECT_FALSE(table.admits(kServer, kForeign, 16));
}

TEST(SourceTable, SocketsThatSendFromTheBeginningAreAllAdmitted) {
  SourceTable table;
  for (std::uint32_t i = 0; i < 100; ++i) {
    EXPECT_TRUE(table.admits(kServer, kOwn, 10 + i / 10));
    if (i % 4 == 0) {
      EXPECT_TRUE(table.admits(kServer, kSecondSource, 10 + i / 10));
    }
  }
}

TEST(SourceTable, SharedMemoryIsProvenAtOnce) {
  SourceTable table;
  EXPECT_TRUE(table.admits(kServer, SourceTable::kSharedMemory, 10));
  EXPECT_FALSE(table.admits(kServer, kForeign, 10));
  EXPECT_TRUE(table.admits(kServer, SourceTable::kSharedMemory, 10));
}

TEST(SourceTable, AFurtherSourceIsAdmittedAfterItWasHeardForAWhile) {
  SourceTable table;
  prove(table, kOwn, 10);
  EXPECT_FALSE(table.admits(kServer, kSecondSource, 20));
  for (int i = 0; i < 100; ++i)
    EXPECT_FALSE(table.admits(kServer, kSecondSource, 20 + SourceTable::kContest_s - 1));
  EXPECT_TRUE(table.admits(kServer, kSecondSource, 20 + SourceTable::kContest_s));
  EXPECT_TRUE(table.admits(kServer, kOwn, 30));
}

TEST(SourceTable, ManyForeignSourcesDoNotDisplaceAProvenOne) {
  SourceTable table;
  prove(table, kOwn, 10);
  for (std::uint64_t i = 0; i < 10'000; ++i) EXPECT_FALSE(table.admits(kServer, kForeign + i, 20));
  for (std::uint64_t i = 1; i < 10'000; ++i) table.admits(kServer + (i << 20U), kForeign, 20);
  EXPECT_TRUE(table.admits(kServer, kOwn, 21));
  EXPECT_FALSE(table.admits(kServer, kForeign, 21));
}

TEST(SourceTable, AParticipantThatLeftHasNoProvenSource) {
  SourceTable table;
  prove(table, kOwn, 10);
  table.forget(kServer);
  EXPECT_TRUE(table.admits(kServer, kSecondSource, 14));
}

}  // namespace
}  // namespace takt
