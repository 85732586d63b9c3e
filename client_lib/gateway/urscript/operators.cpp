#include "client_lib/gateway/urscript/operators.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace takt::urscript {
namespace {

constexpr std::array<std::string_view, 14> kNames{
    "+", "-", "*", "/", "%", "==", "!=", "<", "<=", ">", ">=", "xor", "-", "not"};

[[noreturn]] void mismatch(Operator op, const Value& a, const Value& b) {
  throw ValueError("type_error: " + std::string(kNames.at(static_cast<std::size_t>(op))) + " of " +
                   a.type_name() + " and " + b.type_name());
}

bool is_matrix(const Value& value) {
  const Items* list = value.list();
  return list != nullptr && !list->values.empty() && list->values.front().list() != nullptr;
}

Value arithmetic(Operator op, const Value& a, const Value& b) {
  const double x = a.number(), y = b.number();
  const bool whole = a.is_integer() && b.is_integer();
  const auto result = [whole](double number) {
    return whole ? Value::whole(finite(number)) : Value(finite(number));
  };
  switch (op) {
    case Operator::add:
      return result(x + y);
    case Operator::subtract:
      return result(x - y);
    case Operator::multiply:
      return result(x * y);
    case Operator::divide:
    case Operator::modulo: {
      if (y == 0.0) throw ValueError("division by zero");
      if (op == Operator::modulo) return result(x - y * std::floor(x / y));
      const double quotient = finite(x / y);
      return whole && quotient == std::floor(quotient) ? Value::whole(quotient) : Value(quotient);
    }
    default:
      throw ValueError("type_error: no operator of numbers");
  }
}

std::vector<std::vector<double>> matrix_of(const Items& rows) {
  std::vector<std::vector<double>> matrix;
  for (const Value& row : rows.values) {
    matrix.push_back(numbers_of(row));
    if (matrix.back().size() != matrix.front().size())
      throw ValueError("the rows of a matrix have one length");
  }
  return matrix;
}

/// matrix * matrix, matrix * list.
Value product(const Items& rows, const Value& b) {
  const auto left = matrix_of(rows);
  const bool by_matrix = is_matrix(b);
  std::vector<std::vector<double>> right;
  if (by_matrix)
    right = matrix_of(*b.list());
  else
    for (const double one : numbers_of(b)) right.push_back({one});
  if (left.front().size() != right.size() || right.empty())
    throw ValueError("the columns of the first matrix are not as many as the rows of the second operand");
  std::vector<Value> result;
  for (const auto& row : left) {
    std::vector<double> line(right.front().size(), 0.0);
    for (std::size_t k = 0; k < right.size(); ++k)
      for (std::size_t j = 0; j < line.size(); ++j) line[j] += row[k] * right[k][j];
    for (const double one : line) finite(one);
    result.push_back(by_matrix ? Value(line) : Value(line.front()));
  }
  return Value::list(std::move(result));
}

Value elements(Operator op, const Value& a, const Value& b) {
  const Items *left = a.list(), *right = b.list();
  if (op == Operator::multiply && is_matrix(a) && right != nullptr) return product(*left, b);
  if ((left == nullptr && !a.is_number()) || (right == nullptr && !b.is_number())) mismatch(op, a, b);
  if (left != nullptr && right != nullptr && left->values.size() != right->values.size())
    throw ValueError("the lists have " + std::to_string(left->values.size()) + " and " +
                     std::to_string(right->values.size()) + " elements");
  std::vector<Value> result;
  const std::size_t count = (left != nullptr ? left : right)->values.size();
  for (std::size_t i = 0; i < count; ++i)
    result.push_back(
        apply(op, left != nullptr ? left->values[i] : a, right != nullptr ? right->values[i] : b));
  return Value::list(std::move(result));
}

std::size_t position(const Value& index, std::size_t size) {
  const double number = index.is_number() ? index.number() : -1.0;
  if (!(number >= 0.0) || number != std::floor(number) || number >= static_cast<double>(size))
    throw ValueError("index " + text_of(index) + " is out of range; allowed: 0 to " +
                     std::to_string(size == 0 ? 0 : size - 1));
  return static_cast<std::size_t>(number);
}

std::size_t place_in(const Value& value, const Step& step, const Value* index) {
  const Items* items = value.items();
  if (items == nullptr)
    throw ValueError(std::string("type_error: ") + value.type_name() + " has no " +
                     (index != nullptr ? "elements" : "member " + step.member));
  if (index != nullptr) return position(*index, items->values.size());
  if (!items->names)
    throw ValueError(std::string("type_error: ") + value.type_name() + " has no member " + step.member);
  const auto found = std::find(items->names->begin(), items->names->end(), step.member);
  if (found == items->names->end()) throw ValueError("the struct has no member " + step.member);
  return static_cast<std::size_t>(found - items->names->begin());
}

Value with_element(const Value& value, std::size_t at, Value element) {
  const Items& items = *value.items();
  if (!items.values[at].same_type(element))
    throw ValueError(std::string("type_error: an element that is ") + items.values[at].type_name() +
                     " cannot become " + element.type_name());
  std::vector<Value> values = items.values;
  values[at] = std::move(element);
  if (items.kind == Items::Kind::pose) return Value::pose(std::move(values));
  if (items.kind == Items::Kind::record) return Value::record(std::move(values), items.names);
  return Value::list(std::move(values), items.capacity);
}

struct Method {
  std::string_view name;
  std::size_t arguments;
  bool mutates;
};
constexpr std::array<Method, 8> kMethods{{{"length", 0, false},
                                          {"capacity", 0, false},
                                          {"to_string", 0, false},
                                          {"append", 1, true},
                                          {"pop", 0, true},
                                          {"insert", 2, true},
                                          {"remove", 1, true},
                                          {"clear", 0, true}}};

const Method* method_of(std::string_view name) {
  const auto found =
      std::find_if(kMethods.begin(), kMethods.end(), [&](const Method& m) { return m.name == name; });
  return found == kMethods.end() ? nullptr : &*found;
}

}  // namespace

