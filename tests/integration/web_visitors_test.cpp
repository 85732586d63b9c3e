// takt view and hostile or numerous visitors: their answers, and no effect on all others.
#include <gtest/gtest.h>

#include <condition_variable>
#include <fstream>
#include <list>
#include <mutex>
#include <optional>
#include <sstream>

#include "client_lib/view/addresses.h"
#include "client_lib/view/web_server.h"
#include "tests/support/built_programs.h"
#include "tests/support/child_process.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/web_client.h"

namespace {

using takt::test::ChildProcess;
using takt::test::TemporaryDirectory;
using takt::test::WebClient;

constexpr const char* kForeign = "Host: evil.example:8942\r\nOrigin: http://evil.example:8942\r\n";

bool says(const std::string& answer, const std::string& words) {
  return answer.find(words) != std::string::npos;
}

std::string deep_request(std::size_t levels) {
  return R"({"request": "x", "arguments": {"a": )" + std::string(levels, '[') + std::string(levels, ']') +
         "}}";
}

/// takt view of a recording, with a page of two files, as a program of its own: it may end, these tests not.
class Viewer : public testing::Test {
 protected:
  Viewer() {
    ChildProcess run({takt::test::kBin + "/takt-run", "run", takt::test::kBlockScenario, "--duration", "0.01",
                      "--quiet", "--mcap", (directory_ / "run.mcap").string()});
    EXPECT_EQ(run.wait(), 0) << run.text;
    std::filesystem::create_directories(directory_ / "page");
    std::ofstream(directory_ / "page/index.html") << "the page";
    std::ofstream(directory_ / "page/large.js") << std::string(3'000'000, 'x');
    std::ofstream(directory_ / "secret") << "the secret";
    std::filesystem::create_symlink(directory_ / "secret", directory_ / "page/link.txt");
  }
  void start(const std::string& more = "", const std::string& limits = "") {
    program_.emplace(std::vector<std::string>{
        "/bin/bash", "-c",
        limits + "exec " + takt::test::kBin + "/takt view --port 0 --page " + (directory_ / "page").string() +
            " " + more + " " + (directory_ / "run.mcap").string()});
    ASSERT_TRUE(program_->wait_for_output("Foxglove connects to ws://")) << program_->text;
    const std::size_t end = program_->text.find("/    (");
    ASSERT_NE(end, std::string::npos) << program_->text;
    port_ = static_cast<std::uint16_t>(std::stoi(program_->text.substr(program_->text.rfind(':', end) + 1)));
  }
  std::string page() { return WebClient(port_).ask("/"); }
  /// Of the program, of all its threads.
  double processor_time_s() const {
    std::ifstream file("/proc/" + std::to_string(program_->pid()) + "/stat");
    std::string text;
    std::getline(file, text);
    std::istringstream fields(text.substr(text.rfind(')') + 2));
    std::string skipped;
    for (int field = 3; field < 14; ++field) fields >> skipped;
    double user = 0.0, system = 0.0;
    fields >> user >> system;
    return (user + system) / static_cast<double>(sysconf(_SC_CLK_TCK));
  }

