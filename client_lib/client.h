#pragma once
// takt::Client: the C++ interface to a running cell. A complete program is examples/scripted_publisher.cpp;
// in short:
//
//   takt::Client cell({.cell = "cell"});                        // waits until the cell has described itself
//   cell.play();
//   cell.send_joint_command("Robot1", {0, -1.57, 1.57, -1.57, -1.57, 0});
//   cell.set_gripper("Gripper1", takt::GripperAction::close);
//   auto state = cell.wait_for(takt::topics::state, [](auto& s) { return s.partner_of("C") == "Gripper1"; }, 5s);
//   if (!state) ...                                              // not within 5 s of wall time
//
// Every function may be called from any thread. Functions that wait do so without polling, for at most the
// given wall time, and throw ClientError when the server has gone away meanwhile. Samples are received by
// threads of DDS; the client keeps the newest state and drops what is older than it (by epoch and step). It
// also drops what is older than the reply to a request: after step(100) or reset(), state() returns an instant
// at or after that request.
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client_lib/cell.h"
#include "client_lib/kinematics/trajectory_point.h"
#include "idl/vocabulary/arguments.h"

namespace takt {

using Seconds = std::chrono::duration<double>;

/// An error of the client: a whole sentence (what()), a kind, and for a request the result code of the server.
class ClientError : public std::runtime_error {
 public:
  /// Where the error arose.
  enum class Kind {
    timeout,    ///< no answer within the time allowed
    not_found,  ///< no such cell, robot, gripper or component
    invalid,    ///< refused here, before sending: wrong count, not a finite number
    refused,    ///< refused by the server; result() says how
    lost,       ///< the server went away
    transport,  ///< DDS could not do what it was asked to
  };
  /// An error of this kind with its sentence.
  ClientError(Kind kind, const std::string& sentence, std::optional<ControlResult> result = {})
      : std::runtime_error(sentence), kind_(kind), result_(result) {}
  /// Where the error arose.
  Kind kind() const { return kind_; }
  /// Result of the server's reply (docs/requests.md lists those of each request); nothing when the error did
  /// not come from the server.
  std::optional<ControlResult> result() const { return result_; }

 private:
  Kind kind_;
  std::optional<ControlResult> result_;
};

/// How a client finds its cell, and how long its calls wait.
struct ClientOptions {
  std::string cell = default_cell();  ///< name of the server
  int domain = default_domain();      ///< DDS domain, 0..232
  Seconds timeout{10.0};              ///< for connecting, and for calls that are given none
  /// A server from which nothing was heard for this long counts as gone. It sends its status ten times a
  /// second.
  Seconds liveliness_timeout{5.0};
  std::string name = "client";  ///< shown to others, e.g. in events about commands; a unique suffix is added
  std::uint32_t ownership_strength =
      1;  ///< of several senders of commands for one robot the strongest is heard
  /// Fast DDS profiles (XML) with a participant profile `takt_client`; without, discovery stays on this
  /// machine.
  std::string profiles_file;
  std::string profile = "takt_client";  ///< name of the profile in that file
  /// Directory with this client's identity and permissions (docs/network.md); empty: no security.
  std::string secure_directory = default_secure_directory();

  /// Called by every call that waits, in its thread, at least each 0.2 s; what it throws ends the wait.
  std::function<void()> while_waiting{};

