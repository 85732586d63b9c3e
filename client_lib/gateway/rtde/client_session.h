#pragma once
// One RTDE connection as a client sees it: bytes in, bytes out, no socket and no clock. It asks for protocol 2, sets up
// one output and at most one input recipe, starts, and keeps the newest values.
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client_lib/gateway/rtde/package.h"
#include "client_lib/gateway/rtde/variables.h"

namespace takt::rtde {

class ClientSession {
 public:
  ClientSession(std::vector<std::string> outputs, std::vector<std::string> inputs, double frequency_Hz)
      : outputs_(std::move(outputs)), inputs_(std::move(inputs)), frequency_Hz_(frequency_Hz) {}

  /// The first request.
  std::string begin() const;
  /// What is to be sent in answer. `on_data` is called for the newest data package alone.
  std::string receive(std::string_view bytes, const std::function<void()>& on_data);
  /// Data of the input recipe, one value for each name; nothing before the controller has accepted it.
  std::string inputs(const std::vector<Value>& values) const;
  bool started() const { return stage_ == Stage::started; }
  /// Of a requested output; zero before the first package.
  const Value& value(const std::string& name) const;
  /// Why the session cannot go on; it is closed then.
  const std::string& failure() const { return failure_; }
  /// Texts of the controller.
  std::vector<std::string> take_messages() { return std::exchange(messages_, {}); }

 private:
  enum class Stage : std::uint8_t { version, outputs, inputs, start, started };
  std::string step(const Package& package);
  std::string set_up_inputs();
  std::string fail(const std::string& sentence) {
    failure_ = sentence;
    return {};
  }
  bool take_types(std::string_view list, const std::vector<std::string>& names, std::vector<Type>& types);

  std::vector<std::string> outputs_, inputs_;
  double frequency_Hz_;
  Stage stage_ = Stage::version;
  Splitter splitter_;
  std::vector<Type> output_types_, input_types_;
  std::uint8_t output_recipe_ = 0, input_recipe_ = 0;
  std::map<std::string, Value> values_;
  std::string failure_;
  std::vector<std::string> messages_;
};

}  // namespace takt::rtde
