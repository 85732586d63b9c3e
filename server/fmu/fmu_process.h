#pragma once
// A running FMU in a process of its own, takt-fmu-host: what it does there harms nothing here.
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "server/devices/fmu_link.h"
#include "server/fmu/fmu_archive.h"
#include "server/fmu/fmu_wire.h"

namespace takt {

struct FmuProcessParameters {
  std::filesystem::path host;                   ///< the program takt-fmu-host
  std::shared_ptr<const FreshDirectory> files;  ///< of the unpacked FMU
  fmu_wire::Start start;
  double timeout_s = 5.0;  ///< wall time of one call
};

/// Each restart() is that of a fresh process.
class FmuProcess final : public FmuLink {
 public:
  explicit FmuProcess(std::shared_ptr<const FmuProcessParameters> parameters) : p_(std::move(parameters)) {}
  ~FmuProcess() override { end(); }
  FmuProcess(const FmuProcess&) = delete;
  FmuProcess& operator=(const FmuProcess&) = delete;

  std::string restart(std::span<double> outputs) override;
  std::string step(double t, double h, std::span<const double> inputs, std::span<double> outputs) override;
  std::string take_message() override { return std::exchange(notice_, {}); }
  std::string save(std::vector<std::byte>& state) override;
  std::string load(std::span<const std::byte> state) override;

 private:
  std::string spawn();
  void end();
  /// How the process ended, after it has or has closed the socket.
  std::string how_it_ended();
  /// Sends message_ and receives the answer into it. `what`: for errors. Empty on success.
  std::string exchange(const char* what, double timeout_s);
  bool wait(short for_what, double deadline_s);
  std::string too_late(const char* what, double timeout_s);
  /// Bytes up to the deadline (monotonic, s).
  std::string send(const void* from, std::size_t size, double deadline_s, const char* what, double timeout_s);
  std::string receive(void* to, std::size_t size, double deadline_s, const char* what, double timeout_s);
  /// Reads status and texts of an answer; `rest`: its further content.
  std::string answer(const std::function<void(StateReader&)>& rest);

  std::shared_ptr<const FmuProcessParameters> p_;
  pid_t child_ = -1;
  int socket_ = -1;
  bool has_stepped_ = false;  ///< since the start
  std::vector<std::byte> message_;
  std::string notice_;
};

}  // namespace takt
