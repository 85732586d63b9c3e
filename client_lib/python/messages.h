#pragma once
// Messages of the IDL as Python classes, by one template: each field is a read-only property with a docstring made of the
// field table.
//
//   IDL                                      Python
//   number, boolean, string                  int, float, bool, str
//   field with @index                        name of the element, None where there is none
//   field with @enumeration                  member of the class in takt.enumerations; a number without name stays int
//   builtin_interfaces::msg::Time            float, seconds
//   @quantity: vectors, rotations            numpy array of float64: (3,), (4,) x y z w, (3, 3)
//   sequence of numbers                      numpy array of the same number, in the shape of @shape
//   sequence of strings                      list of str
//   sequence of messages                     list; with @key or @order a NamedList
//   other message                            its class
//
// An array is a copy. A View shares the sample it is a part of.
#include <pybind11/functional.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <memory>
#include <string>
#include <vector>

#include "client_lib/client.h"
#include "client_lib/kinematics/motions.h"
#include "idl/common/named_lists.h"
#include "idl/common/stamp.h"

namespace pybind11::detail {

/// Members of the classes in takt.enumerations; an argument may be the name too.
template <typename Enumeration>
struct type_caster<Enumeration, enable_if_t<takt::TabledEnumeration<Enumeration>>> {
  PYBIND11_TYPE_CASTER(Enumeration, const_name("enumerator"));

  static object type() {
    return module_::import("takt.enumerations")
        .attr(std::string(takt::kEnumeration<Enumeration>.name).c_str());
  }
  bool load(handle source, bool) {
    if (isinstance<str>(source)) {
      const auto word = source.cast<std::string>();
      const auto found = takt::enumerator_of<Enumeration>(word);
      if (!found)
        throw takt::ClientError(takt::ClientError::Kind::invalid,
                                "'" + word + "' is no " + std::string(takt::kEnumeration<Enumeration>.name) +
                                    "; allowed are " + takt::enumerator_names<Enumeration>() + ".");
      value = *found;
      return true;
    }
    if (!isinstance(source, type())) return false;
    value = static_cast<Enumeration>(source.attr("value").cast<std::int64_t>());
    return true;
  }
  static handle cast(Enumeration source, return_value_policy, handle) {
    const int_ number(static_cast<std::int64_t>(source));
    return (takt::is_known(source) ? type()(number) : object(number)).release();
  }
};

}  // namespace pybind11::detail

