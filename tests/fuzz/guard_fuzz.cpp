// Sends mutated RTPS packets to a service with matched endpoints and checks that it continues to serve. The
// packets are those of a real client, recorded at reception and injected at the same place, so that none is
// lost; some also go over UDP, which has threads of its own. With --no-guard stock Fast DDS in a child
// process gets the same packets, and must die.
#include <arpa/inet.h>
#include <malloc.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cinttypes>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <new>

#include "server/dds/dds_adapter.h"
#include "server/runtime/monotonic_clock.h"
#include "tests/fuzz/packet_mutator.h"
#include "tests/support/dds_service.h"

namespace takt::test {
namespace {

struct Options {
  std::uint64_t packets = 100'000, seed = 1, udp_every = 64;
  bool guard = true;
};

double resident_MB() {
  malloc_trim(0);
  std::ifstream file("/proc/self/statm");
  std::uint64_t total = 0, resident = 0;
  file >> total >> resident;
  return static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

class UdpSender {
 public:
  UdpSender() : socket_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}
  ~UdpSender() { close(socket_); }
  UdpSender(const UdpSender&) = delete;
  UdpSender& operator=(const UdpSender&) = delete;
  void send(const std::vector<std::uint8_t>& packet, std::uint16_t port) const {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    (void)sendto(socket_, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&address),
                 sizeof(address));
  }

 private:
  int socket_;
};

/// A client with an endpoint for everything, that has used each of them.
class Peer {
 public:
  explicit Peer(const CellDescription& cell) {
    const auto& robot = cell.robots.front();
    joints_ = client.dds.write<sensor_msgs::msg::JointState>(
        RawCellClient::topic(robot.name + "/joint_commands"), true);
    gripper_ = client.dds.write<msg::GripperCommand>(
        RawCellClient::topic(cell.grippers.front().name + "/command"), true);
    description_ = client.dds.read<msg::CellDescription>(RawCellClient::topic("description"), true, true, 1);
    joints_.matches->wait_for(1);
    gripper_.matches->wait_for(1);
    description_->wait_until([](const auto& messages) { return !messages.empty(); });
    sensor_msgs::msg::JointState command;
    for (const auto& joint : robot.arm.joints) {
      command.name.push_back(joint.name);
      command.position.push_back(0.1);
    }
    msg::GripperCommand close;
    close.action = static_cast<GripperAction>(1);
    for (int i = 0; i < 5; ++i) {
      joints_.writer->write(&command);
      gripper_.writer->write(&close);
      client.request("get_state");
    }
    RawCellClient::Arguments many;
    for (int i = 0; i < 40; ++i) many.emplace_back("name" + std::to_string(i), std::string(4000, 'x'));
    client.request("get_state", many);  // in fragments
  }
  RawCellClient client;