double finite(double number) {
  if (!std::isfinite(number)) throw ValueError("the result is no finite number");
  return number;
}

bool truth_of(const Value& value) {
  if (value.flag() == nullptr)
    throw ValueError(std::string("type_error: True or False is expected, found ") + value.type_name());
  return *value.flag();
}

Value apply(Operator op, const Value& a, const Value& b) {
  switch (op) {
    case Operator::equal:
    case Operator::unequal:
      if (a.is_none() || !a.same_type(b)) mismatch(op, a, b);
      return (a == b) == (op == Operator::equal);
    case Operator::less:
    case Operator::less_equal:
    case Operator::greater:
    case Operator::greater_equal: {
      if (!a.is_number() || !b.is_number()) mismatch(op, a, b);
      const double x = a.number(), y = b.number();
      return op == Operator::less         ? x < y
             : op == Operator::less_equal ? x <= y
             : op == Operator::greater    ? x > y
                                          : x >= y;
    }
    case Operator::logical_xor:
      return truth_of(a) != truth_of(b);
    default:
      return a.is_number() && b.is_number() ? arithmetic(op, a, b) : elements(op, a, b);
  }
}

Value apply(Operator op, const Value& a) {
  if (op == Operator::logical_not) return !truth_of(a);
  if (a.is_number()) return a.is_integer() ? Value::whole(-a.number()) : Value(-a.number());
  if (a.list() != nullptr) return elements(Operator::multiply, a, -1);
  throw ValueError(std::string("type_error: - of ") + a.type_name());
}

Value part_of(const Value& value, const Step& step, std::span<const Value> indices) {
  if (step.indices == 0) {
    const std::size_t at = place_in(value, step, nullptr);
    return value.items()->values[at];
  }
  Value part = value;
  for (const Value& index : indices.subspan(0, step.indices)) {
    const std::size_t at = place_in(part, step, &index);
    Value inner = part.items()->values[at];
    part = std::move(inner);
  }
  return part;
}

Value with_part(const Value& value, std::span<const Step> steps, std::span<const Value> indices,
                const Value& part) {
  if (steps.empty()) return part;
  const Step& step = steps.front();
  if (step.indices == 0) {
    const std::size_t at = place_in(value, step, nullptr);
    return with_element(value, at, with_part(value.items()->values[at], steps.subspan(1), indices, part));
  }
  // The indices of one step go down one after another.
  const std::size_t at = place_in(value, step, &indices.front());
  const Value& inner = value.items()->values[at];
  if (step.indices == 1)
    return with_element(value, at, with_part(inner, steps.subspan(1), indices.subspan(1), part));
  std::vector<Step> rest{{step.indices - 1, {}}};
  rest.insert(rest.end(), steps.begin() + 1, steps.end());
  return with_element(value, at, with_part(inner, rest, indices.subspan(1), part));
}

bool is_list_method(std::string_view name) {
  return method_of(name) != nullptr;
}

bool is_mutator(std::string_view name) {
  return method_of(name) != nullptr && method_of(name)->mutates;
}

MethodResult call_method(const Value& list, std::string_view name, std::span<const Value> arguments) {
  const Method* method = method_of(name);
  const Items* items = list.list();
  if (method == nullptr || items == nullptr)
    throw ValueError(
        "type_error: " + std::string(list.type_name()) + " has no method " + std::string(name) +
        (list.record() != nullptr ? "; a remote procedure must not have a name of a list's method" : ""));
  if (arguments.size() != method->arguments)
    throw ValueError(std::string(name) + ": allowed: " + std::to_string(method->arguments) + " arguments");
  std::vector<Value> values = items->values;
  Value result;
  const auto at = [&](std::size_t size) { return static_cast<std::ptrdiff_t>(position(arguments[0], size)); };
  if (name == "length") return {list, static_cast<int>(values.size())};
  if (name == "capacity") return {list, static_cast<int>(items->capacity)};
  if (name == "to_string") return {list, text_of(list)};
  if ((name == "append" || name == "insert") && values.size() >= items->capacity)
    throw ValueError(std::string(name) + ": the list has its capacity of " + std::to_string(items->capacity) +
                     " elements; make_list(length, initial_value, capacity) makes a longer one");
  if (name == "append") {
    values.push_back(arguments[0]);
  } else if (name == "insert") {
    values.insert(values.begin() + at(values.size() + 1), arguments[1]);
  } else if (name == "clear") {
    values.clear();
  } else {
    if (values.empty()) throw ValueError(std::string(name) + ": the list is empty");
    const auto place = name == "pop" ? values.end() - 1 : values.begin() + at(values.size());
    result = *place;
    values.erase(place);
  }
  return {Value::list(std::move(values), items->capacity), result};
}

}  // namespace takt::urscript