  const TemporaryDirectory directory_;
  std::optional<ChildProcess> program_;
  std::uint16_t port_ = 0;
};

TEST_F(Viewer, OnlyThePageIsServed) {
  start();
  EXPECT_TRUE(says(page(), "200 OK")) << page();
  EXPECT_TRUE(says(page(), "the page"));
  WebClient visitor(port_);
  const std::string secret = (directory_ / "secret").string();
  for (const std::string& target :
       {"/" + secret, "//" + secret, std::string("//etc/passwd"), std::string("/../secret"),
        std::string("/./../secret"), std::string("/link.txt"), std::string("/..//") + secret}) {
    const std::string answer = visitor.ask(target);
    EXPECT_TRUE(says(answer, "404 Not Found")) << target << ": " << answer;
    EXPECT_FALSE(says(answer, "the secret") || says(answer, "root:")) << target;
  }
  for (const std::string target : {"?", "#", "?x", "*", "index.html", "http://localhost/"}) {
    const std::string answer = WebClient(port_).ask(target);
    EXPECT_TRUE(says(answer, "400 Bad Request") || answer.empty()) << target << ": " << answer;
    EXPECT_TRUE(says(page(), "the page")) << "after " << target;
  }
  EXPECT_TRUE(says(WebClient(port_).ask("?"), "must begin with a slash"));
}

TEST_F(Viewer, TheSizeOfAFileIsGivenWithoutItsContent) {
  start();
  WebClient visitor(port_);
  visitor.send("HEAD /large.js HTTP/1.1\r\nHost: localhost\r\n\r\n");
  const std::string head = visitor.answer(true);
  EXPECT_TRUE(says(head, "200 OK") && says(head, "Content-Length: 3000000\r\n")) << head;
  const std::string whole = visitor.ask("/large.js");  // over the same connection
  EXPECT_TRUE(whole.starts_with("HTTP/1.1 200 OK")) << whole.substr(0, 300);
  EXPECT_EQ(whole.size() - whole.find("\r\n\r\n") - 4, 3'000'000U);
  visitor.send("POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 2\r\n\r\n{}");
  EXPECT_TRUE(says(visitor.answer(), "405 Method Not Allowed"));
}

TEST_F(Viewer, DeeplyNestedMessagesAreSurvived) {
  for (const char* rights : {"", "--observer"}) {
    start(rights);
    WebClient visitor(port_);
    ASSERT_TRUE(says(visitor.open(), "101 Switching"));
    visitor.call(7, deep_request(400'000));
    const std::string refused = visitor.hear_of("serviceCallFailure");
    EXPECT_TRUE(
        says(refused, *rights == '\0' ? "A request in JSON is wanted" : "Observers may look, not touch."))
        << refused;
    visitor.say(deep_request(400'000));
    EXPECT_TRUE(says(visitor.hear_of("understood"), "That message was not understood."));
    EXPECT_TRUE(says(page(), "the page"));
  }
  // Visitors from other machines may read, but not control.
  start("--address 0.0.0.0");
  WebClient foreign(port_);
  ASSERT_TRUE(
      says(foreign.open("Host: localhost\r\nOrigin: https://elsewhere.example\r\n"), "101 Switching"));
  EXPECT_TRUE(says(foreign.hear_of("serverInfo"), R"("control":"false")"));
  foreign.call(1, R"({"request": "play", "arguments": {}})");
  EXPECT_TRUE(says(foreign.hear_of("serviceCallFailure"), "Observers may look, not touch."));
}

TEST_F(Viewer, OnlyNamesOfThisMachineAreAnsweredOnAnyAddress) {
  for (const std::string address : {"127.0.0.1", "localhost", "127.0.0.5", "::1"}) {
    start("--address " + address);
    const bool six = address == "::1";
    const std::string name = address == "localhost" ? "localhost" : six ? "[::1]" : address;
    EXPECT_TRUE(says(program_->text, "http://" + name + ":" + std::to_string(port_) + "/ "))
        << program_->text;
    if (address == "127.0.0.5") continue;  // another address than the visitor's
    const std::string own = "Host: " + name + ":" + std::to_string(port_) + "\r\n";
    EXPECT_TRUE(says(WebClient(port_, six).ask("/", own), "200 OK")) << address;
    EXPECT_TRUE(says(WebClient(port_, six).ask("/", kForeign), "403 Forbidden")) << address;
    EXPECT_TRUE(says(WebClient(port_, six).open(kForeign), "403 Forbidden")) << address;
    EXPECT_TRUE(says(WebClient(port_, six).open(own), "101 Switching")) << address;
  }
}

TEST_F(Viewer, TheViewerIsIdleWithoutFileDescriptors) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "sanitizers ask by a pipe whether memory is there, and end the program that can have none";
#endif
  start("", "ulimit -n 60; ");
  std::list<WebClient> visitors;
  for (int i = 0; i < 70; ++i) visitors.emplace_back(port_);
  const double before_s = processor_time_s();
  ASSERT_TRUE(visitors.back().silent_for(std::chrono::milliseconds(1500)));
  EXPECT_LT(processor_time_s() - before_s, 0.5);
  visitors.clear();
  EXPECT_TRUE(says(page(), "the page"));
}

TEST_F(Viewer, TheOldestSilentConnectionIsClosed) {
  start();
  std::list<WebClient> silent;
  for (int i = 0; i < 250; ++i) silent.emplace_back(port_);
  EXPECT_TRUE(says(page(), "the page"));
  EXPECT_TRUE(silent.front().ended());  // the first to come is the first to go
  EXPECT_TRUE(says(silent.back().ask("/"), "the page"));
}

TEST_F(Viewer, TheFirstViewerWithoutASubscriptionMakesRoom) {
  start();
  WebClient watching(port_);
  ASSERT_TRUE(says(watching.open(), "101 Switching"));
  watching.say(R"({"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 1}]})");
  watching.say("x");
  ASSERT_TRUE(says(watching.hear_of("not understood"), "status"));
  std::list<WebClient> idle;
  for (int i = 0; i < 250; ++i) ASSERT_TRUE(says(idle.emplace_back(port_).open(), "101 Switching")) << i;
  EXPECT_TRUE(idle.front().ended());
  idle.back().say("x");
  EXPECT_TRUE(says(idle.back().hear_of("not understood"), "status"));
  watching.say("x");
  EXPECT_TRUE(says(watching.hear_of("not understood"), "status"));
}

TEST_F(Viewer, HugeAndEndlessMessagesEndTheirConnectionAlone) {
  start();
  WebClient other(port_);
  ASSERT_TRUE(says(other.open(), "101 Switching"));
  const std::string no_mask(4, '\0');
  WebClient huge(port_);
  ASSERT_TRUE(says(huge.open(), "101 Switching"));
  huge.send("\x81\xff" + std::string("\x00\x00\x01\x00\x00\x00\x00\x00", 8) + no_mask);  // of 2^40 bytes
  EXPECT_TRUE(huge.ended());
  WebClient endless(port_);
  ASSERT_TRUE(says(endless.open(), "101 Switching"));
  for (int i = 0; i < 64; ++i)  // one message, 4 MB so far
    endless.send((i == 0 ? "\x01" : std::string(1, '\0')) + "\xfe\xff\xff" + no_mask +
                 std::string(65535, ' '));
  EXPECT_TRUE(endless.ended());
  other.say("x");
  EXPECT_TRUE(says(other.hear_of("not understood"), "status"));
}

/// The server in this process, with a control that takes its time.
class Server : public testing::Test {
 protected:
  ~Server() override { let_go(); }
  takt::view::Answer control(const std::string& request) {
    std::unique_lock lock(mutex_);
    ++asked_;
    changed_.wait(lock, [&] { return free_; });
    return {takt::ControlResult::ok, "Done: " + request, {}};
  }
  void let_go() {
    const std::lock_guard lock(mutex_);
    free_ = true;
    changed_.notify_all();
  }
  takt::view::WebOptions options_ = [] {
    takt::view::WebOptions options;
    options.port = 0;
    return options;
  }();
  takt::view::Stream stream_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool free_ = false;
  int asked_ = 0;
};

TEST_F(Server, AFailureOfTheServerIsAnsweredWith500) {
  options_.metrics = []() -> std::string { throw std::out_of_range("a sample is not whole"); };
  const takt::view::WebServer server(stream_, options_,
                                     [&](const auto& request, const auto&) { return control(request); });
  WebClient visitor(server.port());
  const std::string answer = visitor.ask("/metrics");
  EXPECT_TRUE(says(answer, "500 Internal Server Error") && says(answer, "a sample is not whole")) << answer;
  EXPECT_TRUE(says(visitor.ask("/"), "200 OK"));
}

TEST_F(Server, PendingRequestsOfAVisitorAreBounded) {
  const takt::view::WebServer server(stream_, options_,
                                     [&](const auto& request, const auto&) { return control(request); });
  WebClient hasty(server.port()), other(server.port());
  ASSERT_TRUE(says(hasty.open(), "101 Switching"));
  ASSERT_TRUE(says(other.open(), "101 Switching"));
  for (std::uint32_t i = 1; i <= 101; ++i) hasty.call(i, R"({"request": "play", "arguments": {}})");
  const std::string refused = hasty.hear_of("serviceCallFailure");
  EXPECT_TRUE(says(refused, "wait for their answer already") && says(refused, R"("callId":101)")) << refused;
  other.call(1, R"({"request": "pause", "arguments": {}})");
  let_go();
  EXPECT_TRUE(says(other.hear_of("Done: "), "Done: pause"));
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(says(hasty.hear_of("Done: "), "Done: play")) << i;
  hasty.call(102, R"({"request": "step", "arguments": {}})");
  EXPECT_TRUE(says(hasty.hear_of("Done: "), "Done: step"));
}

TEST(ViewAddresses, AddressesOfThisMachineAreRecognisedInEveryForm) {
  using takt::view::host_name;
  using takt::view::is_loopback;
  for (const char* host : {"localhost", "LocalHost:80", "127.0.0.1:8765", "127.1.2.3", "[::1]:8765", "[::1]",
                           "[0:0:0:0:0:0:0:1]", "[::ffff:127.0.0.1]:80"})
    EXPECT_TRUE(is_loopback(host_name(host))) << host;
  for (const char* host :
       {"", "evil.example", "evil.example:80", "127.0.0.1.evil.example", "localhost.evil.example", "0.0.0.0",
        "[::]", "192.168.1.1", "[::1", "[]", "[evil.example]", "::1", "[fe80::1]:80"})
    EXPECT_FALSE(is_loopback(host_name(host))) << host;
  EXPECT_TRUE(is_loopback("::1"));  // to listen on
  EXPECT_EQ(takt::view::host_in_url("::1"), "[::1]");
  EXPECT_EQ(takt::view::host_in_url("::"), "localhost");
  EXPECT_EQ(takt::view::host_in_url("0.0.0.0"), "localhost");
  EXPECT_EQ(takt::view::host_in_url("192.168.1.1"), "192.168.1.1");
}

}  // namespace