 private:
  RawWriter joints_, gripper_;
  std::shared_ptr<Inbox<msg::CellDescription>> description_;
};

/// 0: all packets sent and the service serves; else the failure has been printed.
int attack(const Options& options, std::atomic<std::uint64_t>& thrown) {
  // Samples inside one process take the same way as those between processes.
  deliver_through_transports();

  const auto hook = std::make_shared<PacketHook>();
  const auto model = service_model(test_cell());
  HostOptions host_options;
  host_options.cell = test_cell();
  CellHost host(host_options);
  ParticipantOptions participant{"fuzzed server", test_domain(), "", ""};
  participant.guard = options.guard;
  participant.prepare = [&](dds::DomainParticipantQos& qos) { PacketHook::attach(hook, qos); };
  DdsAdapter adapter(host, participant);
  host.open(model);
  int result = 0;
  {
    Peer recorded(model->description);
    PacketMutator mutator(hook->stop_recording(), options.seed);
    RawCellClient honest;
    const auto serves = [&](RawCellClient& client, const char* who) {
      // Among 400 000 packets a second a request or reply may be overwritten by others ahead of its reading;
      // takt::Client repeats it then.
      for (int i = 0; i < 10; ++i) {
        if (client.request_within(30, "get_state").result == 1) return true;
      }
      std::printf("after %" PRIu64 " packets %s got no answer\n", thrown.load(), who);
      result = 1;
      return false;
    };
    const auto ports = hook->udp_ports();
    std::printf("%zu packets to begin with, %zu UDP ports, seed %" PRIu64 "\n", mutator.seeds(), ports.size(),
                options.seed);
    std::fflush(stdout);
    const UdpSender udp;
    const std::int64_t began = monotonic_now_ns();
    const std::uint64_t interval = std::max<std::uint64_t>(options.packets / 20, 1);
    double early_MB = 0.0;
    for (std::uint64_t i = 1; i <= options.packets && result == 0; ++i) {
      const PacketMutator::Packet packet = mutator.next();
      thrown.store(i, std::memory_order_relaxed);  // ahead of the packet, as it may be the last
      hook->inject(packet.channel, packet.bytes);
      if (i % options.udp_every == 0 && !ports.empty())
        udp.send(packet.bytes, ports[(i / options.udp_every) % ports.size()]);
      if (i % 10'000 == 0) {
        recorded.client.forget();
        honest.forget();
      }
      if (i % interval != 0 || !serves(honest, "a client beside")) continue;
      if (i / interval == 2) early_MB = resident_MB();
      const double seconds = static_cast<double>(monotonic_now_ns() - began) * 1e-9;
      std::printf("%" PRIu64 " packets, %.0f per s, %.0f MB resident\n", i, static_cast<double>(i) / seconds,
                  resident_MB());
      std::fflush(stdout);
    }
    RawCellClient late;
    if (result == 0) serves(late, "a client that came afterwards");
    std::printf("resident memory: %.0f MB after a tenth, %.0f MB at the end\n", early_MB, resident_MB());
    if (const PacketGuard* guard = adapter.guard())
      std::printf("let through %" PRIu64 ", dropped %" PRIu64 ": %s\n", guard->counted(RtpsError::none),
                  guard->dropped(), guard->summary().c_str());
  }
  host.stop();
  adapter.stop();
  if (result == 0) std::printf("the service went on serving\n");
  std::fflush(stdout);
  return result;
}

/// 0 if the unguarded service died of it.
int attack_stock(const Options& options) {
  void* shared = mmap(nullptr, sizeof(std::atomic<std::uint64_t>), PROT_READ | PROT_WRITE,
                      MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (shared == MAP_FAILED) return 2;
  auto* thrown = new (shared) std::atomic<std::uint64_t>(0);
  // A child that neither ends nor continues hangs, or receives no packets.
  sigset_t ended;
  sigemptyset(&ended);
  sigaddset(&ended, SIGCHLD);
  sigprocmask(SIG_BLOCK, &ended, nullptr);
  const pid_t child = fork();
  if (child == 0) {
    const rlimit no_core{0, 0};
    setrlimit(RLIMIT_CORE, &no_core);
    _exit(attack(options, *thrown));
  }
  const timespec patience{10, 0};
  int idle = 0;  // periods of patience without a packet
  bool hung = false;
  for (std::uint64_t before = 0; sigtimedwait(&ended, nullptr, &patience) < 0; before = thrown->load()) {
    idle = thrown->load() == before ? idle + 1 : 0;
    hung = idle > (before == 0 ? 12 : 0);  // the start on a busy machine takes longer
    if (hung) kill(child, SIGKILL);
  }
  int status = 0;
  waitpid(child, &status, 0);
  if (hung && thrown->load() == 0) {
    std::printf("the service without the guard has not started\n");
    return 1;
  }
  if (WIFSIGNALED(status)) {
    std::printf("without the guard the service %s after %" PRIu64 " packets of seed %" PRIu64 ": %s\n",
                hung ? "hung" : "died", thrown->load(), options.seed, strsignal(WTERMSIG(status)));
    return 0;
  }
  std::printf("without the guard the service survived %" PRIu64 " packets\n", thrown->load());
  return 1;
}

}  // namespace
}  // namespace takt::test

int main(int argc, char** argv) {
  takt::test::Options options;
  bool no_guard = false;
  CLI::App app("Mutated RTPS packets against the service. 0: it went on serving (with --no-guard: it died).");
  app.add_option("--packets", options.packets, "how many")->capture_default_str();
  app.add_option("--seed", options.seed, "of the mutations")->capture_default_str();
  app.add_option("--udp-every", options.udp_every, "which of them go over UDP too")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_flag("--no-guard", no_guard, "stock Fast DDS, in a child process that is to die");
  CLI11_PARSE(app, argc, argv);
  options.guard = !no_guard;
  if (no_guard) return takt::test::attack_stock(options);
  std::atomic<std::uint64_t> thrown{0};
  return takt::test::attack(options, thrown);
}
