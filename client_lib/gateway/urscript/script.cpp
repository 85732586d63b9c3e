#include "client_lib/gateway/urscript/script.h"

#include <algorithm>
#include <charconv>

#include "client_lib/gateway/urscript/lexer.h"

namespace takt::urscript {
namespace {

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r';
}

/// Calls `visit` with each byte outside of texts and comments, and its position.
template <class Visit>
void for_each_byte(std::string_view line, const Visit& visit) {
  char quote = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quote != 0) {
      if (c == quote) quote = 0;
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (!visit(c, i)) {
      return;
    }
  }
}

/// Without a comment and blanks at the end.
std::string_view code_of(std::string_view line) {
  std::size_t end = line.size();
  for_each_byte(line, [&](char c, std::size_t i) {
    if (c == '#') end = i;
    return c != '#';
  });
  line = line.substr(0, end);
  while (!line.empty() && is_blank(line.back())) line.remove_suffix(1);
  return line;
}

std::string_view trimmed(std::string_view line) {
  while (!line.empty() && is_blank(line.front())) line.remove_prefix(1);
  return line;
}

std::string_view first_word(std::string_view code) {
  std::size_t end = 0;
  while (end < code.size() && (is_letter(code[end]) || is_digit(code[end]))) ++end;
  return code.substr(0, end);
}

bool opens_block(std::string_view word) {
  return word == "def" || word == "sec" || word == "thread" || word == "while" || word == "for" ||
         word == "if";
}

/// Blocks that are open behind a line's code, of those before it.
int depth_behind(std::string_view code, int depth) {
  if (code.substr(0, 1) == "$") return depth;  // a label
  std::size_t begin = 0;
  bool in_word = false;
  const auto end_word = [&](std::size_t end) {
    if (begin > 0 && code[begin - 1] == '.') return;  // a member, as in time().sec
    const std::string_view word = code.substr(begin, end - begin);
    if (opens_block(word)) ++depth;
    if (word == "end" && depth > 0) --depth;
  };
  for_each_byte(code, [&](char c, std::size_t i) {
    const bool is_word = is_letter(c) || is_digit(c);
    if (is_word && !in_word) begin = i;
    if (!is_word && in_word) end_word(i);
    in_word = is_word;
    return true;
  });
  if (in_word) end_word(code.size());
  return depth;
}

struct Line {
  std::string_view code;
  int number = 0, column = 0;
};

std::vector<Line> lines_of(std::string_view text) {
  std::vector<Line> lines;
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view code = code_of(text.substr(0, end)), inner = trimmed(code);
    if (!inner.empty()) lines.push_back({inner, number, static_cast<int>(code.size() - inner.size()) + 1});
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

/// NAME of "def NAME():"; empty if the line is no head of a program.
std::string name_of_program(std::string_view code) {
  std::string_view rest = trimmed(code.substr(first_word(code).size()));
  const std::string_view name = first_word(rest);
  rest = trimmed(rest.substr(name.size()));
  if (name.empty() || !is_letter(name.front()) || rest.substr(0, 1) != "(" || rest.back() != ':') return {};
  return std::string(name);
}

/// Some lines of a text as a program, in their places.
Code code_of_lines(const std::vector<Line>& lines, std::size_t begin, std::size_t end) {
  if (begin >= end) return {};
  std::string text;
  int number = 1;
  for (std::size_t i = begin; i < end; ++i) {
    text.append(static_cast<std::size_t>(lines[i].number - number), '\n');
    text.append(static_cast<std::size_t>(lines[i].column - 1), ' ');
    text += lines[i].code;
    number = lines[i].number;
  }
  return compile(parse(text));
}

/// HOST and PORT of connect_socket_with_retry("HOST", PORT, "NAME").
std::optional<ExternalControl::Place> place_of(std::string_view text, std::string_view socket) {
  constexpr std::string_view kCall = "connect_socket_with_retry(\"";
  for (std::size_t at = text.find(kCall); at != std::string_view::npos; at = text.find(kCall, at + 1)) {
    std::string_view rest = text.substr(at + kCall.size());
    rest = rest.substr(0, rest.find('\n'));
    const std::size_t quote = rest.find('"');
    if (quote == std::string_view::npos) continue;
    ExternalControl::Place place{std::string(rest.substr(0, quote)), 0};
    rest.remove_prefix(quote + 1);
    while (!rest.empty() && (rest.front() == ',' || is_blank(rest.front()))) rest.remove_prefix(1);
    const auto [end, problem] = std::from_chars(rest.data(), rest.data() + rest.size(), place.port);
    if (problem != std::errc{}) continue;
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
    if (rest.find("\"" + std::string(socket) + "\"") != std::string_view::npos) return place;
  }
  return std::nullopt;
}

double scale_of(std::string_view text, std::string_view name) {
  const std::size_t at = text.find(std::string(name) + " = ");
  double value = 1e6;
  if (at == std::string_view::npos) return value;
  const std::string_view rest = text.substr(at + name.size() + 3);
  std::from_chars(rest.data(), rest.data() + rest.size(), value);
  return value > 0.0 ? value : 1e6;
}

std::optional<ExternalControl> external_control_of(std::string_view text) {
  const auto trajectory = place_of(text, "trajectory_socket"),
             script_command = place_of(text, "script_command_socket"),
             reverse = place_of(text, "reverse_socket");
  if (!trajectory || !script_command || !reverse) return std::nullopt;
  ExternalControl external{*trajectory, *script_command, *reverse};
  external.joint_scale = scale_of(text, "MULT_jointstate");
  external.time_scale = scale_of(text, "MULT_time");
  external.answers_cancel = text.find("socket_send_int(TRAJECTORY_RESULT_CANCELED") != std::string_view::npos;
  for (const Line& line : lines_of(text))
    if (line.code.find("write_output_float_register(1, splineTimerTraveled)") != std::string_view::npos)
      external.writes_spline_time = true;
  return external;
}

}  // namespace

