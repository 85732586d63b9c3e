#pragma once
// Reads the named text arguments of one control request; the first thing wrong is kept as a sentence.
#include <array>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "server/runtime/requests/control.h"

namespace takt {

class RequestArguments {
 public:
  /// `request` must outlive this. An argument that is not allowed, or given twice, is a failure.
  RequestArguments(const ControlRequest& request, std::initializer_list<std::string_view> allowed);

  /// nullptr when it was not given.
  const std::string* find(std::string_view name) const;
  /// Must be there and not be empty; `what` says what it is for.
  std::string text(std::string_view name, std::string_view what);
  /// Without a fallback it must be there.
  double real(std::string_view name, std::optional<double> fallback, double low, double high);
  std::uint64_t natural(std::string_view name, std::optional<std::uint64_t> fallback, std::uint64_t low,
                        std::uint64_t high);
  /// Finite numbers separated by spaces or commas, exactly as many as `values` holds; left as they are when
  /// the argument was not given. True when it was.
  bool reals(std::string_view name, std::initializer_list<double*> values);

  void fail_value(std::string_view name, const std::string* value, const std::string& allowed);
  void fail(const std::string& what);
  bool failed() const { return error_.has_value(); }

  /// The action, or the reply that says what was wrong with the arguments.
  template <typename Action>
  std::variant<Action, ControlReply> result(Action action) const {
    if (error_) return ControlReply{request_.id, ControlResult::failed, *error_, {}};
    return action;
  }

 private:
  const ControlRequest& request_;
  std::optional<std::string> error_;
};

}  // namespace takt