namespace takt::python {

namespace py = pybind11;

/// A message, or a part of one: shares the whole sample.
template <Message Type>
struct View {
  std::shared_ptr<const Type> message;     ///< of a topic: a SampleOf<Type>
  std::shared_ptr<const CellInfo> cell{};  ///< indices are those of its lists; none: no field has an index
  const Named* of = nullptr;               ///< what the message is of, in `cell`
};

/// A message of a topic that a client of Python reads; those of ROS 2 have classes of their own.
template <Message Type>
inline constexpr bool kIsOfTopic = message_info<Type>().name.starts_with("takt_msgs/") &&
                                   has_annotation(message_info<Type>().annotations, "topic");

/// A sample of the client: a message with more members.
template <typename Sample, Message Type>
struct SampleView : View<Type> {
  explicit SampleView(std::shared_ptr<const Sample> made,
                      const std::shared_ptr<const CellInfo>& described = {})
      : View<Type>{made, described, described == nullptr ? nullptr : &described->lists} {}
  const Sample& sample() const { return static_cast<const Sample&>(*this->message); }
};

/// Shape of an array of `size` numbers: @shape, in which one word stands for any length; else, and where the size
/// is another, one dimension.
std::vector<py::ssize_t> shape_of(std::string_view text, std::size_t size);

/// Content of a field in terms of Python, for docstrings.
std::string text_of_field(const FieldInfo& field);

struct Values {
  template <Message Holder, typename Value>
  static py::object value(const FieldInfo& field, const View<Holder>& holder, const Value& value) {
    const std::string_view list = annotation(field.annotations, "index");
    if constexpr (std::is_integral_v<Value> && !std::is_same_v<Value, bool>) {
      if (!list.empty()) {
        const std::string* name = holder.cell->lists.name_of(list, static_cast<std::int64_t>(value));
        return name == nullptr ? py::object(py::none()) : py::str(*name);
      }
    }
    return py::cast(value);
  }
  template <Message Holder>
  static py::object value(const FieldInfo&, const View<Holder>&, const builtin_interfaces::msg::Time& stamp) {
    return py::float_(seconds_of(stamp));
  }
  template <Message Holder, Message Part>
  static py::object value(const FieldInfo&, const View<Holder>& holder, const Part& part) {
    if constexpr (kIsQuantity<Part>) {
      static_assert(sizeof(Part) == message_info<Part>().fields.size() * sizeof(double));
      const auto shape =
          shape_of(annotation(message_info<Part>().annotations, "shape"), sizeof(Part) / sizeof(double));
      return py::array_t<double>(shape, reinterpret_cast<const double*>(&part));
    } else {
      return py::cast(View<Part>{{holder.message, &part}, holder.cell, holder.of});
    }
  }
  template <Message Holder, typename Element>
  static py::object value(const FieldInfo& field, const View<Holder>& holder,
                          const std::vector<Element>& list) {
    if constexpr (std::is_arithmetic_v<Element>) {
      return py::array_t<Element>(shape_of(annotation(field.annotations, "shape"), list.size()), list.data());
    } else if constexpr (!Message<Element>) {
      return py::cast(list);
    } else {
      const std::string_view key = annotation(field.annotations, "key");
      const auto* order = holder.of == nullptr ? nullptr : order_of(field, *holder.of);
      py::list elements, names;
      for (std::size_t i = 0; i < list.size(); ++i) {
        const Named* of = order != nullptr && i < order->size() ? &(*order)[i] : holder.of;
        elements.append(View<Element>{{holder.message, &list[i]}, holder.cell, of});
        if (order != nullptr) names.append(of->name);
        for_each_field(list[i], [&](const FieldInfo& member, const auto& name) {
          if constexpr (std::is_same_v<std::decay_t<decltype(name)>, std::string>)
            if (member.name == key) names.append(name);
        });
      }
      if (names.size() != elements.size() || (key.empty() && order == nullptr)) return elements;
      return py::module_::import("takt.named_list").attr("NamedList")(elements, names);
    }
  }

  template <Message Part>
  static constexpr bool kIsQuantity = has_annotation(message_info<Part>().annotations, "quantity");
};

/// The class of a message in `m`, and first those of the messages in it.
template <Message Type>
void bind_message(py::module_& m) {
  if (py::detail::get_type_info(typeid(View<Type>)) != nullptr) return;
  const auto bind_part = [&]<typename Part>(const Part*) {
    if constexpr (Message<Part> && !std::is_same_v<Part, builtin_interfaces::msg::Time>)
      if constexpr (!Values::kIsQuantity<Part>) bind_message<Part>(m);
  };
  const Type example{};
  for_each_field(example, [&]<typename Value>(const FieldInfo&, const Value&) {
    if constexpr (kIsMessageList<Value>)
      bind_part(static_cast<const typename Value::value_type*>(nullptr));
    else
      bind_part(static_cast<const Value*>(nullptr));
  });
  const MessageInfo& info = message_info<Type>();
  const std::string name(info.name.substr(info.name.rfind('/') + 1));
  py::class_<View<Type>> bound(m, name.c_str(), std::string(info.doc).c_str());
  std::size_t place = 0;
  for_each_field(example, [&](const FieldInfo& field, const auto&) {
    bound.def_property_readonly(
        std::string(field.name).c_str(),
        [at = place++](const View<Type>& self) {
          py::object found;
          std::size_t i = 0;
          for_each_field(*self.message, [&](const FieldInfo& one, const auto& value) {
            if (i++ == at) found = Values::value(one, self, value);
          });
          return found;
        },
        text_of_field(field).c_str());
  });
  if constexpr (kIsOfTopic<Type>)
    bound.def_property_readonly(
        "sample_number",
        [](const View<Type>& self) {
          return static_cast<const SampleOf<Type>&>(*self.message).sample_number;
        },
        "Number of the sample among those received; the server repeats an instant while it stands still.");
  bound.def("__repr__", [name](const py::object& self) {
    return py::module_::import("takt.named_list").attr("text_of")(self);
  });
}

}  // namespace takt::python
