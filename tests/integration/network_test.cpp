// Discovery of servers and clients, and access control: by the programs, from the user's view.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "client_lib/client.h"
#include "idl/transport/fastdds/host_local_udp.h"
#include "idl/transport/fastdds/profiles.h"
#include "tests/support/built_programs.h"
#include "tests/support/child_process.h"
#include "tests/support/dds_service.h"
#include "tests/support/identities.h"
#include "tests/support/raw_dds_client.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

using takt::test::kBin;
using takt::test::kConfig;
using test::ChildProcess;
using test::make_identities;

struct Outcome {
  int code;
  std::string text;
};

/// takt-server in a process of its own, and takt to query it.
class Programs : public testing::Test {
 protected:
  void serve(const std::vector<std::string>& options) {
    std::vector<std::string> command{kBin + "/takt-server", scenario_,  "--cell",
                                     test::test_cell(),     "--domain", domain_};
    command.insert(command.end(), options.begin(), options.end());
    server_ = std::make_unique<ChildProcess>(command);
    ASSERT_TRUE(server_->wait_for_output("ready")) << server_->text;
  }
  Outcome takt(const std::vector<std::string>& options, const std::string& command,
               const std::string& timeout = "60") {
    std::vector<std::string> arguments{kBin + "/takt", "--cell", test::test_cell(), "--domain", domain_,
                                       "--timeout",    timeout};
    arguments.insert(arguments.end(), options.begin(), options.end());
    arguments.push_back(command);
    ChildProcess program(arguments);
    const int code = program.wait();
    return {code, program.text};
  }
  void TearDown() override {
    if (!server_) return;
    server_->signal(SIGTERM);
    EXPECT_EQ(server_->wait(), 0) << server_->text;
  }

  test::TemporaryDirectory directory_;
  const std::string domain_ = std::to_string(test::test_domain());
  const std::string scenario_ = test::write_service_scenario();
  std::unique_ptr<ChildProcess> server_;
};

class Discovery : public Programs {
 protected:
  /// The shipped profiles; the discovery server on a port of this test's own.
  std::string profiles() {
    std::ifstream in(kConfig / "dds/profiles.xml");
    std::stringstream text;
    text << in.rdbuf();
    std::string content = text.str();
    const std::string shipped = "<port>11811</port>";
    const std::string own = "<port>" + std::to_string(20000 + getpid() % 10000) + "</port>";
    for (std::size_t at = content.find(shipped); at != std::string::npos; at = content.find(shipped, at))
      content.replace(at, shipped.size(), own);
    const auto file = directory_.path() / "profiles.xml";
    std::ofstream(file) << content;
    return file;
  }
  void works(const std::string& kind, bool default_client_sees_it) {
    const std::string file = profiles();
    serve({"--profiles", file, "--profile", "takt_server" + kind});
    const std::vector<std::string> client{"--profiles", file, "--profile", "takt_client" + kind};
    const Outcome pause = takt(client, "pause");
    EXPECT_EQ(pause.code, 0) << pause.text;
    const Outcome status = takt(client, "status");
    EXPECT_EQ(status.code, 0);
    EXPECT_NE(status.text.find("paused"), std::string::npos) << status.text;
    // Clients that search for unknown topics or cells.
    const Outcome list = takt(client, "list");
    EXPECT_EQ(list.code, 0) << list.text;
    EXPECT_NE(list.text.find(test::test_cell()), std::string::npos) << list.text;
    // Shows that it was this way of discovery and no other.
    EXPECT_EQ(takt({}, "status", default_client_sees_it ? "60" : "2").code == 0, default_client_sees_it);
  }
};

/// Without a profile a server is found by clients that use loopback alone; stock participants: all tests with
/// RawDdsClient.
TEST_F(Discovery, ClientsOnLoopbackFindTheServerWithoutAProfile) {
  serve({});
  const Outcome status = takt({"--profiles", profiles(), "--profile", "takt_client"}, "status");
  EXPECT_EQ(status.code, 0) << status.text;
}

