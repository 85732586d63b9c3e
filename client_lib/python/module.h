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

/// Of three numbers, or of four; another count is a ValueError that names `what`.
client::Vector3 vector3(const std::vector<double>& numbers, const char* what);
client::Quaternion quaternion(const std::vector<double>& numbers, const char* what);

/// Python knows no const; all its properties are read-only.
inline std::shared_ptr<client::CellInfo> shared(const std::shared_ptr<const client::CellInfo>& info) {
  return std::const_pointer_cast<client::CellInfo>(info);
}

/// CellError and what is derived from it.
void bind_errors(py::module_& m);
/// Description, state, status, events: all that is read.
void bind_cell(py::module_& m);

}  // namespace takt::python
