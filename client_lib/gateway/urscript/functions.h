#pragma once
// The functions of URScript that takt knows: one table, from which calls are checked, refusals are worded and
// docs/urscript.md is written (takt-ur functions).
#include <span>

#include "client_lib/gateway/urscript/value.h"

namespace takt::urscript {

struct Function {
  enum class Kind : std::uint8_t {
    computes,  ///< a function of its arguments alone
    solves,    ///< the same, with the robot's kinematics
    reads,     ///< the robot's state and its inputs
    sets,      ///< at once; may stand between two moves that are blended
    reports,   ///< the same, to log and clients
    acts,      ///< may take time
    ignored,   ///< accepted without an effect
    moves,     ///< the robot: such a program is never a secondary one
    refused    ///< `does` is the reason
  };
  std::string_view name;
  std::string_view parameters;  ///< "q, a=1.4": those with '=' may be left out
  Kind kind;
  std::string_view does;
};

/// The name of the function that calls a procedure of a handle of rpc_factory(). Its arguments: handle, name, those of the
/// procedure.
inline constexpr std::string_view kRemoteCall = "HANDLE.PROCEDURE";
/// What rpc_factory() returns.
bool is_rpc_handle(const Value& value);

/// In the order of the documentation.
std::span<const Function> functions();
/// nullptr: unknown.
const Function* find_function(std::string_view name);

struct Signature {
  std::vector<std::string_view> names{};
  std::size_t required = 0;
};
const Signature& signature_of(const Function& function);

/// Of a function that computes. Throws ValueError. `arguments`: one for each parameter, no value where it is left out.
Value compute(const Function& function, std::span<const Value> arguments);

/// docs/urscript.md.
std::string functions_page();

}  // namespace takt::urscript
