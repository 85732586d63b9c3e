#include "client_lib/tools/takt_ur/script_sockets.h"

#include <algorithm>
#include <charconv>

namespace takt::ur {
namespace {

using urscript::Value;

/// A socket whose program does not read is closed at this size.
constexpr std::size_t kMostReceived = 1U << 18U;
/// A program waits while its peer has left so much unread.
constexpr std::size_t kMostUnread = 1U << 16U;
constexpr std::size_t kMostSockets = 50;
constexpr int kMostNumbers = 30;
constexpr double kTimeout_s = 2.0;

std::string big_endian(double number, int bytes) {
  const auto whole = static_cast<std::uint32_t>(static_cast<std::int64_t>(std::llround(number)));
  std::string text;
  for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8)
    text += static_cast<char>(whole >> static_cast<unsigned>(shift) & 0xffU);
  return text;
}

/// Numbers as a client of a socket reads them: as many digits as they need.
std::string sent_text(const Value& value) {
  if (!value.is_number() || value.is_integer()) return text_of(value);
  std::array<char, 32> digits{};
  return {digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value.number()).ptr};
}

/// The count in front, then the values; 0 and as many fillers where nothing came.
Value counted(const std::vector<Value>& values) {
  std::vector<Value> list{static_cast<int>(values.size())};
  list.insert(list.end(), values.begin(), values.end());
  return Value::list(std::move(list));
}
Value nothing(int count, int filler) {
  std::vector<Value> list(static_cast<std::size_t>(count) + 1, Value(filler));
  list.front() = 0;
  return Value::list(std::move(list));
}

int count_of(const CallArguments& a) {
  const int count = a.whole(0, kMostNumbers);
  if (count == 0) a.fail("1 to " + std::to_string(kMostNumbers) + " numbers");
  return count;
}

std::optional<Value> binary(std::string& received, const CallArguments& a, std::size_t bytes) {
  const auto count = static_cast<std::size_t>(count_of(a));
  if (received.size() < count * bytes) return std::nullopt;
  std::vector<Value> values;
  for (std::size_t i = 0; i < count; ++i) {
    std::uint32_t whole = 0;
    for (std::size_t j = 0; j < bytes; ++j)
      whole = whole << 8U | static_cast<unsigned char>(received[i * bytes + j]);
    values.emplace_back(static_cast<int>(whole));
  }
  received.erase(0, count * bytes);
  return counted(values);
}
std::optional<Value> integers(std::string& received, const CallArguments& a) {
  return binary(received, a, 4);
}
std::optional<Value> single_bytes(std::string& received, const CallArguments& a) {
  return binary(received, a, 1);
}

/// (1.414, 3.14159)
std::optional<Value> floats(std::string& received, const CallArguments& a) {
  const auto count = static_cast<std::size_t>(count_of(a));
  const std::size_t begin = received.find('('),
                    end = received.find(')', begin == std::string::npos ? 0 : begin);
  if (begin == std::string::npos || end == std::string::npos) return std::nullopt;
  std::string_view inner = std::string_view(received).substr(begin + 1, end - begin - 1);
  std::vector<Value> values;
  while (!inner.empty()) {
    const std::size_t comma = std::min(inner.find(','), inner.size());
    std::string_view digits = inner.substr(0, comma);
    inner.remove_prefix(std::min(comma + 1, inner.size()));
    while (!digits.empty() && (digits.front() == ' ' || digits.front() == '+')) digits.remove_prefix(1);
    while (!digits.empty() && digits.back() == ' ') digits.remove_suffix(1);
    double number = 0.0;
    const auto [last, problem] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
    if (problem != std::errc{} || last != digits.data() + digits.size() || !(std::abs(number) <= 1e15)) break;
    values.emplace_back(number);
  }
  received.erase(0, end + 1);
  if (values.size() != count) return nothing(static_cast<int>(count), 0);
  return counted(values);
}

/// With \n, \r and \t as the characters that they stand for.
std::string unescaped(const std::string& text) {
  std::string made;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char next = text[i] == '\\' && i + 1 < text.size() ? text[i + 1] : '\0';
    const char meant = next == 'n' ? '\n' : next == 'r' ? '\r' : next == 't' ? '\t' : '\0';
    made += meant == '\0' ? text[i] : meant;
    if (meant != '\0') ++i;
  }
  return made;
}

std::optional<Value> string(std::string& received, const CallArguments& a) {
  const bool escapes = a.flag(3, false);
  const auto mark = [&](std::size_t i) { return escapes ? unescaped(a.text(i, "")) : a.text(i, ""); };
  const std::string prefix = mark(1), suffix = mark(2);
  std::size_t begin = urscript::position_of(received, prefix);
  if (received.empty() || begin == std::string::npos) return std::nullopt;
  begin += prefix.size();
  std::size_t end = suffix.empty() ? received.size() : urscript::position_of(received, suffix, begin);
  if (end == std::string::npos) return std::nullopt;
  end = std::min(end, begin + Value::kMostTextBytes);
  const std::string text = received.substr(begin, end - begin);
  received.erase(0, end + suffix.size());
  return text;
}

std::optional<Value> line(std::string& received, const CallArguments&) {
  const std::size_t end = received.find('\n');
  if (end == std::string::npos) return std::nullopt;
  std::string text = received.substr(0, std::min(end, Value::kMostTextBytes));
  received.erase(0, end + 1);
  if (!text.empty() && text.back() == '\r') text.pop_back();
  return text;
}

/// NAME VALUE
std::optional<Value> variable(std::string& received, const CallArguments& a) {
  const auto answer = line(received, a);
  if (!answer) return std::nullopt;
  const std::string& text = *answer->text();
  const std::string head = a.text(0) + " ";
  int number = 0;
  if (text.substr(0, head.size()) == head)
    std::from_chars(text.data() + head.size(), text.data() + text.size(), number);
  return number;
}