  static std::string default_cell();              ///< environment TAKT_CELL, else "cell"
  static int default_domain();                    ///< environment TAKT_DOMAIN, else 0
  static std::string default_secure_directory();  ///< environment TAKT_SECURE, else none
};

/// The reply to a request that is named by a text.
struct Reply {
  std::string message;  ///< a whole sentence
  Arguments values;     ///< the fields of the response by name
  /// A value as text, e.g. "0.5"; empty for an unknown name.
  std::string text(std::string_view name) const;
};

/// The response to a request (docs/requests.md), with the sentence of the server.
template <Request Type>
struct Answer : ResponseOf<Type> {
  std::string message{};  ///< a whole sentence
};

/// Why a component is held as it is.
using PartExplanation = Answer<requests::ExplainPart>;

/// Options of Client::load_scenario.
struct LoadOptions {
  std::vector<std::string> overrides;  ///< KEY=VALUE, e.g. solver.step_s=0.0005
  std::optional<int> level_of_detail;  ///< of every process
  std::optional<Seconds> timeout;      ///< large meshes take their time
};

/// A client of one running cell: commands, requests and the newest samples.
class Client {
 public:
  /// Joins the domain and waits until the cell has sent its description and status. Throws ClientError:
  /// not_found when the cell does not answer within options.timeout (the text names the cells that do),
  /// transport when DDS cannot start. From then on Fast DDS uses its transports within this process, too.
  explicit Client(ClientOptions options = {});
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// Identity used in requests, and in events about this client's commands.
  const std::string& client_id() const;

  // --- what is the case ---
  /// The newest description. The pointer changes when the server is started again or loads another scenario.
  /// Without a scenario the description is empty and the server sends no state.
  std::shared_ptr<const CellInfo> cell() const;
  /// The newest state. Waits (options.timeout) for the first one. After a request that changes the instant it
  /// waits for a state at or after that instant. In all other cases it returns at once.
  State state() const;
  /// The newest status. Waits for the first one. After a request that changes the status (set_state, set_pace,
  /// set_level_of_detail, ...) it waits for a status that the server sent after the change.
  Status status() const;
  /// True if a sample has arrived within options.liveliness_timeout and DDS still announces the server.
  bool connected() const;
  /// Packets that this client's guard has dropped, by reason (docs/network.md): "3 source, 1 locator"; empty: none.
  std::string dropped_packets() const;
  /// Waits until the cell answers, e.g. because its server was started again; false on timeout. Never throws
  /// for a cell that is gone.
  [[nodiscard]] bool wait_for_connection(Seconds timeout) const;

  /// The first sample of a topic, e.g. topics::contacts, from the newest on, that fulfils the predicate. Empty on
  /// timeout; without a timeout it is options.timeout. takt_topics.h lists the topics; idl/*.idl describes their
  /// samples. The predicate runs in the calling thread. A slow predicate gets the newest sample, not every sample.
  ///
  /// Of topics::event each sample counts: the client keeps the newest 10000 events since the connection, in order.
  /// Each event is returned once, and a wait drops events that do not fulfil its predicate.
  ///
  /// The client receives state, status, events and description from the connection on. The first wait for another
  /// topic subscribes to it. `element` is the robot, for a topic that each robot has. Throws ClientError: invalid for
  /// a topic that clients write, not_found for a robot that the cell does not have.
  template <Message Type>
  [[nodiscard]] std::optional<SampleOf<Type>> wait_for(
      const Topic<Type>& topic, const std::function<bool(const SampleOf<Type>&)>& predicate,
      std::optional<Seconds> timeout = {}, const std::string& element = {}) const {
    const auto deadline = deadline_after(timeout);
    Received received;
    while ((received = next_sample(topic, element, received.number, deadline)).sample) {
      const auto& sample = *static_cast<const SampleOf<Type>*>(received.sample.get());
      if (predicate(sample)) return sample;
    }
    return std::nullopt;
  }
  /// The newest sample, or the first one to come; of topics::event the next one. Empty on timeout.
  template <Message Type>
  [[nodiscard]] std::optional<SampleOf<Type>> wait_for(const Topic<Type>& topic,
                                                       std::optional<Seconds> timeout = {},
                                                       const std::string& element = {}) const {
    return wait_for(
        topic, [](const auto&) { return true; }, timeout, element);
  }

