// The Python module takt._takt: takt::Client for Python. What a user sees is takt/__init__.py, typed in
// takt/__init__.pyi.
//
// Every call that may wait does so without the interpreter's lock, so that other threads get their turn, and
// looks for Ctrl-C each 0.2 s (ClientOptions::while_waiting). Predicates take the lock while they run.
#include "client_lib/python/module.h"

#include "client_lib/lockstep_controller.h"

namespace takt::python {
namespace {

using namespace client;

/// Without the interpreter's lock: Ctrl-C comes out as KeyboardInterrupt.
void raise_pending_signals() {
  const py::gil_scoped_acquire locked;
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

std::optional<Seconds> seconds(std::optional<double> value) {
  if (!value) return std::nullopt;
  return Seconds{*value};
}

std::shared_ptr<Client> connect(const std::string& cell, int domain, double timeout_s,
                                double liveliness_timeout_s, const std::string& name,
                                std::uint32_t ownership_strength, const std::string& profiles_file,
                                const std::string& profile, const std::string& secure_directory) {
  ClientOptions options;
  if (!cell.empty()) options.cell = cell;
  if (domain >= 0) options.domain = domain;
  options.timeout = Seconds{timeout_s};
  options.liveliness_timeout = Seconds{liveliness_timeout_s};
  options.name = name;
  options.ownership_strength = ownership_strength;
  options.profiles_file = profiles_file;
  options.profile = profile;
  if (!secure_directory.empty()) options.secure_directory = secure_directory;
  options.while_waiting = &raise_pending_signals;
  const py::gil_scoped_release unlocked;
  return std::make_shared<Client>(options);
}

template <typename Sample>
using Predicate = std::function<bool(const Sample&)>;

template <typename Sample, typename Wait>
auto waiter(Wait wait) {
  return [wait](Client& self, const Predicate<Sample>& predicate, double timeout) {
    const py::gil_scoped_release unlocked;
    return (self.*wait)(predicate, Seconds{timeout});
  };
}

void bind_client(py::module_& m) {
  py::class_<TrajectoryPoint>(m, "TrajectoryPoint")
      .def(py::init([](double time_s, std::vector<double> positions, std::vector<double> velocities,
                       std::vector<double> accelerations) {
             return TrajectoryPoint{time_s, std::move(positions), std::move(velocities),
                                    std::move(accelerations)};
           }),
           py::arg("time_s"), py::arg("positions"), py::arg("velocities") = std::vector<double>{},
           py::arg("accelerations") = std::vector<double>{})
      .def_readonly("time_s", &TrajectoryPoint::time_s)
      .def_readonly("positions", &TrajectoryPoint::positions)
      .def_readonly("velocities", &TrajectoryPoint::velocities)
      .def_readonly("accelerations", &TrajectoryPoint::accelerations);
  py::class_<Client, std::shared_ptr<Client>> c(m, "Client");
  const py::call_guard<py::gil_scoped_release> unlocked;
  c.def(py::init(&connect), py::arg("cell") = "", py::arg("domain") = -1, py::kw_only(),
        py::arg("timeout") = 10.0, py::arg("liveliness_timeout") = 5.0, py::arg("name") = "python",
        py::arg("ownership_strength") = 1, py::arg("profiles_file") = "", py::arg("profile") = "takt_client",
        py::arg("secure_directory") = "")
      .def_property_readonly("client_id", &Client::client_id)
      .def_property_readonly("info", [](const Client& self) { return shared(self.cell()); })
      .def_property_readonly("state", py::cpp_function(&Client::state, unlocked))
      .def_property_readonly("status", py::cpp_function(&Client::status, unlocked))
      .def_property_readonly("connected", &Client::connected)
      .def(
          "wait_for_connection",
          [](Client& self, double timeout) { return self.wait_for_connection(Seconds{timeout}); },
          py::arg("timeout"), unlocked)
      .def("wait_for_state", waiter<State>(&Client::wait_for_state), py::arg("predicate"), py::arg("timeout"))
      .def("wait_for_status", waiter<Status>(&Client::wait_for_status), py::arg("predicate"),
           py::arg("timeout"))
      .def("wait_for_power", waiter<Power>(&Client::wait_for_power), py::arg("predicate"), py::arg("timeout"))
      .def("wait_for_contacts", waiter<Contacts>(&Client::wait_for_contacts), py::arg("predicate"),
           py::arg("timeout"))
      .def(
          "next_event", [](Client& self, double timeout) { return self.next_event(Seconds{timeout}); },
          py::arg("timeout"), unlocked)
      .def("wait_for_event", waiter<Event>(&Client::wait_for_event), py::arg("predicate"), py::arg("timeout"))
      .def(
          "send_joint_command",
          [](Client& self, const std::string& robot, const std::vector<double>& positions,
             const std::vector<double>& velocities, std::optional<double> stamp_s,
             const std::vector<double>& efforts) {
            self.send_joint_command(robot, positions, velocities, stamp_s, efforts);
          },
          py::arg("robot"), py::arg("positions"), py::arg("velocities") = std::vector<double>{},
          py::arg("stamp_s") = py::none(), py::arg("efforts") = std::vector<double>{}, unlocked)
      .def("send_trajectory", &Client::send_trajectory, py::arg("robot"), py::arg("points"),
           py::arg("start_s") = py::none(), unlocked)
      .def("set_signals", &Client::set_signals, py::arg("device"), py::arg("signals"),
           py::arg("stamp_s") = py::none(), unlocked)
      .def("set_gripper", &Client::set_gripper, py::arg("gripper"), py::arg("action"),
           py::arg("width_m") = 0.0, py::arg("max_force_N") = 0.0, py::arg("stamp_s") = py::none(), unlocked)
      // All else is requests.py, made of the table.
      .def(
          "request",
          [](Client& self, const std::string& name, const py::dict& given, std::optional<double> timeout) {
            const Arguments arguments = arguments_of_dict(given);
            const py::gil_scoped_release released;
            return self.request(name, arguments, seconds(timeout));
          },
          py::arg("name"), py::arg("arguments") = py::dict(), py::arg("timeout") = py::none(),
          "Any request by name, with arguments {name: value}; the values of the reply as they came.");

  m.def(
      "list_cells",
      [](int domain, double duration) {
        std::vector<FoundCell> found;
        {
          const py::gil_scoped_release released;
          found = list_cells(domain < 0 ? ClientOptions::default_domain() : domain, Seconds{duration});
        }
        std::map<std::string, std::optional<Status>> cells;
        for (FoundCell& cell : found) cells[cell.name] = std::move(cell.status);
        return cells;
      },
      py::arg("domain") = -1, py::arg("duration") = 2.0);
}

void bind_lockstep(py::module_& m) {
  const py::call_guard<py::gil_scoped_release> unlocked;
  py::class_<LockstepController>(m, "LockstepController")
      .def(py::init([](Client& cell, std::vector<std::string> targets, double period_s,
                       const std::string& name, double timeout, bool start) {
             return std::make_unique<LockstepController>(
                 cell, LockstepOptions{std::move(targets), period_s, name, Seconds{timeout}, start});
           }),
           py::arg("cell"), py::arg("targets"), py::arg("period_s") = 0.008, py::kw_only(),
           py::arg("name") = "python", py::arg("timeout") = 60.0, py::arg("start") = true,
           py::keep_alive<1, 2>(), unlocked)
      .def_property_readonly("state", [](const LockstepController& self) { return self.state(); })
      .def_property_readonly("period_s", &LockstepController::period_s)
      .def("move", &LockstepController::move, py::arg("robot"), py::arg("positions"),
           py::arg("velocities") = std::vector<double>{}, py::arg("efforts") = std::vector<double>{})
      .def("grip", &LockstepController::grip, py::arg("gripper"), py::arg("action"), py::arg("width_m") = 0.0,
           py::arg("max_force_N") = 0.0)
      .def("set_signals", &LockstepController::set_signals, py::arg("device"), py::arg("signals"))
      .def(
          "advance", [](LockstepController& self) { return self.advance(); }, unlocked)
      .def("close", &LockstepController::close, unlocked);
}

}  // namespace
}  // namespace takt::python

PYBIND11_MODULE(_takt, m) {
  m.doc() = "takt::Client for Python; use the package takt.";
  takt::python::bind_errors(m);
  takt::python::bind_cell(m);
  takt::python::bind_client(m);
  takt::python::bind_lockstep(m);
}
