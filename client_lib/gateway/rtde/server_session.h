#pragma once
// One RTDE connection as the controller sees it: bytes in, bytes out, no socket and no clock.
//
// A connection has one output recipe and up to 255 input recipes. Data packages are due every so many cycles of the
// controller; the caller asks for one in each cycle and sends what it gets.
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "client_lib/gateway/rtde/package.h"
#include "client_lib/gateway/rtde/variables.h"

namespace takt::rtde {

struct ControllerVersion {
  std::uint32_t major = 5, minor = 16, bugfix = 0, build = 0;
};

/// Which connection writes an input variable.
class InputOwners {
 public:
  explicit InputOwners(std::size_t variables) : owners_(variables, 0) {}
  bool may_take(std::size_t variable, std::uint64_t connection) const {
    return owners_[variable] == 0 || owners_[variable] == connection;
  }
  void take(std::size_t variable, std::uint64_t connection) { owners_[variable] = connection; }
  void release(std::uint64_t connection) {
    for (std::uint64_t& owner : owners_)
      if (owner == connection) owner = 0;
  }

 private:
  std::vector<std::uint64_t> owners_;
};

class ServerSession {
 public:
  struct Written {
    std::size_t variable;  ///< index in the input table
    Value value;
  };
  /// The inputs of one data package, in the order of its recipe.
  using OnInputs = std::function<void(const std::vector<Written>&)>;

  /// All outlive the session. `connection`: not 0, unique among the users of `owners`.
  ServerSession(const Table& outputs, const Table& inputs, InputOwners& owners, std::uint64_t connection,
                ControllerVersion version, double cycle_s, OnInputs on_inputs)
      : outputs_(outputs),
        inputs_(inputs),
        owners_(owners),
        connection_(connection),
        version_(version),
        cycle_s_(cycle_s),
        on_inputs_(std::move(on_inputs)) {}
  ServerSession(const ServerSession&) = delete;
  ServerSession& operator=(const ServerSession&) = delete;
  /// Its input variables become free; their values stay.
  ~ServerSession() { owners_.release(connection_); }

  /// The replies to what has come.
  std::string receive(std::string_view bytes);
  /// The stream is no RTDE: the connection is to be closed.
  bool broken() const { return splitter_.broken(); }
  /// A data package with the present values if one is due in this cycle, else nothing.
  std::string data(std::uint64_t cycle) const;
  bool started() const { return started_; }
  int protocol() const { return protocol_; }

 private:
  std::string reply(const Package& request);
  std::string set_up_outputs(std::string_view payload);
  std::string set_up_inputs(std::string_view payload);
  std::string take_data(std::string_view payload);

  const Table& outputs_;
  const Table& inputs_;
  InputOwners& owners_;
  const std::uint64_t connection_;
  const ControllerVersion version_;
  const double cycle_s_;
  OnInputs on_inputs_;
  Splitter splitter_;
  int protocol_ = 1;
  bool started_ = false;
  std::vector<std::size_t> output_recipe_;               ///< empty: not set up
  std::uint64_t every_ = 1;                              ///< cycles between two data packages
  std::vector<std::vector<std::size_t>> input_recipes_;  ///< number i + 1
};

}  // namespace takt::rtde
