#include "server/runtime/recording/snapshot_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "idl/common/atomic_file.h"
#include "idl/common/text.h"
#include "server/simulation/model/model_hash.h"
#include "server/simulation/step/simulation.h"

namespace takt {

namespace {
constexpr char kSnapshotMagic[8] = {'T', 'A', 'K', 'T', 'S', 'N', 'A', 'P'};
constexpr std::uint32_t kSnapshotVersion = 2;
constexpr std::size_t kMaxNameLetters = 4096;
constexpr std::uint64_t kLargestState = 1ULL << 32U;

/// In this order in the file, followed by the name's letters and the state.
struct Header {
  char magic[8];
  std::uint32_t version;
  std::uint32_t checksum;  ///< of all other bytes of the file
  std::uint64_t model, step;
  double time_s;
  std::uint64_t name_length, state_length;
};
static_assert(sizeof(Header) == 56 && std::is_trivially_copyable_v<Header>);

std::uint32_t checksum(Header header, std::string_view name, std::span<const std::byte> state) {
  header.checksum = 0;
  auto sum = crc32_z(0, reinterpret_cast<const Bytef*>(&header), sizeof(header));
  sum = crc32_z(sum, reinterpret_cast<const Bytef*>(name.data()), name.size());
  sum = crc32_z(sum, reinterpret_cast<const Bytef*>(state.data()), state.size());
  return static_cast<std::uint32_t>(sum);
}

std::string quoted(const std::filesystem::path& file) {
  return "the snapshot file '" + file.string() + "'";
}

SnapshotResult system_error(SnapshotError error, const std::filesystem::path& file, const char* what) {
  return {error, quoted(file) + " cannot be " + what + ": " + std::strerror(errno)};
}

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  int get() const { return fd_; }

 private:
  int fd_;
};

/// A result smaller than `size` is the end of the file, a negative one an error.
ssize_t read_all(int fd, void* to, std::size_t size) {
  std::size_t done = 0;
  while (done < size) {
    const ssize_t n = ::read(fd, static_cast<char*>(to) + done, size - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return -1;
    if (n == 0) break;
    done += static_cast<std::size_t>(n);
  }
  return static_cast<ssize_t>(done);
}
}  // namespace

SnapshotIdentity identity_of(const Simulation& simulation) {
  return {simulation.description().scenario, model_hash(simulation.model()), simulation.step_index(),
          simulation.time_s()};
}

SnapshotResult write_snapshot_file(const std::filesystem::path& file, const SnapshotIdentity& identity,
                                   std::span<const std::byte> state) {
  Header header{};
  std::memcpy(header.magic, kSnapshotMagic, sizeof(kSnapshotMagic));
  header.version = kSnapshotVersion;
  header.model = identity.model, header.step = identity.step, header.time_s = identity.time_s;
  const std::string_view name = std::string_view(identity.scenario).substr(0, kMaxNameLetters);
  header.name_length = name.size(), header.state_length = state.size();
  header.checksum = checksum(header, name, state);

  const std::string_view head(reinterpret_cast<const char*>(&header), sizeof(header)),
      bytes(reinterpret_cast<const char*>(state.data()), state.size());
  if (const std::error_code error = replace_file(file, {head, name, bytes}))
    return {SnapshotError::not_readable, quoted(file) + " cannot be written: " + error.message()};
  return {};
}

SnapshotResult read_snapshot_file(const std::filesystem::path& file, SnapshotFile& content) {
  const Descriptor in(::open(file.c_str(), O_RDONLY | O_CLOEXEC));
  if (in.get() < 0)
    return system_error(errno == ENOENT ? SnapshotError::not_found : SnapshotError::not_readable, file,
                        "opened");
  struct stat status {};
  if (::fstat(in.get(), &status) != 0) return system_error(SnapshotError::not_readable, file, "read");
  if (!S_ISREG(status.st_mode))
    return {SnapshotError::not_readable, quoted(file) + " cannot be read: it is no regular file"};
  Header header{};
  const ssize_t head = read_all(in.get(), &header, sizeof(header));
  if (head < 0) return system_error(SnapshotError::not_readable, file, "read");
  const auto begins_right = std::min(static_cast<std::size_t>(head), sizeof(kSnapshotMagic));
  if (begins_right == 0 || std::memcmp(header.magic, kSnapshotMagic, begins_right) != 0)
    return {
        SnapshotError::not_a_snapshot,
        quoted(file) + (begins_right == 0 ? " is empty" : " is no snapshot of takt: it begins otherwise")};
  const auto damaged = [&](const std::string& what) {
    return SnapshotResult{SnapshotError::damaged, quoted(file) + " is damaged: " + what};
  };
  const auto length = static_cast<std::uint64_t>(status.st_size);
  if (head < static_cast<ssize_t>(sizeof(header)))
    return damaged("it ends after " + std::to_string(length) + " bytes, within its head");
  if (header.version != kSnapshotVersion)
    return {SnapshotError::other_version, quoted(file) + " has format " + std::to_string(header.version) +
                                              "; this program reads format " +
                                              std::to_string(kSnapshotVersion)};
  if (header.name_length > kMaxNameLetters || header.state_length > kLargestState)
    return damaged("the lengths in its head cannot be");
  const std::uint64_t expected = sizeof(header) + header.name_length + header.state_length;
  if (length != expected)
    return damaged("it has " + std::to_string(length) + " bytes instead of " + std::to_string(expected));
  std::string name(header.name_length, '\0');
  std::vector<std::byte> state(header.state_length);
  if (read_all(in.get(), name.data(), name.size()) != static_cast<ssize_t>(name.size()) ||
      read_all(in.get(), state.data(), state.size()) != static_cast<ssize_t>(state.size()))
    return system_error(SnapshotError::not_readable, file, "read");
  if (checksum(header, name, state) != header.checksum)
    return damaged("its checksum is not that of its content");
  content.identity = {std::move(name), header.model, header.step, header.time_s};
  content.state = std::move(state);
  return {};
}

SnapshotResult check_identity(const std::filesystem::path& file, const SnapshotIdentity& found,
                              const Simulation& simulation) {
  const SnapshotIdentity wanted = identity_of(simulation);
  if (found.scenario != wanted.scenario)
    return {SnapshotError::other_scenario, quoted(file) + " is of the scenario '" + found.scenario +
                                               "', but '" + wanted.scenario + "' is loaded"};
  if (found.model != wanted.model)
    return {SnapshotError::other_scenario,
            quoted(file) + " is of another model (" + hexadecimal_text(found.model) + ") of the scenario '" +
                wanted.scenario + "' than the one loaded (" + hexadecimal_text(wanted.model) +
                "): shapes, masses, constants and solver must be the same"};
  return {};
}

SnapshotResult save_snapshot_file(const std::filesystem::path& file, Simulation& simulation) {
  std::vector<std::byte> state;
  if (const std::string why = simulation.save_state(state); !why.empty())
    return {SnapshotError::refused, quoted(file) + " was not written, as it could not be restored: " + why};
  return write_snapshot_file(file, identity_of(simulation), state);
}

SnapshotResult restore_snapshot_file(const std::filesystem::path& file, Simulation& simulation) {
  SnapshotFile content;
  if (SnapshotResult result = read_snapshot_file(file, content); !result.good()) return result;
  if (SnapshotResult result = check_identity(file, content.identity, simulation); !result.good())
    return result;
  if (const std::string why = simulation.restore_state(content.state); !why.empty())
    return {SnapshotError::damaged, quoted(file) + " cannot be restored: " + why};
  return {};
}

}  // namespace takt
