// The cost of security: a writer at 1 kHz and a reader of samples of 2 KB, without and with it, over shared
// memory and the guard as between server and client. One-way latency and CPU time of both ends together.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <vector>

#include "server/dds/participant.h"
#include "server/runtime/monotonic_clock.h"
#include "takt_msgs.h"
#include "tests/performance/processor_time.h"

namespace takt {
namespace {

using Sample = takt_msgs::msg::ControlRequest;

class Receiver final : public dds::DataReaderListener {
 public:
  void on_data_available(dds::DataReader* reader) override {
    Sample sample;
    dds::SampleInfo info;
    while (is_ok(reader->take_next_sample(&sample, &info))) {
      const std::int64_t now = monotonic_now_ns();
      const std::lock_guard lock(mutex_);
      latencies_us_.push_back(static_cast<double>(now - static_cast<std::int64_t>(sample.sequence_number)) *
                              1e-3);
      arrived_.notify_all();
    }
  }
  bool wait_for_one() {
    std::unique_lock lock(mutex_);
    return arrived_.wait_for(lock, std::chrono::milliseconds(100), [&] { return !latencies_us_.empty(); });
  }
  std::vector<double> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(latencies_us_, {});
  }

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::vector<double> latencies_us_;
};

struct Cost {
  std::size_t received = 0;
  double p50_us = 0.0, p99_us = 0.0, cpu_us = 0.0;
};

Cost measure(std::uint32_t domain, const std::string& writer_identity, const std::string& reader_identity,
             int samples) {
  ParticipantOptions options;
  options.domain = domain;
  options.name = "writer";
  options.secure_directory = writer_identity;
  DiscoveryListener discovery;  // its discoveries are ignored
  Participant from(options, discovery);
  options.name = "reader";
  options.secure_directory = reader_identity;
  Participant to(options, discovery);
  Receiver receiver;
  const std::string topic = "rt/bench/control/request";
  auto* writer = from.create_writer<takt_msgs::msg::ControlRequest>(
      topic, writer_qos(from.default_writer_qos(), qos_of(TopicQos::event)));
  to.create_reader<takt_msgs::msg::ControlRequest>(
      topic, service_reader_qos(to.default_reader_qos(), qos_of(TopicQos::control)), &receiver);
  Sample sample;
  takt_msgs::msg::Argument argument;
  argument.value.text = std::string(2000, 'x');
  sample.arguments.push_back(argument);
  const auto send = [&] {
    sample.sequence_number = static_cast<std::uint64_t>(monotonic_now_ns());
    (void)writer->write(&sample, dds::HANDLE_NIL);
  };
  do send();
  while (!receiver.wait_for_one());
  constexpr std::int64_t period_ns = 1'000'000;
  const auto run = [&](int count) {
    std::int64_t next = monotonic_now_ns();
    for (int i = 0; i < count; ++i, next += period_ns) {
      system_monotonic_clock().sleep_until_ns(next);
      send();
    }
    (void)writer->wait_for_acknowledgments(DdsDuration(2, 0));
  };
  run(500);  // warm
  receiver.take();
  const double before = bench::processor_s();
  run(samples);
  const double used = bench::processor_s() - before;
  std::vector<double> latencies = receiver.take();
  to.silence();
  std::sort(latencies.begin(), latencies.end());
  const auto quantile = [&](double q) {
    return latencies.empty()
               ? 0.0
               : latencies[static_cast<std::size_t>(q * static_cast<double>(latencies.size() - 1))];
  };
  return {latencies.size(), quantile(0.5), quantile(0.99), used * 1e6 / samples};
}

int run(int samples, std::uint32_t domain) {
  std::string directory =
      (std::filesystem::temp_directory_path() / ("takt_bench_" + std::string(6, 'X'))).string();
  if (mkdtemp(directory.data()) == nullptr) return 1;
  const std::string script =
      std::string(TAKT_CONFIG_DIR) + "/dds/security/make_identities.sh '" + directory + "'";
  if (std::system(script.c_str()) != 0) return 1;
  deliver_through_transports();
  // Twice, alternating: on a shared machine the second pair shows the reliability of the first.
  std::printf("%-10s %10s %10s %10s %18s\n", "", "received", "p50 us", "p99 us", "CPU us per sample");
  for (int round = 0; round < 2; ++round) {
    for (const bool secured : {false, true}) {
      const Cost cost = measure(domain, secured ? directory + "/server" : "",
                                secured ? directory + "/observer" : "", samples);
      std::printf("%-10s %10zu %10.1f %10.1f %18.1f\n", secured ? "secured" : "plain", cost.received,
                  cost.p50_us, cost.p99_us, cost.cpu_us);
      std::fflush(stdout);
    }
  }
  std::filesystem::remove_all(directory);
  return 0;
}

}  // namespace
}  // namespace takt

int main(int argc, char** argv) {
  int samples = 5000;
  std::uint32_t domain = 100 + static_cast<std::uint32_t>(getpid()) % 100;
  CLI::App app("Cost of security in latency and CPU.");
  app.add_option("--samples", samples, "at 1 kHz")->capture_default_str();
  app.add_option("--domain", domain, "DDS domain");
  CLI11_PARSE(app, argc, argv);
  return takt::run(samples, domain);
}
