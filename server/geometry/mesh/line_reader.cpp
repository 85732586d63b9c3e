#include "server/geometry/mesh/line_reader.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <system_error>

#include "server/geometry/mesh/builder.h"

namespace takt {
namespace {

bool is_blank(char c) {
  return c == ' ' || (c >= '\t' && c <= '\r');  // a line has no line feed
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

/// Cuts the first word off a trimmed text, and the blanks behind it.
std::string_view take_word(std::string_view& text) {
  const auto end = static_cast<std::size_t>(std::find_if(text.begin(), text.end(), is_blank) - text.begin());
  const std::string_view word = text.substr(0, end);
  text.remove_prefix(end);
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  return word;
}

bool is_continued(std::string_view line) {
  line = trimmed(line);
  return line.ends_with('\\') && (line.size() == 1 || is_blank(line[line.size() - 2]));
}

/// Empty if the word is a number that single precision can hold.
std::string parse(std::string_view word, double& value) {
  std::string_view digits = word;
  if (digits.starts_with('+')) digits.remove_prefix(1);
  value = 0.0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error == std::errc::invalid_argument || end != digits.data() + digits.size())
    return quoted(word) + " is not a number";
  // Out of range also means too small, which is a zero.
  const bool too_large = error == std::errc::result_out_of_range
                             ? word.find("e-") == word.npos && word.find("E-") == word.npos
                             : std::abs(value) > static_cast<double>(std::numeric_limits<float>::max());
  if (std::isnan(value) || too_large) return quoted(word) + " is not a finite number of single precision";
  return {};
}

}  // namespace

std::string quoted(std::string_view word) {
  constexpr std::size_t kMax = 40;
  return "'" + std::string(word.substr(0, kMax)) + (word.size() > kMax ? "...'" : "'");
}

std::string_view LineReader::take_line() {
  const std::size_t end = std::min(text_.find('\n'), text_.size());
  const std::string_view current = text_.substr(0, end);
  text_.remove_prefix(std::min(end + 1, text_.size()));
  ++next_line_;
  return current;
}

bool LineReader::next() {
  while (!text_.empty()) {
    line = next_line_;
    std::string_view whole = take_line();
    joined_.clear();
    for (; join_continued_ && is_continued(whole); whole = take_line())
      joined_.append(whole.substr(0, whole.rfind('\\'))).append(" ");
    if (!joined_.empty()) whole = joined_ += whole;
    arguments = trimmed(whole);
    word = take_word(arguments);
    if (!word.empty()) return true;
  }
  return false;
}

const std::vector<std::string_view>& LineReader::words() {
  words_.clear();
  for (std::string_view rest = arguments; !rest.empty();) words_.push_back(take_word(rest));
  return words_;
}

const std::vector<double>& LineReader::coordinates(std::size_t vertex) {
  const auto subject = [&] { return vertex == 0 ? "a vertex" : "vertex " + std::to_string(vertex); };
  numbers_.resize(words().size());
  if (numbers_.size() < 3)
    fail(subject() + " needs three coordinates, found " + std::to_string(numbers_.size()));
  for (std::size_t i = 0; i < numbers_.size(); ++i) {
    const std::string fault = parse(words_[i], numbers_[i]);
    if (!fault.empty()) fail("coordinate " + std::to_string(i + 1) + " of " + subject() + ": " + fault);
  }
  return numbers_;
}

void LineReader::fail(const std::string& problem) const {
  throw MeshFault("line " + std::to_string(line) + ": " + problem);
}

}  // namespace takt
