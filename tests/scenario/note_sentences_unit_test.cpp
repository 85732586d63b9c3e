// Notes for people: what holds for several components is one sentence.
#include "server/scenario/note_sentences.h"

#include <gmock/gmock.h>

namespace takt {
namespace {

TEST(NoteSentences, ComponentsThatDifferInNothingButTheirNameShareOne) {
  const auto note = [](const std::string& name, const std::string& edge) {
    return ImportNote{name, name + ": too coarse. Set contact." + name + ".edge_m to " + edge + ".", {}};
  };
  EXPECT_THAT(note_sentences({note("A", "1"), note("B", "2"), note("A_1", "1"), note("C", "1")}),
              testing::ElementsAre("A: too coarse. Set contact.A.edge_m to 1. So it is with A_1, C.",
                                   "B: too coarse. Set contact.B.edge_m to 2."));
  std::vector<ImportNote> many;
  for (int i = 1; i <= 9; ++i) many.push_back(note("N" + std::to_string(i), "1"));
  EXPECT_THAT(note_sentences(many),
              testing::ElementsAre(testing::EndsWith("to 1. So it is with N2, N3, N4, N5 and 4 more.")));
}

TEST(NoteSentences, OneSentenceOfOneComponentIsThereOnce) {
  EXPECT_THAT(note_sentences(
                  {{"A", "A sinks.", {}}, {"A", "A sinks.", {}}, {"A", "A floats.", {}}, {"", "Else.", {}}}),
              testing::ElementsAre("A sinks.", "A floats.", "Else."));
  // The notes of two runs of one cell.
  EXPECT_THAT(
      note_sentences(
          {{"A", "A sinks.", {}}, {"B", "B sinks.", {}}, {"A", "A sinks.", {}}, {"B", "B sinks.", {}}}),
      testing::ElementsAre("A sinks. So it is with B."));
}

}  // namespace
}  // namespace takt
