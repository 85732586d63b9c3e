#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>

#include "client_lib/gateway/ur/path.h"
#include "client_lib/gateway/urscript/functions.h"
#include "client_lib/gateway/urscript/operators.h"
#include "client_lib/gateway/urscript/xml_rpc.h"

namespace takt::urscript {
namespace {

using Arguments = std::span<const Value>;
using ur::pose_of;
using ur::Vector6;
using ur::vector_of;

double number(const Value& value) {
  if (!value.is_number())
    throw ValueError(std::string("type_error: a number is expected, found ") + value.type_name());
  return value.number();
}

const std::string& text(const Value& value) {
  if (value.text() == nullptr)
    throw ValueError(std::string("type_error: a text is expected, found ") + value.type_name());
  return *value.text();
}

const MemberNames& handle_names() {
  static const auto names =
      std::make_shared<const std::vector<std::string>>(std::vector<std::string>{"type", "url"});
  return names;
}

Vector6 six(const Value& value) {
  const std::vector<double> numbers = numbers_of(value);
  if (numbers.size() != 6)
    throw ValueError("six numbers are expected, found " + std::to_string(numbers.size()));
  Vector6 result;
  std::copy(numbers.begin(), numbers.end(), result.begin());
  return result;
}

Pose pose(const Value& value) {
  if (value.pose() == nullptr)
    throw ValueError(std::string("type_error: a pose is expected, found ") + value.type_name());
  return pose_of(six(value));
}

Value value_of(const Pose& X) {
  const Vector6 numbers = vector_of(X);
  for (const double one : numbers) finite(one);
  return Value::pose(std::vector<double>(numbers.begin(), numbers.end()));
}

Value list_of(const Vec3& v) {
  return std::vector<double>{finite(v.x()), finite(v.y()), finite(v.z())};
}

Vec3 three(const Value& value) {
  const std::vector<double> numbers = numbers_of(value);
  if (numbers.size() != 3) throw ValueError("three numbers are expected");
  return {numbers[0], numbers[1], numbers[2]};
}

Vec3 turn_of(const Mat3& R) {
  Pose X;
  X.R = R;
  const Vector6 v = vector_of(X);
  return {v[3], v[4], v[5]};
}
Mat3 rotation_of(const Vec3& turn) {
  return pose_of({0.0, 0.0, 0.0, turn.x(), turn.y(), turn.z()}).R;
}

Pose difference(const Pose& to, const Pose& from) {
  Pose X;
  X.p = to.p - from.p;
  X.R = to.R * from.R.transpose();
  return X;
}

double magnitude(const Value& value) {
  if (value.is_number()) return std::abs(value.number());
  double sum = 0.0;
  for (const double one : numbers_of(value)) sum += one * one;
  return std::sqrt(sum);
}

std::size_t place(const Value& value, std::size_t most) {
  const double at = number(value);
  if (!(at >= 0.0) || at != std::floor(at) || at > static_cast<double>(most))
    throw ValueError("position " + text_of(value) + " is not in the text");
  return static_cast<std::size_t>(at);
}

Value size_of(Arguments a) {
  if (const std::string* held = a[0].text()) return static_cast<int>(held->size());
  const Items* items = a[0].items();
  if (items == nullptr) throw ValueError(std::string("type_error: ") + a[0].type_name() + " has no size");
  return static_cast<int>(items->values.size());
}

Value matrix_size(Arguments a) {
  const Items* rows = a[0].list();
  if (rows == nullptr || rows->values.empty() || rows->values.front().list() == nullptr) return size_of(a);
  return Value::list(
      {static_cast<int>(rows->values.size()), static_cast<int>(rows->values.front().list()->values.size())});
}

Value transpose(Arguments a) {
  const Items* rows = a[0].list();
  std::vector<std::vector<double>> columns;
  if (rows == nullptr) throw ValueError("a matrix is expected");
  for (const Value& row : rows->values) {
    const auto line = numbers_of(row);
    if (columns.empty()) columns.resize(line.size());
    if (line.size() != columns.size()) throw ValueError("the rows of a matrix have one length");
    for (std::size_t j = 0; j < line.size(); ++j) columns[j].push_back(line[j]);
  }
  return Value::list(std::vector<Value>(columns.begin(), columns.end()));
}

Value inverse(Arguments a) {
  if (a[0].pose() != nullptr) return value_of(pose(a[0]).inverse());
  const Items* rows = a[0].list();
  const auto size = rows == nullptr ? 0 : static_cast<Eigen::Index>(rows->values.size());
  Eigen::MatrixXd matrix(size, size);
  for (Eigen::Index i = 0; i < size; ++i) {
    const auto line = numbers_of(rows->values[static_cast<std::size_t>(i)]);
    if (static_cast<Eigen::Index>(line.size()) != size)
      throw ValueError("inv: allowed: a square matrix or a pose");
    for (Eigen::Index j = 0; j < size; ++j) matrix(i, j) = line[static_cast<std::size_t>(j)];
  }
  const Eigen::FullPivLU<Eigen::MatrixXd> decomposition(matrix);
  if (size == 0 || !decomposition.isInvertible()) throw ValueError("inv: the matrix has no inverse");
  const Eigen::MatrixXd inverted = decomposition.inverse();
  std::vector<Value> result;
  for (Eigen::Index i = 0; i < size; ++i) {
    std::vector<Value> line;
    for (Eigen::Index j = 0; j < size; ++j) line.emplace_back(finite(inverted(i, j)));
    result.push_back(Value::list(std::move(line)));
  }
  return Value::list(std::move(result));
}

Value make_list(Arguments a) {
  const double length = number(a[0]), capacity = a[2].is_none() ? length : number(a[2]);
  const auto most = static_cast<double>(Value::kMostWeight);
  if (!(length >= 0.0 && length <= capacity && capacity <= most))
    throw ValueError("make_list: allowed: 0 to capacity elements, at most " +
                     std::to_string(Value::kMostWeight));
  return Value::list(std::vector<Value>(static_cast<std::size_t>(length), a[1]),
                     static_cast<std::size_t>(capacity));
}

Value interpolate(Arguments a) {
  const Pose from = pose(a[0]), to = pose(a[1]);
  const double alpha = number(a[2]);
  Pose X;
  X.p = from.p + alpha * (to.p - from.p);
  X.R = rotation_of(alpha * turn_of(difference(to, from).R)) * from.R;
  return value_of(X);
}

/// w_from = [F, T] in the frame that T_from_to names, about its origin.
Value wrench_trans(Arguments a) {
  const Pose X = pose(a[0]);
  const Vector6 w = six(a[1]);
  const Vec3 force(w[0], w[1], w[2]), torque(w[3], w[4], w[5]);
  const Vec3 f = X.R.transpose() * force, t = X.R.transpose() * (torque - X.p.cross(force));
  return std::vector<double>{finite(f.x()), finite(f.y()), finite(f.z()),
                             finite(t.x()), finite(t.y()), finite(t.z())};
}

Value rotvec_of_rpy(Arguments a) {
  const Vec3 angles = three(a[0]);
  const Mat3 R = (Eigen::AngleAxisd(angles.z(), Vec3::UnitZ()) *
                  Eigen::AngleAxisd(angles.y(), Vec3::UnitY()) * Eigen::AngleAxisd(angles.x(), Vec3::UnitX()))
                     .toRotationMatrix();
  return list_of(turn_of(R));
}

Value rpy_of_rotvec(Arguments a) {
  const Mat3 R = rotation_of(three(a[0]));
  return list_of({std::atan2(R(2, 1), R(2, 2)), std::atan2(-R(2, 0), std::hypot(R(0, 0), R(1, 0))),
                  std::atan2(R(1, 0), R(0, 0))});
}

Value number_in(Arguments a) {
  std::string_view digits = text(a[0]);
  double value = 0.0;
  const auto [end, problem] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (digits.empty() || problem != std::errc{} || end != digits.data() + digits.size() ||
      !std::isfinite(value))
    throw ValueError("to_num: \"" + std::string(digits.substr(0, 40)) + "\" is no number");
  return digits.find_first_of(".eE") == std::string_view::npos ? Value::whole(value) : Value(value);
}

Value bits_of(Arguments a) {
  const double value = number(a[0]);
  if (value != std::floor(value) || value < -2147483648.0 || value > 4294967295.0)
    throw ValueError("integer_to_binary_list: allowed: an integer of 32 bits");
  const auto bits = static_cast<std::uint32_t>(static_cast<std::int64_t>(value));
  std::vector<Value> list;
  for (unsigned i = 0; i < 32; ++i) list.emplace_back((bits >> i & 1U) != 0);
  return Value::list(std::move(list));
}

Value integer_of(Arguments a) {
  const Items* list = a[0].list();
  if (list == nullptr || list->values.size() > 32)
    throw ValueError("binary_list_to_integer: allowed: a list of at most 32 booleans");
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < list->values.size(); ++i) {
    const bool* flag = list->values[i].flag();
    if (flag == nullptr) throw ValueError("binary_list_to_integer: allowed: a list of booleans");
    bits |= (*flag ? 1U : 0U) << i;
  }
  return Value::whole(static_cast<double>(static_cast<std::int32_t>(bits)));
}

template <class Calculation>
std::function<Value(Arguments)> of_number(Calculation calculation) {
  return [calculation](Arguments a) { return Value(finite(calculation(number(a[0])))); };
}

using Computation = std::function<Value(Arguments)>;
const std::map<std::string_view, Computation>& computations() {
  constexpr double kDegree = std::numbers::pi / 180.0;
  static const std::map<std::string_view, Computation> all{
      {"get_steptime", [](Arguments) { return Value(0.002); }},
      {"sin", of_number([](double x) { return std::sin(x); })},
      {"cos", of_number([](double x) { return std::cos(x); })},
      {"tan", of_number([](double x) { return std::tan(x); })},
      {"asin", of_number([](double x) { return std::asin(x); })},
      {"acos", of_number([](double x) { return std::acos(x); })},
      {"atan", of_number([](double x) { return std::atan(x); })},
      {"atan2", [](Arguments a) { return Value(finite(std::atan2(number(a[0]), number(a[1])))); }},
      {"sqrt", of_number([](double x) { return std::sqrt(x); })},
      {"pow", [](Arguments a) { return Value(finite(std::pow(number(a[0]), number(a[1])))); }},
      {"log", [](Arguments a) { return Value(finite(std::log(number(a[1])) / std::log(number(a[0])))); }},
      {"floor", [](Arguments a) { return Value::whole(std::floor(number(a[0]))); }},
      {"ceil", [](Arguments a) { return Value::whole(std::ceil(number(a[0]))); }},
      {"d2r", of_number([](double x) { return x * kDegree; })},
      {"r2d", of_number([](double x) { return x / kDegree; })},
      {"norm",
       [](Arguments a) {
         const double value = finite(magnitude(a[0]));
         return a[0].is_integer() ? Value::whole(value) : Value(value);
       }},
      {"length", size_of},
      {"get_list_length", size_of},
      {"normalize", [](Arguments a) { return apply(Operator::divide, a[0], finite(magnitude(a[0]))); }},
      {"size", matrix_size},
      {"transpose", transpose},
      {"inv", inverse},
      {"make_list", make_list},
      {"pose_trans", [](Arguments a) { return value_of(pose(a[0]) * pose(a[1])); }},
      {"pose_inv", [](Arguments a) { return value_of(pose(a[0]).inverse()); }},
      {"pose_add",
       [](Arguments a) {
         const Pose first = pose(a[0]), second = pose(a[1]);
         Pose X;
         X.p = first.p + second.p;
         X.R = first.R * second.R;
         return value_of(X);
       }},
      {"pose_sub", [](Arguments a) { return value_of(difference(pose(a[0]), pose(a[1]))); }},
      {"pose_dist",
       [](Arguments a) { return Value(magnitude(value_of(difference(pose(a[1]), pose(a[0]))))); }},
      {"point_dist", [](Arguments a) { return Value(finite((pose(a[1]).p - pose(a[0]).p).norm())); }},
      {"interpolate_pose", interpolate},
      {"wrench_trans", wrench_trans},
      {"rpy2rotvec", rotvec_of_rpy},
      {"rotvec2rpy", rpy_of_rotvec},
      {"str_cat", [](Arguments a) { return Value(text_of(a[0]) + text_of(a[1])); }},
      {"str_at",
       [](Arguments a) {
         const std::string& source = text(a[0]);
         const std::size_t at = place(a[1], source.size());
         if (at == source.size()) throw ValueError("position " + text_of(a[1]) + " is not in the text");
         return Value(source.substr(at, 1));
       }},
      {"str_sub",
       [](Arguments a) {
         const std::string& source = text(a[0]);
         const std::size_t at = place(a[1], source.size());
         const double count = a[2].is_none() ? -1.0 : number(a[2]);
         return Value(source.substr(at, count < 0.0 || count > static_cast<double>(source.size())
                                            ? std::string::npos
                                            : static_cast<std::size_t>(count)));
       }},
      {"str_find",
       [](Arguments a) {
         const std::string& source = text(a[0]);
         const std::size_t found =
             position_of(source, text(a[1]), a[2].is_none() ? 0 : place(a[2], source.size()));
         return Value(found == std::string::npos ? -1 : static_cast<int>(found));
       }},
      {"str_len", [](Arguments a) { return Value(static_cast<int>(text(a[0]).size())); }},
      {"str_empty", [](Arguments a) { return Value(text(a[0]).empty()); }},
      {"to_str", [](Arguments a) { return Value(text_of(a[0])); }},
      {"to_num", number_in},
      {"rpc_factory",
       [](Arguments a) {
         if (text(a[0]) != "xmlrpc")
           throw ValueError("rpc_factory: found the type '" + text(a[0]) + "'; allowed: \"xmlrpc\"");
         (void)rpc::parse_url(text(a[1]));
         return Value::record({text(a[0]), text(a[1])}, handle_names());
       }},
      {"integer_to_binary_list", bits_of},
      {"binary_list_to_integer", integer_of},
  };
  return all;
}

}  // namespace

bool is_rpc_handle(const Value& value) {
  return value.record() != nullptr && value.record()->names == handle_names();
}

Value compute(const Function& function, std::span<const Value> arguments) {
  return computations().at(function.name)(arguments);
}

}  // namespace takt::urscript
