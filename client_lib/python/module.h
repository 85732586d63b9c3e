#pragma once
// Pieces of the Python module.
#include <pybind11/functional.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <memory>
#include <string>
#include <vector>

#include "client_lib/client.h"

namespace takt::python {

namespace py = pybind11;

/// Values of a reply, {name: value}; and arguments of a request: bool, int, float, str, enumerators, sequences of
/// numbers or of str.
py::dict values_of(const Arguments& values);
Arguments arguments_of_dict(const py::dict& given);

/// Python knows no const; all its properties are read-only.
inline std::shared_ptr<client::CellInfo> shared(const std::shared_ptr<const client::CellInfo>& info) {
  return std::const_pointer_cast<client::CellInfo>(info);
}

/// CellError and what is derived from it.
void bind_errors(py::module_& m);
/// Description, state, status, events: all that is read.
void bind_cell(py::module_& m);

}  // namespace takt::python