  // --- commands ---
  /// Set-point of all joints of a robot, in the order of RobotDescription::joints. The robot reaches
  /// `positions` with `velocities` one command period later. Without velocities the server derives them from
  /// successive positions. `stamp_s` is the simulated time for which the sender means the command; without it
  /// the command takes effect when it arrives. `efforts` (empty, or N m or N for each joint) are added to the
  /// output of the drives' controllers at level of detail 2 and 3. They hold until the robot's next command, a
  /// missed deadline or a reset. The first command for a robot waits until the server listens, so that it is
  /// not lost. Throws ClientError: not_found, invalid; timeout when no server listens. The server checks the
  /// limits and reports a rejected command in the event command_rejected.
  void send_joint_command(const std::string& robot, const std::vector<double>& positions,
                          const std::vector<double>& velocities = {}, std::optional<double> stamp_s = {},
                          const std::vector<double>& efforts = {});
  /// Torques (N m) or forces (N) of all joints of a robot at level of detail 2 or 3, instead of a set-point: they
  /// act besides those that carry the robot's own weight, without position control, until the robot's next
  /// command. A robot that misses its deadline brakes and holds its position. At level of detail 1 the server
  /// refuses them, with the event command_rejected. Otherwise as above.
  void send_joint_torques(const std::string& robot, const std::vector<double>& torques,
                          std::optional<double> stamp_s = {});
  /// A motion of all joints from the robot's present position through `points`. The path is linear through
  /// positions alone, cubic with velocities, and quintic with velocities and accelerations. All points have
  /// the same fields. Efforts (as above) are linear from point to point, and those of the last point stay. The
  /// motion starts at `start_s` (simulated time), or on arrival if it is not given; the server skips the part
  /// that is in the past. A set-point or another trajectory replaces the motion; a trajectory without points
  /// stops the robot. The event trajectory_done reports the end. In lockstep the robot needs no other command
  /// until then. Otherwise as above.
  void send_trajectory(const std::string& robot, const std::vector<TrajectoryPoint>& points,
                       std::optional<double> start_s = {});
  /// Sets signals of a device; all other signals keep their values. Otherwise as above.
  void set_signals(const std::string& device, const std::map<std::string, double>& signals,
                   std::optional<double> stamp_s = {});
  /// `width_m` counts for GripperAction::width only, `max_force_N` 0 is the gripper's own limit. Otherwise as
  /// above.
  void set_gripper(const std::string& gripper, GripperAction action, double width_m = 0.0,
                   double max_force_N = 0.0, std::optional<double> stamp_s = {});
  /// The set-points and the commands of grippers and devices that `send` sends in the calling thread leave in one sample
  /// (takt_msgs/Commands) when it returns: with several targets that costs a fraction of the time. More than 64 of a kind take
  /// more samples. What has not left is not sent if `send` throws.
  void send_together(const std::function<void()>& send);

  // --- what a controller says of its program ---
  // For viewers and recorders, which get the newest sample when they come. The server does not read it.
  // Throws ClientError (transport).

  /// The program that a controller runs for the robot: its text and its name.
  void publish(const std::string& robot, const takt_msgs::msg::Program& program);
  /// The steps that it has begun.
  void publish(const std::string& robot, const takt_msgs::msg::ProgramSteps& steps);

  // --- requests ---
  // Each request waits for its reply. It throws ClientError: refused (with the server's sentence), timeout, lost.
  // The default timeout is options.timeout.

  /// Any request of docs/requests.md, e.g. call(requests::SaveSnapshot{.name = "before"}).uri.
  template <Request Type>
  Answer<Type> call(const Type& wanted, std::optional<Seconds> timeout = {}) {
    const std::string name(request_info<Type>().name);
    Reply reply = request(name, arguments_of(wanted), timeout);
    Answer<Type> answer;
    answer.message = std::move(reply.message);
    read_values(name, reply.values, static_cast<ResponseOf<Type>&>(answer));
    return answer;
  }
  /// The same by name.
  Reply request(const std::string& name, const Arguments& arguments, std::optional<Seconds> timeout = {});
  /// With arguments as a person types them (arguments_of_text()).
  Reply request(const std::string& name, const std::map<std::string, std::string>& arguments = {},
                std::optional<Seconds> timeout = {});