/// A process that leaves and returns under the same number has the same GUIDs, and its readers have other
/// topics than the earlier ones of the same GUIDs.
TEST_F(Discovery, AParticipantThatReturnsUnderItsGuidIsFound) {
  serve({});
  constexpr std::int32_t lease_s = 2, number = 77;
  const auto any = [](const auto& samples) { return !samples.empty(); };
  const std::string cell = "rt/" + test::test_cell();
  const auto status = [&](test::RawDdsClient& client) {
    return client.read<takt_msgs::msg::Status>(cell + "/status", true, true, 1);
  };
  const auto state = [&](test::RawDdsClient& client) {
    return client.read<takt_msgs::msg::CellState>(cell + "/state", false, false, 1);
  };
  {
    test::RawDdsClient client(test::test_domain(), lease_s, number);
    const auto first = status(client);
    const auto second = state(client);
    EXPECT_TRUE(first->wait_until(any));
    EXPECT_TRUE(second->wait_until(any));
  }
  test::RawDdsClient client(test::test_domain(), lease_s, number);
  const auto first = state(client);
  const auto second = status(client);
  EXPECT_TRUE(first->wait_until(any));
  EXPECT_TRUE(second->wait_until(any));
}

TEST(ThisMachine, OnlyAddressesOfThisMachineAreLocal) {
  LocalAddresses addresses;
  const auto local = local_ipv4_addresses();
  ASSERT_FALSE(local.empty());
  EXPECT_EQ(local.front(), kLoopback);
  for (const Ipv4& address : local) EXPECT_TRUE(addresses.has(address));
  EXPECT_TRUE(addresses.has({127, 3, 2, 1}));
  // Repeated queries, as by packets of a stranger: one look-up per second at most.
  for (int i = 0; i < 100000; ++i) EXPECT_FALSE(addresses.has({203, 0, 113, 7}));
  EXPECT_FALSE(addresses.has({0, 0, 0, 0}));
  EXPECT_FALSE(addresses.has({239, 255, 0, 1}));
}

TEST_F(Discovery, AProfileWithoutAFileIsRefused) {
  const Outcome status = takt({"--profile", "takt_client_network"}, "status");
  EXPECT_EQ(status.code, 2) << status.text;
  EXPECT_NE(status.text.find("--profiles"), std::string::npos) << status.text;
  ClientOptions options;
  options.profile = "takt_client_network";
  try {
    const Client client(options);
    FAIL();
  } catch (const ClientError& error) {
    EXPECT_EQ(error.kind(), ClientError::Kind::invalid) << error.what();
  }
}

TEST_F(Discovery, ClientsFindTheServerByMulticastOnLoopback) {
  works("", true);
}
TEST_F(Discovery, ClientsFindTheServerByInitialPeersWithoutMulticast) {
  works("_peer", false);
}
TEST_F(Discovery, ClientsFindTheServerByADiscoveryServer) {
  works("_discovery", false);
}

class Secured : public Programs {
 protected:
  void SetUp() override { serve({"--secure", identities_ / "server"}); }
  static std::vector<std::string> as(const std::filesystem::path& identity) { return {"--secure", identity}; }
  /// The positive control: a permitted client gets the samples that the others do not.
  void expect_controller_served() {
    const Outcome status = takt(as(identities_ / "controller"), "status");
    EXPECT_EQ(status.code, 0) << status.text;
    EXPECT_NE(status.text.find("service_test"), std::string::npos) << status.text;
    EXPECT_EQ(takt(as(identities_ / "controller"), "play").code, 0);
  }
  void expect_refused(const std::vector<std::string>& options) {
    const Outcome refused = takt(options, "status", "3");
    EXPECT_NE(refused.code, 0) << refused.text;
    EXPECT_EQ(refused.text.find("service_test"), std::string::npos) << "delivered: " << refused.text;
    EXPECT_NE(takt(options, "pause", "3").code, 0);
    expect_controller_served();
    const Outcome status = takt(as(identities_ / "controller"), "status");
    EXPECT_NE(status.text.find("playing"), std::string::npos) << status.text;
  }
  const std::filesystem::path identities_ = make_identities(
      directory_.path() / "identities",
      {"--role", "server", "--role", "controller", "--role", "observer", "--role", "stranger"});
};

TEST_F(Secured, AClientWithoutACertificateReceivesNothing) {
  expect_refused({});
}

TEST_F(Secured, AnIdentityOfAnotherAuthorityReceivesNothing) {
  expect_refused(as(make_identities(directory_.path() / "others") / "controller"));
}

TEST_F(Secured, AnExpiredIdentityReceivesNothing) {
  const auto expired =
      make_identities(directory_.path() / "identities", {"--role", "observer", "--until", "20210101000000Z"});
  expect_refused(as(expired / "observer"));
  const Outcome refused = takt(as(expired / "observer"), "status", "3");
  EXPECT_NE(refused.text.find("identity.pem expired on Jan  1 00:00:00 2021"), std::string::npos)
      << refused.text;
}

