// takt-fmu-host: one FMU in a process of its own. takt starts it; it ends with the socket to takt (fmu_wire.h), whatever the FMU
// does at that time.
#include <dlfcn.h>
#include <fenv.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <clocale>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <thread>

#include "server/tools/takt_fmu_host/confinement.h"
#include "server/tools/takt_fmu_host/fmi_instance.h"

namespace takt::fmu_host {

std::string& last_message() {
  static std::string message;
  return message;
}

std::string with_message(std::string message) {
  if (!last_message().empty()) message += ": \"" + last_message() + "\"";
  return message;
}

std::string no_instance(const char* call, const char* token, const std::string& value) {
  std::string sentence = std::string(call) + " returned no instance";
  if (last_message().empty())
    return sentence + "; usually the " + token + " of its description, '" + value.substr(0, 100) +
           "', is not that of its library";
  return with_message(std::move(sentence));
}

namespace {

/// The interpreter of Python that this machine has: the newest. False: none.
bool open_python() {
  for (int minor = 30; minor >= 8; --minor)
    if (::dlopen(("libpython3." + std::to_string(minor) + ".so.1.0").c_str(), RTLD_NOW | RTLD_GLOBAL) !=
        nullptr)
      return true;
  return false;
}

std::string loader_error() {
  const char* why = ::dlerror();
  return why != nullptr ? why : "";
}

}  // namespace

void* open_library(const std::string& file) {
  void* library = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) {
    std::string reason = loader_error();
    // Of FMUs that are written in Python some name no interpreter.
    if (const bool python = reason.find("undefined symbol: Py") != std::string::npos ||
                            reason.find("undefined symbol: _Py") != std::string::npos;
        python) {
      if (!open_python())
        throw FmiError("its library needs Python, which this machine does not have: install libpython3. " +
                       reason);
      library = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
      if (library != nullptr) return library;
      reason = loader_error();
    }
    // Of another file that it needs.
    const bool needs = reason.find("cannot open shared object file") != std::string::npos;
    throw FmiError("its library cannot be loaded: " + reason +
                   (needs ? ". The FMU needs this library of the system" : ""));
  }
  return library;
}

namespace {

using fmu_wire::Answer;
using fmu_wire::Request;

std::string short_text(double number) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g", number);
  return text.data();
}

bool receive(void* to, std::size_t size) {
  auto* bytes = static_cast<char*>(to);
  while (size > 0) {
    const ssize_t got = ::recv(fmu_wire::kSocket, bytes, size, 0);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    bytes += got, size -= static_cast<std::size_t>(got);
  }
  return true;
}

/// Ends the process when takt has ended, even while the FMU hangs.
void end_with_takt() {
  std::thread([] {
    pollfd one{fmu_wire::kSocket, POLLRDHUP, 0};
    while (::poll(&one, 1, -1) < 0 && errno == EINTR) {
    }
    ::_exit(0);
  }).detach();
}

/// The control of floating-point arithmetic: rounding, exceptions, and on x86 whether small numbers become zero.
struct FloatingPoint {
  fenv_t environment{};
  FloatingPoint() { ::fegetenv(&environment); }
  bool same_control(const FloatingPoint& other) const {
#if defined(__x86_64__)
    constexpr unsigned kFlags = 0x3fU;  // what has happened, not what is to be done
    return environment.__control_word == other.environment.__control_word &&
           (environment.__mxcsr & ~kFlags) == (other.environment.__mxcsr & ~kFlags);
#else
    return std::memcmp(&environment, &other.environment, sizeof environment) == 0;
#endif
  }
};

class Host {
 public:
  Host() : usual_directory_(std::filesystem::current_path()) {}

  /// Until takt has ended.
  void serve() {
    std::uint32_t length = 0;
    while (receive(&length, sizeof length) && length <= fmu_wire::kLongestMessage) {
      std::vector<std::byte> request(length);
      if (!receive(request.data(), length)) return;
      std::vector<std::byte> content;
      std::string failure;
      try {
        answer(request, content);
      } catch (const std::bad_alloc&) {
        failure = "the FMU has no memory left (memory_MiB)";
      } catch (const std::exception& error) {
        failure = error.what();
      } catch (...) {
        failure = "the FMU threw an exception";
      }
      std::vector<std::byte> message;
      StateWriter out(message);
      out.put(failure.empty() ? Answer::good : Answer::failed);
      out.put(std::string_view(failure));
      out.put(std::string_view(notice_));
      notice_.clear();
      if (failure.empty()) message.insert(message.end(), content.begin(), content.end());
      if (!fmu_wire::send_message(fmu_wire::kSocket, message)) return;
    }
  }

