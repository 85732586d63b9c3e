#pragma once
// What takt and its program takt-fmu-host say to each other over a socket pair: a request, its answer, and so on. A message is
// its length (uint32) and its bytes (plant_models/state_bytes.h). The host has the socket as file descriptor 3.
#include <sys/socket.h>
#include <sys/types.h>

#include <cerrno>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "plant_models/state_bytes.h"
#include "server/fmu/model_description.h"

namespace takt::fmu_wire {

inline constexpr int kSocket = 3;
inline constexpr std::uint32_t kLongestMessage = std::uint32_t{512} << 20U;
inline constexpr std::size_t kMost = 1U << 20U;  ///< of anything that is counted

enum class Request : std::uint8_t { start, step, save, load, end };
enum class Answer : std::uint8_t { good, failed };

/// A variable, or one element of an array. An array is written as a whole: the elements that are no signals keep `start`.
struct Place {
  std::string name;  ///< for errors
  FmuType type = FmuType::float64;
  std::uint32_t reference = 0;
  std::uint64_t elements = 1, element = 0;
  std::vector<std::string> start{};     ///< of an input that is an array: by element
  std::vector<std::uint32_t> clocks{};  ///< of an input that can be set at their ticks alone
};

/// A value that is set once, ahead of the initialisation: all elements.
struct Setting {
  std::string name;  ///< for errors
  FmuType type = FmuType::float64;
  std::uint32_t reference = 0;
  bool structural = false;  ///< set in configuration mode (FMI 3.0)
  std::vector<std::string> values{};
};

struct Clock {
  std::uint32_t reference = 0;
  double interval_s = 1.0, shift_s = 0.0;
};

struct Start {
  int version = 2;
  std::string instance, token, library, resources;
  std::uint64_t memory_bytes = 0;
  bool can_copy_state = false, can_serialise_state = false;
  double tolerance = 0.0;  ///< relative, of its solver; 0: the FMU chooses
  std::vector<Setting> settings{};
  std::vector<Place> inputs{}, outputs{};
  bool event_mode = false;  ///< each step begins with an event
  std::vector<Clock> clocks{};
};

inline void put(StateWriter& out, const std::vector<std::string>& texts) {
  out.put_size(texts.size());
  for (const std::string& text : texts) out.put(std::string_view(text));
}
inline std::vector<std::string> texts(StateReader& in) {
  std::vector<std::string> result(in.size(kMost, "texts"));
  for (std::string& text : result) text = in.text(kMost, "letters");
  return result;
}
inline void put(StateWriter& out, const std::vector<Place>& places) {
  out.put_size(places.size());
  for (const Place& place : places) {
    out.put(std::string_view(place.name)), out.put(place.type), out.put(place.reference),
        out.put(place.elements), out.put(place.element);
    put(out, place.start);
    out.put_size(place.clocks.size());
    for (const std::uint32_t clock : place.clocks) out.put(clock);
  }
}
inline std::vector<Place> places(StateReader& in) {
  std::vector<Place> result(in.size(kMost, "variables"));
  for (Place& place : result) {
    place.name = in.text(kMost, "letters");
    place.type = static_cast<FmuType>(in.integer(0, static_cast<int>(FmuType::clock), "a type"));
    place.reference = in.get<std::uint32_t>();
    place.elements = in.get<std::uint64_t>(), place.element = in.get<std::uint64_t>();
    place.start = texts(in);
    place.clocks.resize(in.size(kMost, "clocks"));
    for (std::uint32_t& clock : place.clocks) clock = in.get<std::uint32_t>();
  }
  return result;
}
inline void put(StateWriter& out, const Start& start) {
  out.put(start.version);
  for (const std::string* text : {&start.instance, &start.token, &start.library, &start.resources})
    out.put(std::string_view(*text));
  out.put(start.memory_bytes), out.put(start.can_copy_state), out.put(start.can_serialise_state);
  out.put(start.tolerance);
  out.put_size(start.settings.size());
  for (const Setting& setting : start.settings) {
    out.put(std::string_view(setting.name)), out.put(setting.type), out.put(setting.reference);
    out.put(setting.structural);
    put(out, setting.values);
  }
  put(out, start.inputs), put(out, start.outputs);
  out.put(start.event_mode);
  out.put_size(start.clocks.size());
  for (const Clock& clock : start.clocks)
    out.put(clock.reference), out.put(clock.interval_s), out.put(clock.shift_s);
}
inline Start read_start(StateReader& in) {
  Start start;
  start.version = in.integer<int>(2, 3, "the version of FMI");
  for (std::string* text : {&start.instance, &start.token, &start.library, &start.resources})
    *text = in.text(kMost, "letters");
  start.memory_bytes = in.get<std::uint64_t>();
  start.can_copy_state = in.flag("a flag"), start.can_serialise_state = in.flag("a flag");
  start.tolerance = in.get<double>();
  start.settings.resize(in.size(kMost, "settings"));
  for (Setting& setting : start.settings) {
    setting.name = in.text(kMost, "letters");
    setting.type = static_cast<FmuType>(in.integer(0, static_cast<int>(FmuType::clock), "a type"));
    setting.reference = in.get<std::uint32_t>();
    setting.structural = in.flag("a flag");
    setting.values = texts(in);
  }
  start.inputs = places(in), start.outputs = places(in);
  start.event_mode = in.flag("a flag");
  start.clocks.resize(in.size(kMost, "clocks"));
  for (Clock& clock : start.clocks) {
    clock.reference = in.get<std::uint32_t>();
    clock.interval_s = in.get<double>(), clock.shift_s = in.get<double>();
  }
  return start;
}

/// Whole messages. False if the other side has ended.
inline bool send_bytes(int socket, const void* from, std::size_t size) {
  const auto* bytes = static_cast<const char*>(from);
  while (size > 0) {
    const ssize_t sent = ::send(socket, bytes, size, MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) return false;
    bytes += sent, size -= static_cast<std::size_t>(sent);
  }
  return true;
}
inline bool send_message(int socket, const std::vector<std::byte>& message) {
  const auto length = static_cast<std::uint32_t>(message.size());
  return send_bytes(socket, &length, sizeof length) && send_bytes(socket, message.data(), message.size());
}

}  // namespace takt::fmu_wire