  /// Whether the simulation plays, is paused or stopped.
  SimulationState get_state() { return call(requests::GetState{}).state; }
  /// Plays, pauses or stops; stopping resets the simulation.
  void set_state(SimulationState state) { call(requests::SetState{state}); }
  /// Lets the simulation run at its pace.
  void play() { set_state(SimulationState::playing); }
  /// Holds the simulation at the present step.
  void pause() { set_state(SimulationState::paused); }
  /// Advances a paused simulation by this many steps and returns when they are done.
  void step(std::uint64_t steps = 1, std::optional<Seconds> timeout = {}) {
    call(requests::Step{steps}, timeout);
  }
  /// Back to the initial state; the epoch counts up.
  void reset() { call(requests::Reset{}); }
  /// `factor` scales simulated against wall time (realtime only).
  void set_pace(Pace pace, double factor = 1.0) {
    call(requests::SetPace{pace, pace == Pace::realtime ? factor : 1.0});
  }
  /// Sets the level of detail, 1 to 3, of a process ("all": of every process) from the present instant on. The server
  /// refuses a level that a robot cannot have, and level 3 without a section 'contact' in the scenario. A reset
  /// restores the levels of the scenario.
  void set_level_of_detail(int level, const std::string& process = "all") {
    call(requests::SetLevelOfDetail{level, process});
  }
  /// Registers this client as a controller. In lockstep the simulation then waits at each multiple of `period` for a
  /// command for every target (robots, grippers, devices) from this client. After `command_timeout` of wall time
  /// without them it pauses and sends an event. The answer has the first such instant. LockstepController (lockstep_controller.h)
  /// does all this.
  Answer<requests::RegisterController> register_controller(const std::string& name, Seconds period,
                                                           Seconds command_timeout,
                                                           const std::vector<std::string>& targets) {
    return call(requests::RegisterController{name, period.count(), command_timeout.count(), targets});
  }
  /// Ends register_controller(): the simulation does not wait for this controller.
  void unregister_controller(const std::string& name) { call(requests::UnregisterController{name}); }
  /// Explains why a Part is free, grasped, placed or assembled: its holder, the rule, the time of the last change, and
  /// the components that it touches. For a Gripper or Ground: the Parts that it holds. The server answers between two
  /// steps; the request has no effect on the simulation.
  PartExplanation explain_part(const std::string& part, std::optional<Seconds> timeout = {}) {
    return call(requests::ExplainPart{part}, timeout);
  }

  /// Loads another scenario and returns its description when it has arrived. A relative `file` starts at the working
  /// directory of the server. The simulation is stopped afterwards. If the server refuses the file, the error has the
  /// sentence of the scenario's reader, and the loaded scenario continues.
  std::shared_ptr<const CellInfo> load_scenario(const std::string& file, const LoadOptions& options = {}) {
    call(requests::LoadScenario{file, options.overrides, options.level_of_detail}, options.timeout);
    return cell();
  }
  /// The file of the loaded scenario again, with the same overrides.
  std::shared_ptr<const CellInfo> reload_scenario(std::optional<Seconds> timeout = {}) {
    call(requests::ReloadScenario{}, timeout);
    return cell();
  }
  /// Afterwards the description is empty and the server sends no state.
  void unload_scenario(std::optional<Seconds> timeout = {}) { call(requests::UnloadScenario{}, timeout); }