 private:
  void answer(const std::vector<std::byte>& bytes, std::vector<std::byte>& content) {
    StateReader in(bytes, "a request");
    StateWriter out(content);
    switch (static_cast<Request>(in.integer(0, static_cast<int>(Request::end), "a request"))) {
      case Request::start: {
        const fmu_wire::Start start = fmu_wire::read_start(in);
        if (instance_) throw FmiError("the FMU has been started");
        load(start);
        guarded([&] { instance_->start(outputs_); });
        return put_outputs(out);
      }
      case Request::step: {
        const double t = in.get<double>(), h = in.get<double>();
        for (double& input : inputs_) input = in.get<double>();
        guarded([&] { running().step(t, h, inputs_, outputs_); });
        return put_outputs(out);
      }
      case Request::save:
        return guarded([&] { running().save(content); });
      case Request::load:
        return guarded([&] { running().load(in.rest()); });
      case Request::end:
        break;
    }
    ::_exit(0);
  }

  FmiInstance& running() {
    if (!instance_) throw FmiError("the FMU has not been started");
    return *instance_;
  }

  void load(const fmu_wire::Start& start) {
    std::filesystem::current_path(std::filesystem::path(start.resources).parent_path());
    usual_directory_ = std::filesystem::current_path();
    if (const std::string open = confine(usual_directory_.string()); !open.empty())
      notice_ = "the FMU " + open;
    ::setenv("TMPDIR", usual_directory_.c_str(), 1);  // where it can write
    limit_memory(start.memory_bytes);
    // dlopen runs code of the FMU.
    guarded([&] { instance_ = start.version == 2 ? load_fmi2(start) : load_fmi3(start); });
    inputs_.assign(start.inputs.size(), 0.0), outputs_.assign(start.outputs.size(), 0.0);
    for (const fmu_wire::Place& place : start.outputs) output_names_.push_back(place.name);
  }

  /// Calls the FMU; what it has changed for its whole process is put back, and noted once.
  template <class Call>
  void guarded(const Call& call) {
    last_message().clear();
    const FloatingPoint before;
    const auto after = [&] {
      const FloatingPoint now;
      if (!now.same_control(before))
        note("changed the floating-point control (rounding, exceptions or denormal numbers)", noted_control_);
      ::fesetenv(&before.environment);
      if (const char* locale = std::setlocale(LC_NUMERIC, nullptr);
          locale == nullptr || std::strcmp(locale, "C") != 0) {
        std::setlocale(LC_ALL, "C");
        note("changed the locale", noted_locale_);
      }
      std::error_code unknown;
      if (std::filesystem::current_path(unknown) != usual_directory_) {
        std::filesystem::current_path(usual_directory_, unknown);
        note("changed the working directory", noted_directory_);
      }
    };
    try {
      call();
    } catch (...) {
      after();
      throw;
    }
    after();
  }

  void note(const char* what, bool& noted) {
    if (!std::exchange(noted, true))
      notice_ = std::string("the FMU ") + what +
                ", which FMI forbids; it was put back, and its results may differ from those elsewhere";
  }

  void put_outputs(StateWriter& out) const {
    for (std::size_t i = 0; i < outputs_.size(); ++i)
      if (!std::isfinite(outputs_[i]) || std::abs(outputs_[i]) > StateReader::kLargest)
        throw FmiError("the output '" + output_names_[i] + "' of the FMU is " + short_text(outputs_[i]) +
                       "; takt takes numbers up to " + short_text(StateReader::kLargest) +
                       ". The key outputs can leave it out");
    out.put(std::span<const double>(outputs_));
  }

  std::unique_ptr<FmiInstance> instance_;
  std::vector<double> inputs_, outputs_;
  std::vector<std::string> output_names_;
  std::string notice_;
  std::filesystem::path usual_directory_;
  bool noted_control_ = false, noted_locale_ = false, noted_directory_ = false;
};

}  // namespace
}  // namespace takt::fmu_host

int main() {
  struct stat what {};
  if (::fstat(takt::fmu_wire::kSocket, &what) != 0 || !S_ISSOCK(what.st_mode)) {
    std::fputs(
        "takt-fmu-host: takt-run and takt-server start this program for each FMU of a scenario; it does "
        "nothing by itself\n",
        stderr);
    return 2;
  }
  try {
    takt::fmu_host::end_with_takt();
    takt::fmu_host::Host().serve();
  } catch (const std::exception&) {
    ::_exit(3);
  }
  ::_exit(0);  // destructors of the FMU do not run: it may be broken
}