TEST_F(Secured, AClientWithoutPermissionReceivesNothing) {
  expect_refused(as(identities_ / "stranger"));
}

TEST_F(Secured, TamperedGovernanceReceivesNothing) {
  const auto file = identities_ / "observer" / "governance.p7s";
  std::stringstream text;
  text << std::ifstream(file).rdbuf();
  std::string content = text.str();
  const std::string protection = "<discovery_protection_kind>ENCRYPT<";
  ASSERT_NE(content.find(protection), std::string::npos);
  content.replace(content.find(protection), protection.size(), "<discovery_protection_kind>NONE<");
  std::ofstream(file) << content;
  expect_refused(as(identities_ / "observer"));
  // Nor does a server start with it.
  std::filesystem::copy_file(file, identities_ / "server" / "governance.p7s",
                             std::filesystem::copy_options::overwrite_existing);
  ChildProcess server({kBin + "/takt-server", scenario_, "--cell", "other", "--domain", domain_, "--secure",
                       identities_ / "server"});
  EXPECT_EQ(server.wait(), 2);
  EXPECT_NE(server.text.find("governance.p7s was changed after it was signed"), std::string::npos)
      << server.text;
}

TEST_F(Secured, AnObserverReadsAndDoesNotWrite) {
  const Outcome reads = takt(as(identities_ / "observer"), "status");
  EXPECT_EQ(reads.code, 0) << reads.text;
  EXPECT_NE(reads.text.find("playing"), std::string::npos);
  const Outcome writes = takt(as(identities_ / "observer"), "pause");
  EXPECT_NE(writes.code, 0);
  EXPECT_NE(writes.text.find("security profile"), std::string::npos) << writes.text;
  EXPECT_NE(takt(as(identities_ / "observer"), "status").text.find("playing"), std::string::npos);
  EXPECT_EQ(takt(as(identities_ / "controller"), "pause").code, 0);
  EXPECT_NE(takt(as(identities_ / "observer"), "status").text.find("paused"), std::string::npos);
}

TEST_F(Programs, OneWordSecuresTheCellOfAUser) {
  ASSERT_EQ(setenv("TAKT_STATE_DIR", (directory_ / "state").c_str(), 1), 0);
  serve({"--secure", "auto"});
  const Outcome status = takt({"--secure", "auto"}, "status");
  EXPECT_EQ(status.code, 0) << status.text;
  const Outcome pause = takt({"--secure", "auto"}, "pause");
  EXPECT_EQ(pause.code, 0) << pause.text;
  EXPECT_NE(takt({"--secure", "auto:observer"}, "pause", "5").code, 0);
  EXPECT_NE(takt({}, "status", "5").code, 0) << "without an identity";
  // Of another user.
  ASSERT_EQ(setenv("TAKT_STATE_DIR", (directory_ / "other").c_str(), 1), 0);
  EXPECT_NE(takt({"--secure", "auto"}, "status", "5").code, 0);
  unsetenv("TAKT_STATE_DIR");
}

TEST_F(Programs, ASecurityDirectoryThatLacksAFileIsNamed) {
  const auto identities = make_identities(directory_.path() / "identities", {"--role", "server"});
  std::filesystem::remove(identities / "server" / "permissions.p7s");
  ChildProcess server({kBin + "/takt-server", scenario_, "--secure", identities / "server"});
  EXPECT_EQ(server.wait(), 2);
  EXPECT_NE(server.text.find("no readable file 'permissions.p7s'"), std::string::npos) << server.text;
}

TEST(Profiles, DiscoveryServersAreWrittenForBothMajorsOfFastDds) {
  const std::string address = "<locator><udpv4><port>11811</port></udpv4></locator>";
  const std::string list = "<metatrafficUnicastLocatorList>" + address + "</metatrafficUnicastLocatorList>";
  const auto server = [](const std::string& inside) {
    return "<RemoteServer prefix=\"44.53\">" + inside + "</RemoteServer>";
  };
  EXPECT_EQ(with_servers_by_address("<a>" + server(list) + server(" " + list) + "</a>" + list),
            "<a>" + address + address + "</a>" + list);
  for (const std::string& as_it_is :
       {std::string(), list, server("") + list, server("<metatrafficUnicastLocatorList>"),
        std::string("<RemoteServer") + list})
    EXPECT_EQ(with_servers_by_address(as_it_is), as_it_is);
}

}  // namespace
}  // namespace takt
