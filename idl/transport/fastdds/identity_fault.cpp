#include "idl/transport/fastdds/identity_fault.h"

#include <openssl/pem.h>

#include <charconv>
#include <ctime>
#include <optional>
#include <string_view>

#include "idl/transport/fastdds/openssl_owners.h"

namespace takt {
namespace {

using namespace openssl;

Bio open(const std::filesystem::path& file) {
  return Bio(BIO_new_file(file.c_str(), "r"));
}

std::string content_of(BIO* memory) {
  char* begin = nullptr;
  const long size = BIO_get_mem_data(memory, &begin);
  return size > 0 ? std::string(begin, static_cast<std::size_t>(size)) : std::string();
}

Certificate read_certificate(const std::filesystem::path& file) {
  const Bio in = open(file);
  return Certificate(in ? PEM_read_bio_X509(in.get(), nullptr, nullptr, nullptr) : nullptr);
}

std::string text_of(const ASN1_TIME* time) {
  const Bio out(BIO_new(BIO_s_mem()));
  ASN1_TIME_print(out.get(), time);
  return content_of(out.get());
}

std::string subject_of(const X509* certificate) {
  const Bio out(BIO_new(BIO_s_mem()));
  X509_NAME_print_ex(out.get(), X509_get_subject_name(certificate), 0,
                     XN_FLAG_RFC2253 & ~ASN1_STRFLGS_ESC_MSB);
  return content_of(out.get());
}

std::string common_name_of(const X509* certificate) {
  char name[256] = "";
  X509_NAME_get_text_by_NID(X509_get_subject_name(certificate), NID_commonName, name, sizeof name);
  return name;
}

std::string fault_of_times(const std::string& name, const X509* certificate) {
  const ASN1_TIME *from = X509_get0_notBefore(certificate), *until = X509_get0_notAfter(certificate);
  if (X509_cmp_current_time(until) < 0) return name + " expired on " + text_of(until);
  if (X509_cmp_current_time(from) > 0) return name + " is not valid before " + text_of(from);
  return {};
}

/// The text between the first `<tag>` after `at` and its end tag; moves `at` behind it.
std::optional<std::string_view> element(std::string_view xml, std::string_view tag, std::size_t& at) {
  const std::string begin = "<" + std::string(tag) + ">", end = "</" + std::string(tag) + ">";
  const std::size_t from = xml.find(begin, at);
  if (from == std::string_view::npos) return std::nullopt;
  const std::size_t to = xml.find(end, from);
  if (to == std::string_view::npos) return std::nullopt;
  at = to + end.size();
  return xml.substr(from + begin.size(), to - from - begin.size());
}

std::string fault_of_validity(std::string_view permissions) {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char present[32];
  std::strftime(present, sizeof present, "%Y-%m-%dT%H:%M:%S", &utc);
  std::size_t at = 0;
  const auto from = element(permissions, "not_before", at);
  const auto until = element(permissions, "not_after", at = 0);
  if (until && *until < std::string_view(present)) return "permissions.p7s expired on " + std::string(*until);
  if (from && *from > std::string_view(present))
    return "permissions.p7s is not valid before " + std::string(*from);
  return {};
}

bool number_is(std::string_view text, std::uint32_t& value) {
  return std::from_chars(text.data(), text.data() + text.size(), value).ec == std::errc();
}

/// Whether any of the `domains` elements contains the domain. True if there are no readable ones.
bool names_domain(std::string_view xml, std::uint32_t domain) {
  bool any = false;
  for (std::size_t at = 0; const auto domains = element(xml, "domains", at);) {
    std::uint32_t least = 0, most = 0;
    for (std::size_t in = 0; const auto id = element(*domains, "id", in);) {
      if (!number_is(*id, least)) continue;
      any = true;
      if (least == domain) return true;
    }
    for (std::size_t in = 0; const auto range = element(*domains, "id_range", in);) {
      std::size_t inner = 0;
      const auto min = element(*range, "min", inner), max = element(*range, "max", inner);
      if ((min && !number_is(*min, least)) || (max && !number_is(*max, most))) continue;
      any = true;
      if ((!min || least <= domain) && (!max || domain <= most)) return true;
    }
  }
  return !any;
}

struct SignedText {
  std::string fault, text;
};

SignedText read_signed(const std::filesystem::path& file, X509* authority) {
  const std::string name = file.filename().string();
  const Bio in = open(file);
  BIO* detached = nullptr;
  const Signed message(in ? SMIME_read_PKCS7(in.get(), &detached) : nullptr);
  const Bio content(detached);
  if (!message) return {name + " is no signed document (S/MIME)", {}};
  const Store store(X509_STORE_new());
  X509_STORE_add_cert(store.get(), authority);
  const Bio out(BIO_new(BIO_s_mem()));
  if (PKCS7_verify(message.get(), nullptr, store.get(), content.get(), out.get(), PKCS7_TEXT) != 1)
    return {name + " was changed after it was signed, or not signed by the authority in permissions_ca.pem",
            {}};
  return {{}, content_of(out.get())};
}

std::string fault_of_identity(const std::filesystem::path& directory, std::string& common_name) {
  const Certificate authority = read_certificate(directory / "identity_ca.pem");
  if (!authority) return "identity_ca.pem holds no certificate (PEM)";
  const Certificate identity = read_certificate(directory / "identity.pem");
  if (!identity) return "identity.pem holds no certificate (PEM)";
  common_name = common_name_of(identity.get());
  if (auto fault = fault_of_times("identity_ca.pem", authority.get()); !fault.empty()) return fault;
  if (auto fault = fault_of_times("identity.pem", identity.get()); !fault.empty()) return fault;
  const Key of_authority(X509_get_pubkey(authority.get()));
  if (!of_authority || X509_verify(identity.get(), of_authority.get()) != 1)
    return "identity.pem (" + subject_of(identity.get()) +
           ") was not signed by the authority in identity_ca.pem (" + subject_of(authority.get()) + ")";
  const Bio in = open(directory / "identity_key.pem");
  // Without a password: a server starts unattended.
  char no_password[] = "";
  const Key key(in ? PEM_read_bio_PrivateKey(in.get(), nullptr, nullptr, no_password) : nullptr);
  if (!key) return "identity_key.pem holds no private key (PEM, without password)";
  if (X509_check_private_key(identity.get(), key.get()) != 1)
    return "identity_key.pem is not the key of identity.pem";
  return {};
}

std::string fault_of_documents(const std::filesystem::path& directory, std::uint32_t domain,
                               const std::string& common_name) {
  const Certificate authority = read_certificate(directory / "permissions_ca.pem");
  if (!authority) return "permissions_ca.pem holds no certificate (PEM)";
  if (auto fault = fault_of_times("permissions_ca.pem", authority.get()); !fault.empty()) return fault;
  const SignedText governance = read_signed(directory / "governance.p7s", authority.get());
  if (!governance.fault.empty()) return governance.fault;
  const SignedText permissions = read_signed(directory / "permissions.p7s", authority.get());
  if (!permissions.fault.empty()) return permissions.fault;
  if (auto fault = fault_of_validity(permissions.text); !fault.empty()) return fault;
  for (const auto* document : {&governance, &permissions})
    if (!names_domain(document->text, domain))
      return std::string(document == &governance ? "governance.p7s" : "permissions.p7s") +
             " does not speak of domain " + std::to_string(domain);
  // Fast DDS compares the whole name, in the order of the certificate or in reverse.
  if (permissions.text.find("CN=" + common_name) == std::string::npos)
    return "permissions.p7s says nothing of identity.pem (CN=" + common_name + ")";
  return {};
}

}  // namespace

std::string identity_fault(const std::filesystem::path& directory, std::uint32_t domain) {
  std::string common_name;
  std::string fault = fault_of_identity(directory, common_name);
  return fault.empty() ? fault_of_documents(directory, domain, common_name) : fault;
}

std::string refused_identity(const std::filesystem::path& directory, std::uint32_t domain) {
  const std::string refused = "DDS refused the identity in '" + directory.string() + "'";
  if (const std::string fault = identity_fault(directory, domain); !fault.empty())
    return refused + ": " + fault +
           ". config/dds/security/make_identities.sh makes identities; see docs/network.md.";
  return refused +
         ": certificate, permissions or governance are not valid; the messages of Fast DDS beside this one "
         "say more.";
}

}  // namespace takt