struct Read {
  std::string_view function;
  std::optional<Value> (*reader)(std::string& received, const CallArguments& arguments);
  std::size_t name, timeout;  ///< positions; a timeout of no argument is 2 s
  Value (*otherwise)(const CallArguments& arguments);
};
constexpr std::size_t kNone = 99;
constexpr Read kReads[] = {
    {"socket_read_string", string, 0, 4, [](const CallArguments&) { return Value(""); }},
    {"socket_read_line", line, 0, 1, [](const CallArguments&) { return Value(""); }},
    {"socket_read_ascii_float", floats, 1, 2, [](const CallArguments& a) { return nothing(count_of(a), 0); }},
    {"socket_read_binary_integer", integers, 1, 2,
     [](const CallArguments& a) { return nothing(count_of(a), -1); }},
    {"socket_read_byte_list", single_bytes, 1, 2,
     [](const CallArguments& a) { return nothing(count_of(a), -1); }},
    {"socket_get_var", variable, 1, kNone, [](const CallArguments&) { return Value(0); }},
};

}  // namespace

ScriptSockets::~ScriptSockets() {
  for (auto& [name, socket] : sockets_)
    if (socket->connection) socket->connection->finish();
}

std::string ScriptSockets::name_of(const CallArguments& arguments, std::size_t position) {
  return arguments.text(position, "socket_0");
}

Value ScriptSockets::open(const CallArguments& a) {
  const std::string& host = a.text(0);
  const double port = a.number(1);
  if (port < 1.0 || port > 65535.0) a.fail("(HOST, PORT, NAME), a port from 1 to 65535");
  const std::string name = name_of(a, 2);
  if (sockets_.size() >= kMostSockets && sockets_.count(name) == 0)
    a.fail("at most " + std::to_string(kMostSockets) + " names of sockets; socket_close() frees one");
  auto& held = sockets_[name];
  if (held && held->connection) held->connection->finish();
  held = std::make_shared<Socket>();
  held->connecting = true;
  controller_.loop().connect(controller_.mapping().address_of(host, static_cast<int>(port)),
                             static_cast<std::uint16_t>(port), 1, std::chrono::seconds(0),
                             [weak = std::weak_ptr(held)](auto connection) {
                               const auto socket = weak.lock();
                               if (!socket) return;
                               socket->connecting = false;
                               socket->connection = std::move(connection);
                               if (!socket->connection) return;
                               socket->connection->start({[weak](std::string_view bytes) {
                                                            const auto mine = weak.lock();
                                                            if (!mine) return;
                                                            mine->received.append(bytes);
                                                            if (mine->received.size() > kMostReceived)
                                                              mine->connection->close();
                                                          },
                                                          {}});
                             });
  return {};
}

bool ScriptSockets::send(const CallArguments& a, const std::string& name, const std::string& text) {
  const auto found = sockets_.find(name);
  const bool open =
      found != sockets_.end() && found->second->connection && found->second->connection->is_open();
  if (open)
    found->second->connection->send(text);
  else
    controller_.log(std::string(a.function()) + ": the socket is not open.");
  return open;
}

bool ScriptSockets::is_full(const std::string& name) const {
  const auto found = sockets_.find(name);
  return found != sockets_.end() && found->second->connection && found->second->connection->is_open() &&
         found->second->connection->waiting() > kMostUnread;
}

std::optional<Value> ScriptSockets::call(const CallArguments& a, bool begins, std::uint64_t begun_cycle) {
  const std::string_view f = a.function();
  if (f == "socket_open") {
    if (begins) open(a);
    const auto opened = sockets_.find(name_of(a, 2));
    if (opened == sockets_.end()) return false;  // another thread has closed it
    if (opened->second->connecting) return std::nullopt;
    return opened->second->connection != nullptr;
  }
  if (f == "socket_close") {
    const auto found = sockets_.find(name_of(a, 0));
    if (found == sockets_.end()) return Value();
    if (found->second->connection) found->second->connection->finish();
    sockets_.erase(found);
    return Value();
  }
  const auto* read =
      std::find_if(std::begin(kReads), std::end(kReads), [&](const Read& one) { return one.function == f; });
  if (read == std::end(kReads)) {
    const std::string name = name_of(a, f == "socket_set_var" ? 2 : 1);
    if (is_full(name)) return std::nullopt;
    if (f == "socket_set_var") {
      send(a, name, "SET " + sent_text(a[0]) + " " + sent_text(a[1]) + "\n");
      return Value();
    }
    if (f == "socket_send_line") return send(a, name, sent_text(a[0]) + "\n");
    if (f == "socket_send_string") return send(a, name, sent_text(a[0]));
    return send(a, name, big_endian(a.number(0), f == "socket_send_int" ? 4 : 1));
  }
  const std::string name = name_of(a, read->name);
  if (begins && f == "socket_get_var") send(a, name, "GET " + a.text(0) + "\n");
  const auto found = sockets_.find(name);
  if (found == sockets_.end() || !found->second->connection) return read->otherwise(a);
  if (auto value = read->reader(found->second->received, a)) return value;
  const double timeout_s = read->timeout == kNone ? kTimeout_s : a.number(read->timeout, kTimeout_s);
  const double waited_s = UrController::kCycle_s * static_cast<double>(controller_.cycle() - begun_cycle);
  if (!found->second->connection->is_open() || (timeout_s > 0.0 && waited_s >= timeout_s))
    return read->otherwise(a);
  return std::nullopt;
}

}  // namespace takt::ur
