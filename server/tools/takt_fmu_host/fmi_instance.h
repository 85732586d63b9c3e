#pragma once
// One instance of a co-simulation FMU in a shared library, by FMI 2.0 or 3.0.
#include <dlfcn.h>

#include <cstddef>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/fmu/fmu_wire.h"

namespace takt::fmu_host {

/// A sentence: what a function of the FMU answered, with the FMU's own words.
class FmiError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class FmiInstance {
 public:
  virtual ~FmiInstance() = default;
  // All throw FmiError.
  /// Instantiates and initialises at time 0; once.
  virtual void start(std::span<double> outputs) = 0;
  virtual void step(double t, double h, std::span<const double> inputs, std::span<double> outputs) = 0;
  virtual void save(std::vector<std::byte>& state) = 0;
  virtual void load(std::span<const std::byte> state) = 0;
};

/// Loads the library.
std::unique_ptr<FmiInstance> load_fmi2(const fmu_wire::Start& start);
std::unique_ptr<FmiInstance> load_fmi3(const fmu_wire::Start& start);

/// The FMU's newest message about an error, as its logger got it; written by both versions.
std::string& last_message();
/// `message`, with the last message of the FMU if it has one.
std::string with_message(std::string message);
/// Why there is no instance: the FMU's own words, or else the usual reason. `token`: its name and value.
std::string no_instance(const char* call, const char* token, const std::string& value);
/// Functions of a shared library. Throws FmiError.
void* open_library(const std::string& file);

/// A function of the library. Some tools leave out those that their FMUs do not need.
template <class Type>
class Function {
 public:
  void find(void* library, const char* name) {
    name_ = name;
    call_ = reinterpret_cast<Type*>(::dlsym(library, name));
  }
  explicit operator bool() const { return call_ != nullptr; }
  void require() const {
    if (call_ == nullptr) throw FmiError(std::string("its library has no function ") + name_);
  }
  template <class... Arguments>
  auto operator()(Arguments... arguments) const {
    require();
    return call_(arguments...);
  }

 private:
  Type* call_ = nullptr;
  const char* name_ = "";
};

}  // namespace takt::fmu_host