std::optional<std::string> ScriptStream::next() {
  for (;;) {
    const std::size_t end = buffer_.find('\n', std::max(line_, searched_));
    if (end == std::string::npos) {
      buffer_.erase(0, begin_);
      line_ -= begin_;
      begin_ = 0;
      searched_ = buffer_.size();
      return std::nullopt;
    }
    const std::string_view code = trimmed(code_of(std::string_view(buffer_).substr(line_, end - line_)));
    depth_ = depth_behind(code, depth_);
    line_ = end + 1;
    if (depth_ > 0) continue;
    std::string text = buffer_.substr(begin_, end - begin_);
    begin_ = line_;
    if (!code.empty()) return text;  // else an empty line or a comment
  }
}

Program parse_program(std::string_view text) {
  const std::vector<Line> lines = lines_of(text);
  Program program;
  if (lines.empty()) return program;
  program.external = external_control_of(text);
  if (!program.external) {
    const Definition definition = parse(text);
    if (!definition.parameters.empty())
      throw ScriptError(definition.line, definition.column, "syntax_error: a program has no parameters");
    program.name = definition.name;
    program.secondary = definition.kind == Definition::Kind::secondary;
    program.code = compile(definition);
    return program;
  }
  const std::string_view head = first_word(lines.front().code);
  std::size_t end = lines.size();
  if (head == "def" || head == "sec") {
    program.name = name_of_program(lines.front().code);
    if (program.name.empty())
      throw ScriptError(lines.front().number, lines.front().column, "syntax_error: def NAME(): is expected");
    program.secondary = head == "sec";
    if (lines.size() < 2 || lines.back().code != "end")
      throw ScriptError(lines.back().number, lines.back().column, "syntax_error: the program has no 'end'");
    end = lines.size() - 1;
  }
  // What follows the control loop; its own lines are what takt does in its place.
  const std::size_t mark = text.find("# NODE_CONTROL_LOOP_ENDS");
  const auto first =
      static_cast<int>(std::count(
          text.begin(), text.begin() + static_cast<std::ptrdiff_t>(std::min(mark, text.size())), '\n')) +
      1;
  const auto begin = static_cast<std::size_t>(
      std::find_if(lines.begin(), lines.end(), [&](const Line& line) { return line.number > first; }) -
      lines.begin());
  program.code = code_of_lines(lines, begin, end);
  return program;
}

}  // namespace takt::urscript
