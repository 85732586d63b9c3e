// Report on an identity that DDS refuses: the file and its fault.
#include "idl/transport/fastdds/identity_fault.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/support/identities.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

using test::ChildProcess;
using test::make_identities;
namespace fs = std::filesystem;

std::string text_of_file(const fs::path& file) {
  std::stringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

/// An observer, and files of another authority.
class IdentityFault : public testing::Test {
 protected:
  static constexpr std::uint32_t kDomain = 5;
  const test::TemporaryDirectory directory_;
  const fs::path all_ = make_identities(directory_.path() / "own", {"--role", "observer"});
  const fs::path own_ = all_ / "observer";

  fs::path others() {
    return make_identities(directory_.path() / "others", {"--role", "observer"}) / "observer";
  }
  void take(const fs::path& from, const std::string& name) {
    fs::copy_file(from / name, own_ / name, fs::copy_options::overwrite_existing);
  }
  void write(const std::string& name, const std::string& text) { std::ofstream(own_ / name) << text; }
  /// The document, with `found` replaced, signed by the authority as the script does it.
  void sign(const std::string& source, const std::string& found, const std::string& replacement,
            const std::string& name) {
    std::string text = text_of_file(fs::path(TAKT_CONFIG_DIR) / "dds/security" / source);
    const std::size_t at = text.find(found);
    ASSERT_NE(at, std::string::npos);
    std::ofstream(directory_.path() / "document.xml") << text.replace(at, found.size(), replacement);
    ChildProcess openssl({"/usr/bin/openssl", "smime", "-sign", "-text", "-in",
                          directory_.path() / "document.xml", "-out", own_ / name, "-signer",
                          all_ / "ca/ca.pem", "-inkey", all_ / "ca/ca_key.pem"});
    ASSERT_EQ(openssl.wait(), 0) << openssl.text;
  }
  void permit(const std::string& found, const std::string& replacement) {
    sign("permissions_observer.xml", found, replacement, "permissions.p7s");
  }
  std::string fault() const { return identity_fault(own_, kDomain); }
};

TEST_F(IdentityFault, AValidIdentityHasNoFault) {
  EXPECT_EQ(fault(), "");
  EXPECT_NE(refused_identity(own_, kDomain).find("the messages of Fast DDS"), std::string::npos);
}

TEST_F(IdentityFault, AnExpiredCertificateIsNamed) {
  make_identities(all_, {"--role", "observer", "--until", "20210203040506Z"});
  EXPECT_EQ(fault(), "identity.pem expired on Feb  3 04:05:06 2021 GMT");
  make_identities(all_, {"--role", "observer", "--from", "20390203040506Z"});
  EXPECT_EQ(fault(), "identity.pem is not valid before Feb  3 04:05:06 2039 GMT");
  EXPECT_NE(refused_identity(own_, kDomain).find("identity.pem is not valid before"), std::string::npos);
}

TEST_F(IdentityFault, FilesOfAnotherAuthorityAreNamed) {
  take(others(), "identity.pem");
  EXPECT_EQ(
      fault(),
      "identity.pem (O=takt,CN=takt observer) was not signed by the authority in identity_ca.pem (CN=takt "
      "authority,O=takt)");
}

TEST_F(IdentityFault, AKeyOfAnotherCertificateIsNamed) {
  take(others(), "identity_key.pem");
  EXPECT_EQ(fault(), "identity_key.pem is not the key of identity.pem");
  write("identity_key.pem", "nothing");
  EXPECT_EQ(fault(), "identity_key.pem holds no private key (PEM, without password)");
}

TEST_F(IdentityFault, FilesOfAnotherKindAreNamed) {
  for (const std::string name : {"identity_ca.pem", "identity.pem", "permissions_ca.pem"}) {
    const std::string before = text_of_file(own_ / name);
    write(name, "nothing");
    EXPECT_EQ(fault(), name + " holds no certificate (PEM)");
    write(name, before);
  }
  for (const std::string name : {"governance.p7s", "permissions.p7s"}) {
    const std::string before = text_of_file(own_ / name);
    write(name, "nothing");
    EXPECT_EQ(fault(), name + " is no signed document (S/MIME)");
    write(name, before);
  }
}

TEST_F(IdentityFault, DocumentsChangedOrSignedByOthersAreNamed) {
  const fs::path others_directory = others();
  for (const std::string name : {"governance.p7s", "permissions.p7s"}) {
    const std::string before = text_of_file(own_ / name);
    std::string changed = before;
    changed.replace(changed.find("<domains>"), 9, "<domains >");
    for (const std::string& text : {changed, text_of_file(others_directory / name)}) {
      write(name, text);
      EXPECT_EQ(fault(), name +
                             " was changed after it was signed, or not signed by the authority in "
                             "permissions_ca.pem");
    }
    write(name, before);
  }
  EXPECT_EQ(fault(), "");
}

TEST_F(IdentityFault, InvalidPermissionsAreNamed) {
  permit("<not_after>2040-01-01", "<not_after>2022-01-01");
  EXPECT_EQ(fault(), "permissions.p7s expired on 2022-01-01T00:00:00");
  permit("<not_before>2020-01-01", "<not_before>2039-01-01");
  EXPECT_EQ(fault(), "permissions.p7s is not valid before 2039-01-01T00:00:00");
  permit("CN=takt observer", "CN=somebody else");
  EXPECT_EQ(fault(), "permissions.p7s says nothing of identity.pem (CN=takt observer)");
  permit("<min>0</min>", "<min>6</min>");
  EXPECT_EQ(fault(), "permissions.p7s does not speak of domain 5");
  permit("<id_range><min>0</min><max>232</max></id_range>", "<id>4</id>");
  EXPECT_EQ(fault(), "permissions.p7s does not speak of domain 5");
  permit("<id_range><min>0</min><max>232</max></id_range>", "<id>4</id><id>5</id>");
  EXPECT_EQ(fault(), "");
  permit("<max>232</max>", "");
  EXPECT_EQ(fault(), "");
  sign("governance.xml", "<max>", "<max>1</max><max>", "governance.p7s");
  EXPECT_EQ(fault(), "governance.p7s does not speak of domain 5");
}

}  // namespace
}  // namespace takt
