#include "idl/transport/fastdds/local_authority.h"

#include <fcntl.h>
#include <openssl/ec.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <iterator>

#include "idl/transport/fastdds/openssl_owners.h"
#include "idl/transport/fastdds/security.h"
#include "security_documents.h"

namespace takt {
namespace {

namespace fs = std::filesystem;

using namespace openssl;

[[noreturn]] void fail(const std::string& sentence) {
  throw SecurityError(sentence);
}
void require(bool done, const char* what) {
  if (!done) fail(std::string("OpenSSL could not make ") + what + " of a secured cell.");
}

struct Identity {
  Key key;
  Certificate certificate;
};

void add_extension(X509* certificate, int kind, const char* value) {
  const Extension extension(X509V3_EXT_conf_nid(nullptr, nullptr, kind, value));
  require(extension && X509_add_ext(certificate, extension.get(), -1) == 1, "an extension");
}

/// `authority` null: signed by itself.
Identity make_identity(const std::string& name, const Identity* authority) {
  constexpr long days = 20 * 365, seconds_a_day = 86'400;
  Identity made{Key(EVP_EC_gen("P-256")), Certificate(X509_new())};
  require(made.key && made.certificate, "a key");
  X509* certificate = made.certificate.get();
  std::uint64_t serial = 0;
  require(RAND_bytes(reinterpret_cast<unsigned char*>(&serial), sizeof(serial)) == 1, "a number");
  X509_set_version(certificate, 2);
  ASN1_INTEGER_set_uint64(X509_get_serialNumber(certificate), serial >> 1U);
  X509_gmtime_adj(X509_getm_notBefore(certificate), -seconds_a_day);  // clocks of peers may be late
  X509_gmtime_adj(X509_getm_notAfter(certificate), days * seconds_a_day);
  X509_set_pubkey(certificate, made.key.get());
  X509_NAME* subject = X509_get_subject_name(certificate);
  const auto add = [&](const char* field, const std::string& text) {
    X509_NAME_add_entry_by_txt(subject, field, MBSTRING_ASC,
                               reinterpret_cast<const unsigned char*>(text.c_str()), -1, -1, 0);
  };
  // In the order of make_identities.sh, whose policy puts the name first.
  add("CN", name);
  add("O", "takt");
  X509_set_issuer_name(certificate,
                       authority == nullptr ? subject : X509_get_subject_name(authority->certificate.get()));
  if (authority == nullptr) {
    add_extension(certificate, NID_basic_constraints, "critical,CA:TRUE");
    add_extension(certificate, NID_key_usage, "critical,keyCertSign,cRLSign,digitalSignature");
  }
  require(
      X509_sign(certificate, authority == nullptr ? made.key.get() : authority->key.get(), EVP_sha256()) > 0,
      "a certificate");
  return made;
}

Bio create(const fs::path& file) {
  const int handle = open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (handle < 0) fail("'" + file.string() + "' cannot be written.");
  return Bio(BIO_new_fd(handle, BIO_CLOSE));
}

void write_signed(const fs::path& file, const std::string& text, const Identity& authority) {
  const Bio content(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
  constexpr int flags = PKCS7_TEXT | PKCS7_DETACHED | PKCS7_STREAM;
  const Signed message(
      PKCS7_sign(authority.certificate.get(), authority.key.get(), nullptr, content.get(), flags));
  const Bio out = create(file);
  require(message && SMIME_write_PKCS7(out.get(), message.get(), content.get(), flags) == 1, "a signature");
}

void make_roles(const fs::path& directory) {
  const Identity authority = make_identity("takt authority of one user", nullptr);
  for (const auto& [role, permissions] : security_documents::kPermissions) {
    const fs::path to = directory / role;
    if (mkdir(to.c_str(), 0700) != 0) fail("'" + to.string() + "' cannot be made.");
    const Identity one = make_identity("takt " + std::string(role), &authority);
    require(PEM_write_bio_PrivateKey(create(to / "identity_key.pem").get(), one.key.get(), nullptr, nullptr,
                                     0, nullptr, nullptr) == 1,
            "a key");
    const auto write = [&](const char* file, const Identity& of) {
      require(PEM_write_bio_X509(create(to / file).get(), of.certificate.get()) == 1, "a certificate");
    };
    write("identity.pem", one);
    write("identity_ca.pem", authority);
    write("permissions_ca.pem", authority);
    write_signed(to / "permissions.p7s", std::string(permissions), authority);
    write_signed(to / "governance.p7s", std::string(security_documents::kGovernance), authority);
  }
}

/// Held as long as the object lives.
class FileLock {
 public:
  explicit FileLock(const fs::path& file) : handle_(open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600)) {
    if (handle_ < 0 || flock(handle_, LOCK_EX) != 0) fail("'" + file.string() + "' cannot be locked.");
  }
  ~FileLock() { close(handle_); }
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

 private:
  int handle_;
};

void require_private(const fs::path& directory) {
  struct stat found {};
  if (lstat(directory.c_str(), &found) != 0 || !S_ISDIR(found.st_mode))
    fail("'" + directory.string() + "' is no directory.");
  if (found.st_uid != geteuid() || (found.st_mode & 077U) != 0)
    fail("'" + directory.string() +
         "' holds the keys of secured cells and must belong to this user alone (chmod 700).");
}

fs::path state_directory() {
  const auto variable = [](const char* name) -> const char* {
    const char* value = std::getenv(name);
    return value != nullptr && *value != '\0' ? value : nullptr;
  };
  if (const char* own = variable("TAKT_STATE_DIR")) return own;
  if (const char* base = variable("XDG_STATE_HOME")) return fs::path(base) / "takt";
  if (const char* home = variable("HOME")) return fs::path(home) / ".local" / "state" / "takt";
  fail("--secure auto needs a directory for its identities; set HOME, XDG_STATE_HOME or TAKT_STATE_DIR.");
}

bool is_automatic(const std::string& given) {
  const std::string word = kAutomaticSecurity;
  return given == word || given.starts_with(word + ":");
}

}  // namespace

std::string security_directory(const std::string& given, const std::string& role, const fs::path& state) {
  if (!is_automatic(given)) return given;
  const std::size_t colon = given.find(':');
  const std::string wanted = colon == std::string::npos ? role : given.substr(colon + 1);
  std::string names;
  bool known = false;
  for (const auto& [name, permissions] : security_documents::kPermissions) {
    names += (names.empty() ? "" : ", ") + std::string(name);
    known = known || name == wanted;
  }
  if (!known) fail("The role '" + wanted + "' of --secure auto does not exist; there are " + names + ".");
  const fs::path all = state / "security";
  std::error_code error;
  fs::create_directories(state, error);
  if (error) fail("The directory '" + state.string() + "' cannot be made: " + error.message() + ".");
  const FileLock lock(state / "security.lock");
  if (!fs::exists(all, error)) {
    const fs::path unfinished = state / "security.new";
    try {
      fs::remove_all(unfinished);
      if (mkdir(unfinished.c_str(), 0700) != 0) fail("'" + unfinished.string() + "' cannot be made.");
      make_roles(unfinished);
      fs::rename(unfinished, all);
    } catch (const fs::filesystem_error& failure) {
      fail("The identities of --secure auto cannot be written: " + std::string(failure.what()) + ".");
    }
  }
  require_private(all);
  return all / wanted;
}

std::string security_directory(const std::string& given, const std::string& role) {
  return is_automatic(given) ? security_directory(given, role, state_directory()) : given;
}

}  // namespace takt
