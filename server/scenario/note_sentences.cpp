#include "server/scenario/note_sentences.h"

#include <algorithm>
#include <cctype>
#include <map>

namespace takt {

namespace {

/// The sentence without the name of its component.
std::string without_name(const ImportNote& note) {
  const std::string& name = note.component;
  if (name.empty()) return note.sentence;
  const auto in_word = [&](std::size_t i) {
    return i < note.sentence.size() &&
           (std::isalnum(static_cast<unsigned char>(note.sentence[i])) != 0 || note.sentence[i] == '_');
  };
  std::string text;
  for (std::size_t i = 0; i < note.sentence.size();) {
    const bool here = note.sentence.compare(i, name.size(), name) == 0 && (i == 0 || !in_word(i - 1)) &&
                      !in_word(i + name.size());
    text += here ? '\0' : note.sentence[i];
    i += here ? name.size() : 1;
  }
  return text;
}

}  // namespace

std::vector<std::string> note_sentences(const std::vector<ImportNote>& notes) {
  struct Group {
    std::string sentence;
    std::vector<std::string> others;  ///< names of further components
  };
  std::vector<Group> groups;
  std::map<std::string, std::size_t> known;
  for (const ImportNote& note : notes) {
    const auto [found, is_new] = known.emplace(without_name(note), groups.size());
    if (is_new)
      groups.push_back({note.sentence, {}});
    else if (auto& [sentence, others] = groups[found->second];
             note.sentence != sentence &&
             std::find(others.begin(), others.end(), note.component) == others.end())
      others.push_back(note.component);
  }
  constexpr std::size_t kNamed = 4;
  std::vector<std::string> sentences;
  for (const Group& group : groups) {
    std::string text = group.sentence;
    for (std::size_t i = 0; i < std::min(group.others.size(), kNamed); ++i)
      text += (i == 0 ? " So it is with " : ", ") + group.others[i];
    if (group.others.size() > kNamed)
      text += " and " + std::to_string(group.others.size() - kNamed) + " more";
    if (!group.others.empty()) text += ".";
    sentences.push_back(std::move(text));
  }
  return sentences;
}

}  // namespace takt
