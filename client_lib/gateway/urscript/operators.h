#pragma once
// Operators of URScript on values. All throw ValueError.
#include <span>

#include "client_lib/gateway/urscript/value.h"

namespace takt::urscript {

enum class Operator : std::uint8_t {
  add,
  subtract,
  multiply,
  divide,
  modulo,
  equal,
  unequal,
  less,
  less_equal,
  greater,
  greater_equal,
  logical_xor,
  negate,
  logical_not
};

/// Of numbers; of lists element by element; matrix * matrix, matrix * list; a list with a number.
Value apply(Operator binary, const Value& a, const Value& b);
Value apply(Operator unary, const Value& a);
/// Throws for infinities and NaN.
double finite(double number);
/// Throws where it is neither True nor False.
bool truth_of(const Value& value);

/// A step from a value to a part of it.
struct Step {
  std::size_t indices = 0;  ///< 0: a member
  std::string member{};
};
/// value[i], value[i, j], value.member. `indices`: as many as the step has.
Value part_of(const Value& value, const Step& step, std::span<const Value> indices);
/// The value with the part at the end of the steps replaced. `indices`: those of all steps.
Value with_part(const Value& value, std::span<const Step> steps, std::span<const Value> indices,
                const Value& part);

/// A method of lists: length, capacity, append, pop, insert, remove, clear, to_string.
struct MethodResult {
  Value list;    ///< as it is afterwards
  Value result;  ///< what the call returns
};
MethodResult call_method(const Value& list, std::string_view method, std::span<const Value> arguments);
bool is_list_method(std::string_view name);
/// It changes the list.
bool is_mutator(std::string_view name);

}  // namespace takt::urscript
