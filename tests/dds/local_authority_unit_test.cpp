// Identities that are made at first use.
#include "idl/transport/fastdds/local_authority.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <future>
#include <iterator>

#include "idl/transport/fastdds/identity_fault.h"
#include "idl/transport/fastdds/security.h"
#include "takt_topics.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

namespace fs = std::filesystem;

unsigned mode_of(const fs::path& file) {
  struct stat found {};
  EXPECT_EQ(stat(file.c_str(), &found), 0) << file;
  return found.st_mode & 0777U;
}
std::string text_of(const fs::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}
std::string fault_of(const std::string& given, const std::string& role, const fs::path& state) {
  try {
    (void)security_directory(given, role, state);
  } catch (const SecurityError& error) {
    return error.what();
  }
  return {};
}

TEST(LocalAuthority, EachRoleGetsAnIdentityOfOneAuthority) {
  const test::TemporaryDirectory directory;
  const fs::path state = directory / "state";
  for (const char* role : {"server", "controller", "observer"}) {
    const fs::path made = security_directory("auto", role, state);
    EXPECT_EQ(made, state / "security" / role);
    EXPECT_EQ(identity_fault(made, 7), "") << role;
    EXPECT_EQ(mode_of(made), 0700U);
    for (const char* file : kSecurityFiles) EXPECT_EQ(mode_of(made / file), 0600U) << file;
    EXPECT_EQ(text_of(made / "identity_ca.pem"), text_of(state / "security/server/identity_ca.pem"));
  }
  EXPECT_EQ(mode_of(state / "security"), 0700U);
  EXPECT_NE(text_of(state / "security/server/identity_key.pem"),
            text_of(state / "security/controller/identity_key.pem"));
}

TEST(LocalAuthority, AControllerMayWriteEveryTopicOfClients) {
  const test::TemporaryDirectory directory;
  const std::string permissions =
      text_of(fs::path(security_directory("auto", "controller", directory / "state")) / "permissions.p7s");
  for (const TopicInfo* topic : topics::kAll) {
    if (topic->writer != TopicWriter::client) continue;
    // Behind the name of the cell, and of the robot, if each has its own.
    std::string last(topic->pattern.substr(topic->pattern.rfind('}') + 1));
    EXPECT_NE(permissions.find("<topic>rt/*" + last + "</topic>"), std::string::npos) << topic->pattern;
  }
}

TEST(LocalAuthority, ALaterUseFindsTheSame) {
  const test::TemporaryDirectory directory;
  const fs::path state = directory / "state";
  const auto use = [&] {
    return text_of(fs::path(security_directory("auto", "server", state)) / "identity.pem");
  };
  auto at_once = std::async(std::launch::async, use);
  const std::string first = use();
  EXPECT_FALSE(first.empty());
  EXPECT_EQ(at_once.get(), first);
  EXPECT_EQ(use(), first);
}

TEST(LocalAuthority, AnInterruptedMakingIsBegunAgain) {
  const test::TemporaryDirectory directory;
  const fs::path state = directory / "state";
  fs::create_directories(state / "security.new/server");
  std::ofstream(state / "security.new/server/identity.pem") << "half";
  EXPECT_EQ(identity_fault(security_directory("auto", "server", state), 0), "");
  EXPECT_FALSE(fs::exists(state / "security.new"));
}

TEST(LocalAuthority, KeysThatOthersCanReadAreRefused) {
  const test::TemporaryDirectory directory;
  const fs::path state = directory / "state";
  (void)security_directory("auto", "server", state);
  fs::permissions(state / "security", fs::perms::owner_all | fs::perms::group_read);
  EXPECT_NE(fault_of("auto", "server", state).find("this user alone"), std::string::npos);
  fs::remove_all(state / "security");
  fs::create_directory_symlink(directory / "elsewhere", state / "security");
  fs::create_directory(directory / "elsewhere");
  EXPECT_NE(fault_of("auto", "server", state), "");
}

TEST(LocalAuthority, AnotherRoleIsNamedBehindTheWord) {
  const test::TemporaryDirectory directory;
  const fs::path state = directory / "state";
  EXPECT_EQ(security_directory("auto:observer", "controller", state), state / "security/observer");
  EXPECT_EQ(fault_of("auto:king", "controller", state),
            "The role 'king' of --secure auto does not exist; there are server, controller, observer.");
  EXPECT_EQ(security_directory("some/directory", "controller", state), "some/directory");
  EXPECT_EQ(security_directory("", "controller", state), "");
}

}  // namespace
}  // namespace takt
