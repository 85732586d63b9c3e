// The Python module takt._takt: takt::Client for Python. A user sees it through takt/__init__.py; its types are in
// takt/_takt.pyi.
//
// Every call that may wait does so without the interpreter's lock, so that other threads get their turn, and
// looks for Ctrl-C each 0.2 s (ClientOptions::while_waiting). Predicates take the lock while they run.
#include "client_lib/python/module.h"

#include "client_lib/lockstep_controller.h"

namespace takt::python {
namespace {

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

/// ClientError and MotionError as the classes of takt.errors.
void translate(std::exception_ptr thrown) {
  const auto raise = [](const char* type, const char* sentence, std::optional<ControlResult> result) {
    const py::object made = py::module_::import("takt.errors").attr(type)(sentence);
    if (result) made.attr("result") = static_cast<int>(*result);
    PyErr_SetObject(py::type::of(made).ptr(), made.ptr());
  };
  try {
    if (thrown) std::rethrow_exception(thrown);
  } catch (const ClientError& error) {
    using Kind = ClientError::Kind;
    const Kind kind = error.kind();
    raise(kind == Kind::timeout     ? "CellTimeout"
          : kind == Kind::not_found ? "NotFound"
          : kind == Kind::invalid   ? "Invalid"
          : kind == Kind::refused   ? "Refused"
          : kind == Kind::lost      ? "Lost"
                                    : "CellError",
          error.what(), error.result());
  } catch (const NameError& error) {
    raise("NotFound", error.what(), {});
  } catch (const ShapeError& error) {
    raise("Invalid", error.what(), {});
  } catch (const MotionError& error) {
    raise("MotionError", error.what(), {});
  }
}

void bind_errors() {
  py::register_exception_translator(&translate);
}

/// Client::wait_for of the topic with this id; `predicate` None: any sample.
py::object wait_for(const Client& self, const std::string& id, const std::string& element,
                    const py::object& predicate, std::optional<double> timeout) {
  py::object found = py::none();
  topics::for_each([&]<typename Type>(const Topic<Type>& topic) {
    if constexpr (kIsOfTopic<Type>) {
      if (topic.id != id) return;
      const auto accepts = [&](const SampleOf<Type>& sample) {
        const py::gil_scoped_acquire locked;
        return predicate.is_none() || predicate(view(sample)).template cast<bool>();
      };
      std::optional<SampleOf<Type>> sample;
      {
        const py::gil_scoped_release unlocked;
        sample = self.wait_for(topic, accepts, seconds(timeout), element);
      }
      if (sample) found = py::cast(view(*sample));
    }
  });
  return found;
}

using Numbers = std::vector<double>;

void bind_client(py::module_& m) {
  py::class_<Client, std::shared_ptr<Client>> c(m, "Client", "takt.Client without its requests and topics.");
  const py::call_guard<py::gil_scoped_release> unlocked;
  c.def(py::init(&connect), py::arg("cell") = "", py::arg("domain") = -1, py::kw_only(),
        py::arg("timeout") = 10.0, py::arg("liveliness_timeout") = 5.0, py::arg("name") = "python",
        py::arg("ownership_strength") = 1, py::arg("profiles_file") = "", py::arg("profile") = "takt_client",
        py::arg("secure_directory") = "",
        R"(Connects and waits until the cell has described itself.

cell: name of the cell; empty: $TAKT_CELL, else "cell"
domain: DDS domain, 0 to 232; -1: $TAKT_DOMAIN, else 0
timeout: longest wait for the cell, and of requests that are given none, in s of wall time
liveliness_timeout: silence after which the server counts as gone, in s of wall time
name: shown in events about commands of this client; a unique suffix is added
ownership_strength: of several senders of commands for one robot the strongest is heard
profiles_file: Fast DDS profiles (XML); empty: discovery stays on this machine
profile: name of the participant profile in that file
secure_directory: identity and permissions (docs/network.md); empty: $TAKT_SECURE, else no security

Raises NotFound with the names of the cells that answer.)")
      .def_property_readonly("client_id", &Client::client_id,
                             "Identity of this client in requests, and in events about its commands.")
      .def_property_readonly(
          "info", [](const Client& self) { return view(self.cell()); },
          "Description of the cell; another object when another scenario is loaded.")
      .def_property_readonly(
          "state", py::cpp_function([](const Client& self) { return view(self.state()); }, unlocked),
          "Newest state; never older than the reply to the last request.")
      .def_property_readonly(
          "status", py::cpp_function([](const Client& self) { return view(self.status()); }, unlocked),
          "Newest status of the service; never older than the reply to the last request.")
      .def_property_readonly("connected", &Client::connected,
                             "True while the server is announced and was heard of within liveliness_timeout.")
      .def(
          "wait_for_connection",
          [](Client& self, double timeout) { return self.wait_for_connection(Seconds{timeout}); },
          py::arg("timeout"), unlocked,
          "Waits until the cell answers, e.g. after its server was started again; False after `timeout` s of "
          "wall time.")
      // The waits for the samples of each topic are topics.py, made of the table.
      .def("_wait_for", &wait_for, py::arg("topic"), py::arg("element"), py::arg("predicate"),
           py::arg("timeout"))
      .def(
          "send_joint_command",
          [](Client& self, const std::string& robot, const Numbers& positions, const Numbers& velocities,
             std::optional<double> stamp_s, const Numbers& efforts) {
            self.send_joint_command(robot, positions, velocities, stamp_s, efforts);
          },
          py::arg("robot"), py::arg("positions"), py::arg("velocities") = Numbers{},
          py::arg("stamp_s") = py::none(), py::arg("efforts") = Numbers{}, unlocked,
          R"(Set-point of all joints of a robot: be there one command period from now.

robot: name of the robot
positions: (joints,) in rad or m, in the order of info.robots[robot].joints
velocities: (joints,) in rad/s or m/s; empty: they follow from successive positions
stamp_s: simulated time that the sender means, in s; None: when the command arrives
efforts: (joints,) in N m or N, added to what the drives' controllers want at level of detail 2 and 3; empty: none

The server checks limits and reports a refusal in the event command_rejected. Raises NotFound, Invalid, CellTimeout.)")
      .def(
          "send_joint_torques",
          [](Client& self, const std::string& robot, const Numbers& torques, std::optional<double> stamp_s) {
            self.send_joint_torques(robot, torques, stamp_s);
          },
          py::arg("robot"), py::arg("torques"), py::arg("stamp_s") = py::none(), unlocked,
          R"(Torques of all joints of a robot, in place of a set-point (level of detail 2 and 3).

robot: name of the robot
torques: (joints,) in N m or N, in the order of info.robots[robot].joints
stamp_s: simulated time that the sender means, in s; None: when the command arrives

They act besides the torques that carry the robot's own weight, without position control, until the robot's next
command. A robot that misses its deadline brakes and holds its position. The server reports a refusal in the event
command_rejected. Raises NotFound, Invalid, CellTimeout.)")
      .def("send_trajectory", &Client::send_trajectory, py::arg("robot"), py::arg("points"),
           py::arg("start_s") = py::none(), unlocked,
           R"(Motion of all joints of a robot through points, from where the robot is.

robot: name of the robot
points: list of TrajectoryPoint; empty: the robot stops
start_s: simulated time of the beginning, in s; None: when the trajectory arrives

Linear through positions, cubic with velocities, quintic with accelerations too. The event trajectory_done reports the
end. A set-point or another trajectory replaces it. Raises NotFound, Invalid, CellTimeout.)")
      .def("set_signals", &Client::set_signals, py::arg("device"), py::arg("signals"),
           py::arg("stamp_s") = py::none(), unlocked,
           R"(Sets signals of a device; the others stay as they are.

device: name of the device
signals: {name: value}, in the unit and within the limits of info.devices[device].signals
stamp_s: simulated time that the sender means, in s; None: when the command arrives

The server reports a refusal in the event command_rejected. Raises NotFound, Invalid, CellTimeout.)")
      .def("set_gripper", &Client::set_gripper, py::arg("gripper"), py::arg("action"),
           py::arg("width_m") = 0.0, py::arg("max_force_N") = 0.0, py::arg("stamp_s") = py::none(), unlocked,
           R"(Commands a gripper.

gripper: name of the gripper
action: a GripperAction, or its name
width_m: distance of the grip faces in m, for GripperAction.width
max_force_N: limit of the force of one jaw in N; 0: the gripper's own
stamp_s: simulated time that the sender means, in s; None: when the command arrives

The server reports a refusal in the event command_rejected. Raises NotFound, Invalid, CellTimeout.)")
      // All else is requests.py, made of the table.
      .def(
          "request",
          [](Client& self, const std::string& name, const py::dict& given, std::optional<double> timeout) {
            const Arguments arguments = arguments_of_dict(given);
            const py::gil_scoped_release released;
            return self.request(name, arguments, seconds(timeout));
          },
          py::arg("name"), py::arg("arguments") = py::dict(), py::arg("timeout") = py::none(),
          R"(Any request by name, e.g. one of a newer server.

name: of the request (docs/requests.md)
arguments: {name: value}; values are bool, int, float, str, enumerators, arrays, sequences of numbers or of str
timeout: longest wait for the reply, in s; None: that of the client

Raises Refused with the server's sentence.)");

  m.def(
      "list_cells",
      [](int domain, double duration) {
        std::vector<FoundCell> found;
        {
          const py::gil_scoped_release released;
          found = list_cells(domain < 0 ? ClientOptions::default_domain() : domain, Seconds{duration});
        }
        py::dict cells;
        for (const FoundCell& cell : found)
          cells[py::str(cell.name)] = cell.status ? py::cast(view(*cell.status)) : py::none();
        return cells;
      },
      py::arg("domain") = -1, py::arg("duration") = 2.0,
      "Cells on a DDS domain (-1: $TAKT_DOMAIN, else 0) by name, each with its status, or None where it does "
      "not answer. All of `duration` s of wall time is waited.");
}

void bind_lockstep(py::module_& m) {
  const py::call_guard<py::gil_scoped_release> unlocked;
  py::class_<LockstepController>(m, "LockstepController", "takt.LockstepController without its `with` block.")
      .def(py::init([](Client& cell, std::vector<std::string> targets, double period_s,
                       const std::string& name, double timeout, bool start) {
             return std::make_unique<LockstepController>(
                 cell, LockstepOptions{std::move(targets), period_s, name, Seconds{timeout}, start});
           }),
           py::arg("cell"), py::arg("targets"), py::arg("period_s") = 0.008, py::kw_only(),
           py::arg("name") = "python", py::arg("timeout") = 60.0, py::arg("start") = true,
           py::keep_alive<1, 2>(), unlocked,
           R"(Registers, and returns at the first boundary from the present instant on.

cell: the Client
targets: names of the robots, grippers and devices that this controller commands; at least one
period_s: simulated time from boundary to boundary, in s; at least one step
name: shown in events and in the status; unique in the cell
timeout: longest wait for a boundary, in s of wall time; the server pauses a cell whose controller is silent for longer
start: set the cell to lockstep and playing

Raises NotFound or Refused for targets, CellTimeout.)")
      .def_property_readonly(
          "state", [](const LockstepController& self) { return view(self.state()); },
          "State at the present boundary; after advance_ahead() an earlier one, the newest known.")
      .def_property_readonly("time_s", &LockstepController::time_s,
                             "Simulated time of the present boundary, in s.")
      .def_property_readonly("period_s", &LockstepController::period_s,
                             "Simulated time from boundary to boundary, in s.")
      .def("move", &LockstepController::move, py::arg("robot"), py::arg("positions"),
           py::arg("velocities") = Numbers{}, py::arg("efforts") = Numbers{},
           R"(Set-point of a robot, to be reached one period from now; advance() sends it.

robot: name of the robot
positions: (joints,) in rad or m
velocities: (joints,) in rad/s or m/s; empty: the robot stands there
efforts: (joints,) in N m or N, added to what the drives' controllers want; empty: none

Without a new one the robot stays there, with the same efforts.)")
      .def(
          "apply_torques",
          [](LockstepController& self, const std::string& robot, const Numbers& torques) {
            self.apply_torques(robot, torques);
          },
          py::arg("robot"), py::arg("torques"),
          "Torques of a robot as those of Client.send_joint_torques; advance() sends them. They stand until "
          "its next command.")
      .def("grip", &LockstepController::grip, py::arg("gripper"), py::arg("action"), py::arg("width_m") = 0.0,
           py::arg("max_force_N") = 0.0,
           "Commands a gripper as Client.set_gripper does; advance() sends it. It stands until the next one.")
      .def("set_signals", &LockstepController::set_signals, py::arg("device"), py::arg("signals"),
           "Sets signals of a device {name: value}; advance() sends them. The others stay as they are.")
      .def(
          "advance", [](LockstepController& self) { return view(self.advance()); }, unlocked,
          "Answers this boundary with one command for each target, and returns the state at the next one.\n\n"
          "Raises Lost when the cell was reset or has another scenario, CellTimeout when the boundary does "
          "not "
          "come; then it may be called again.")
      .def("advance_ahead", &LockstepController::advance_ahead, unlocked,
           R"(Answers this boundary as advance() does, and goes on to the next one without a wait (lookahead).

For set-points that do not depend on the cell: state stays as it is, and the cell follows as fast as it computes, with the
same bits. The commands leave some periods later, at the latest with advance() or send_ahead(). 63 boundaries ahead of the
cell it waits as advance() does, and raises what that raises.)")
      .def("send_ahead", &LockstepController::send_ahead, unlocked,
           "Sends what advance_ahead() has kept back.")
      .def("close", &LockstepController::close, unlocked,
           "Unregisters. The cell stays at the present boundary when no other controller is registered.");
}

}  // namespace
}  // namespace takt::python

PYBIND11_MODULE(_takt, m) {
  m.doc() = "takt::Client for Python; use the package takt.";
  takt::python::bind_errors();
  takt::python::bind_cell(m);
  takt::python::bind_arm(m);
  takt::python::bind_client(m);
  takt::python::bind_lockstep(m);
}