  /// A new Part, while the simulation is stopped.
  Answer<requests::SpawnEntity> spawn_entity(const requests::SpawnEntity& wanted,
                                             std::optional<Seconds> timeout = {}) {
    return call(wanted, timeout);
  }
  /// Any Part, while the simulation is stopped.
  void delete_entity(const std::string& entity, std::optional<Seconds> timeout = {}) {
    call(requests::DeleteEntity{entity}, timeout);
  }
  /// `filter`: name with * for any characters; empty: all.
  std::vector<requests::EntityInfo> get_entities(const std::string& filter = {},
                                                 std::optional<ComponentType> type = {}) {
    return call(requests::GetEntities{filter, type}).entities;
  }
  /// The server answers between two steps.
  Answer<requests::GetEntityState> get_entity_state(const std::string& entity) {
    return call(requests::GetEntityState{entity});
  }
  /// Puts a Part elsewhere while the simulation is paused or stopped.
  void set_entity_state(const requests::SetEntityState& wanted) { call(wanted); }
  /// Attaches a Part to the component `to` until detach(), independent of contacts.
  void attach(const std::string& part, const std::string& to) { call(requests::Attach{part, to}); }
  /// Ends attach(); contacts decide again.
  void detach(const std::string& part) { call(requests::Detach{part}); }
  /// Fixes NAME.SIGNAL of a device, gripper or robot to a value until release_signal().
  void force_signal(const std::string& signal, double value) { call(requests::ForceSignal{signal, value}); }
  /// Ends force_signal().
  void release_signal(const std::string& signal) { call(requests::ReleaseSignal{signal}); }

  /// The whole state of the simulation, under a name, in a file of the server.
  Answer<requests::SaveSnapshot> save_snapshot(const std::string& name, std::optional<Seconds> timeout = {}) {
    return call(requests::SaveSnapshot{name}, timeout);
  }
  /// Back to that state, of the same scenario; without a name: the newest periodic one. The epoch counts up.
  Answer<requests::RestoreSnapshot> restore_snapshot(const std::string& name = {},
                                                     std::optional<Seconds> timeout = {}) {
    return call(requests::RestoreSnapshot{name}, timeout);
  }
  /// Records all commands and requests that change the simulation, in a file of the server.
  Answer<requests::StartRecording> start_recording(const std::string& name) {
    return call(requests::StartRecording{name});
  }
  /// Closes the file of start_recording(); the answer has its path and the number of steps.
  Answer<requests::StopRecording> stop_recording() { return call(requests::StopRecording{}); }

 private:
  template <typename Response>
  static void read_values(const std::string& name, const Arguments& values, Response& response) {
    if (const auto fault = read_arguments(name, values, response))
      throw ClientError(ClientError::Kind::refused, fault->sentence);
  }
  using Clock = std::chrono::steady_clock;
  Clock::time_point deadline_after(std::optional<Seconds> timeout) const;
  struct Received {
    std::shared_ptr<void> sample;  ///< a SampleOf the topic's type
    std::uint64_t number = 0;      ///< its sample_number
  };
  /// The newest sample of the topic, or the first one behind that of the number `seen`; an empty one when the
  /// deadline has passed.
  Received next_sample(const TopicInfo& topic, const std::string& element, std::uint64_t seen,
                       Clock::time_point deadline) const;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A cell that list_cells() has found.
struct FoundCell {
  std::string name;              ///< of the server
  std::optional<Status> status;  ///< empty: the cell is announced, but its status has not arrived
  int servers = 1;  ///< above 1 is a mistake: all of them answer; `status` comes from one of them
};

/// The cells on a domain. Without a profile it returns when each participant of this machine is known, by the ports that
/// the kernel lists, and each server among them has answered. With a profile, or beside a port without a participant,
/// discovery has no end: then no other was found for as long again, at least 0.15 s. Without an answer it returns after
/// `duration` of wall time.
std::vector<FoundCell> list_cells(
    int domain, Seconds duration = Seconds{2.0}, const std::string& profiles_file = {},
    const std::string& secure_directory = ClientOptions::default_secure_directory(),
    const std::string& profile = "takt_client");

}  // namespace takt
