#include "client_lib/gateway/urscript/value.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace takt::urscript {
namespace {

constexpr std::size_t kBytesPerCell = 16;

}  // namespace

Value::Value(std::string text) {
  if (text.size() > kMostTextBytes)
    throw ValueError("a text has more than " + std::to_string(kMostTextBytes) + " bytes");
  data_ = std::make_shared<const std::string>(std::move(text));
}

Value Value::make(Items items) {
  for (const Value& value : items.values) {
    items.weight += value.weight();
    if (const Items* inner = value.items()) items.depth = std::max(items.depth, 1 + inner->depth);
  }
  if (items.weight > kMostWeight)
    throw ValueError("a list has more than " + std::to_string(kMostWeight) + " cells (a number is one)");
  if (items.depth > kMostDepth)
    throw ValueError("lists lie more than " + std::to_string(kMostDepth) + " deep in one another");
  Value value;
  value.data_ = std::make_shared<const Items>(std::move(items));
  return value;
}

Value Value::list(std::vector<Value> values, std::size_t capacity) {
  for (const Value& value : values)
    if (value.is_none() || !values.front().same_type(value))
      throw ValueError(std::string("a list has elements of one type; found ") + values.front().type_name() +
                       " and " + value.type_name());
  const std::size_t size = values.size();
  return make({Items::Kind::list, std::move(values), {}, std::max(capacity, size)});
}

Value::Value(const std::vector<double>& numbers) {
  *this = list(std::vector<Value>(numbers.begin(), numbers.end()));
}

Value Value::pose(std::vector<Value> values) {
  if (values.size() != 6 ||
      !std::all_of(values.begin(), values.end(), [](const Value& v) { return v.is_number(); }))
    throw ValueError("a pose is p[x, y, z, rx, ry, rz], six numbers");
  for (Value& value : values) value = value.number();
  return make({Items::Kind::pose, std::move(values), {}, 6});
}

Value Value::pose(const std::vector<double>& numbers) {
  return pose(std::vector<Value>(numbers.begin(), numbers.end()));
}

Value Value::record(std::vector<Value> values, MemberNames names) {
  for (const Value& value : values)
    if (value.is_none()) throw ValueError("a member of a struct has no value");
  const std::size_t size = values.size();
  return make({Items::Kind::record, std::move(values), std::move(names), size});
}

Value Value::whole(double number) {
  if (number >= -2147483648.0 && number <= 2147483647.0) return static_cast<int>(number);
  return number;
}

const std::string* Value::text() const {
  const auto* held = std::get_if<std::shared_ptr<const std::string>>(&data_);
  return held == nullptr ? nullptr : held->get();
}

const Items* Value::items() const {
  const auto* held = std::get_if<std::shared_ptr<const Items>>(&data_);
  return held == nullptr ? nullptr : held->get();
}

std::size_t Value::weight() const {
  if (const Items* inner = items()) return inner->weight;
  if (const std::string* held = text()) return 1 + held->size() / kBytesPerCell;
  return 1;
}

const char* Value::type_name() const {
  if (is_none()) return "no value";
  if (is_number()) return "a number";
  if (flag() != nullptr) return "True or False";
  if (text() != nullptr) return "a text";
  if (list() != nullptr) return "a list";
  if (pose() != nullptr) return "a pose";
  return "a struct";
}

bool Value::operator==(const Value& other) const {
  if (is_number() && other.is_number()) return number() == other.number();
  if (const Items* a = items(), *b = other.items(); a != nullptr && b != nullptr)
    return a->kind == b->kind && (a->names == b->names || (a->names && b->names && *a->names == *b->names)) &&
           a->values == b->values;
  if (const std::string* a = text(), *b = other.text(); a != nullptr && b != nullptr) return *a == *b;
  return data_ == other.data_;
}

// Knuth, Morris, Pratt.
std::size_t position_of(std::string_view text, std::string_view target, std::size_t from) {
  if (from > text.size()) return std::string_view::npos;
  std::vector<std::size_t> border(target.size() + 1,
                                  0);  // of the first i bytes: the longest end that is a begin
  const auto with = [&](std::size_t matched, char next) {
    while (matched > 0 && target[matched] != next) matched = border[matched];
    return matched + (target[matched] == next ? 1 : 0);
  };
  for (std::size_t i = 1; i < target.size(); ++i) border[i + 1] = with(border[i], target[i]);
  std::size_t matched = 0, at = from;
  for (; matched < target.size() && at < text.size(); ++at) matched = with(matched, text[at]);
  return matched == target.size() ? at - matched : std::string_view::npos;
}

std::vector<double> numbers_of(const Value& value) {
  std::vector<double> numbers;
  const Items* items = value.items();
  if (items == nullptr)
    throw ValueError(std::string("a list of numbers is expected, found ") + value.type_name());
  for (const Value& one : items->values) {
    if (!one.is_number())
      throw ValueError(std::string("a list of numbers is expected, found an element that is ") +
                       one.type_name());
    numbers.push_back(one.number());
  }
  return numbers;
}

std::string text_of(const Value& value) {
  if (const std::string* text = value.text()) return *text;
  if (const bool* flag = value.flag()) return *flag ? "True" : "False";
  if (value.is_number()) {
    std::array<char, 32> digits{};
    if (value.is_integer())
      std::snprintf(digits.data(), digits.size(), "%d", static_cast<int>(value.number()));
    else
      std::snprintf(digits.data(), digits.size(), "%.6g", value.number());
    return digits.data();
  }
  const Items* items = value.items();
  if (items == nullptr) return "None";
  std::string text = items->kind == Items::Kind::list   ? "["
                     : items->kind == Items::Kind::pose ? "p["
                                                        : "struct(";
  for (std::size_t i = 0; i < items->values.size(); ++i) {
    if (i > 0) text += ", ";
    if (items->names) text += (*items->names)[i] + "=";
    text += text_of(items->values[i]);
  }
  return text + (items->kind == Items::Kind::record ? ")" : "]");
}

}  // namespace takt::urscript
