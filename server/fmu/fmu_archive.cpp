#include "server/fmu/fmu_archive.h"

#include <minizip/unzip.h>
#include <openssl/evp.h>
#include <stdlib.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <memory>
#include <set>
#include <vector>

#include "server/fmu/model_description.h"

namespace takt {

std::string printable(const std::string& name) {
  std::string shown = name.substr(0, 100);
  for (char& c : shown)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  return shown;
}

namespace {

constexpr std::size_t kLongestName = 1000;

std::string shown(const std::string& name) {
  return "'" + printable(name) + "'";
}

/// The parts of the name of an entry stay below the directory that it is unpacked to.
void check_name(const std::string& name) {
  const auto refuse = [&](const char* why) { throw FmuError("its entry " + shown(name) + " " + why); };
  if (name.empty() || name.size() > kLongestName) refuse("has no usable name");
  if (name.front() == '/' || name.find(':') != std::string::npos) refuse("has an absolute name or a colon");
  if (name.find('\0') != std::string::npos) refuse("has a name with a zero byte");
  for (const std::filesystem::path& part : std::filesystem::path(name))
    if (part == "..") refuse("leads out of the archive ('..')");
}

bool is_of_ssp(const std::string& name) {
  return name == "SystemStructure.ssd" || name.ends_with(".fmu") || name.ends_with(".ssv") ||
         name.ends_with(".ssm");
}

bool is_of_fmu(const std::string& name) {
  static const std::string binaries2 = "binaries/" + std::string(kPlatform2) + "/",
                           binaries3 = "binaries/" + std::string(kPlatform3) + "/";
  return name == "modelDescription.xml" || name.starts_with("resources/") || name.starts_with(binaries2) ||
         name.starts_with(binaries3);
}

/// What an archive is to hold.
struct Contents {
  std::string_view kind, description;
  bool (*is_wanted)(const std::string& name);
};
constexpr Contents kFmu{"FMUs", "modelDescription.xml", is_of_fmu},
    kSsp{"SSPs", "SystemStructure.ssd", is_of_ssp};

void unpack_entry(unzFile archive, const std::filesystem::path& to, std::size_t most, std::size_t& bytes) {
  std::filesystem::create_directories(to.parent_path());
  std::ofstream out(to, std::ios::binary);
  std::vector<char> buffer(std::size_t{1} << 16U);
  std::size_t size = 0;
  while (true) {
    const int got = unzReadCurrentFile(archive, buffer.data(), static_cast<unsigned>(buffer.size()));
    if (got < 0) throw FmuError("its entry " + shown(to.filename().string()) + " is damaged");
    if (got == 0) break;
    size += static_cast<std::size_t>(got), bytes += static_cast<std::size_t>(got);
    if (bytes > kLargestFmu_bytes)
      throw FmuError("it has more than " + std::to_string(kLargestFmu_bytes >> 20U) +
                     " MiB when unpacked; takt takes no more");
    if (size > most)
      throw FmuError("its " + to.filename().string() + " has more than " + std::to_string(most >> 20U) +
                     " MiB; takt takes no more");
    out.write(buffer.data(), got);
  }
  if (!out.flush()) throw FmuError("it cannot be unpacked to " + to.string() + ": the disk may be full");
}

/// Returns the names of all entries.
std::set<std::string> unpack(const std::filesystem::path& file, const std::filesystem::path& directory,
                             const Contents& contents) {
  const std::unique_ptr<void, int (*)(unzFile)> archive(unzOpen64(file.c_str()), &unzClose);
  if (!archive) throw FmuError("it is no ZIP archive, as " + std::string(contents.kind) + " are");
  std::size_t files = 0, bytes = 0;
  std::set<std::string> seen, all;
  std::string deeper;
  for (int more = unzGoToFirstFile(archive.get()); more != UNZ_END_OF_LIST_OF_FILE;
       more = unzGoToNextFile(archive.get())) {
    if (more != UNZ_OK) throw FmuError("its list of files is damaged");
    if (++files > kMostFmuFiles)
      throw FmuError("it has more than " + std::to_string(kMostFmuFiles) + " files; takt takes no more");
    unz_file_info64 info{};
    std::array<char, kLongestName + 2> text{};
    if (unzGetCurrentFileInfo64(archive.get(), &info, text.data(), text.size() - 1, nullptr, 0, nullptr, 0) !=
        UNZ_OK)
      throw FmuError("its list of files is damaged");
    std::string stated(text.data(), std::min<std::size_t>(info.size_filename, text.size() - 1));
    std::replace(stated.begin(), stated.end(), '\\', '/');  // some archives are made so on Windows
    check_name(stated);
    const std::string name = std::filesystem::path(stated).lexically_normal().string();
    if (S_ISLNK(info.external_fa >> 16U))
      throw FmuError("its entry " + shown(name) + " is a link; " + std::string(contents.kind) + " have none");
    if ((info.flag & 1U) != 0)
      throw FmuError("its entry " + shown(name) + " is encrypted; " + std::string(contents.kind) +
                     " are not");
    if (name.ends_with("/" + std::string(contents.description))) deeper = name;
    all.insert(name);
    if (name.ends_with('/') || !contents.is_wanted(name)) continue;
    if (!seen.insert(name).second) throw FmuError("its entry " + shown(name) + " stands twice");
    if (unzOpenCurrentFile(archive.get()) != UNZ_OK)
      throw FmuError("its entry " + shown(name) +
                     " cannot be unpacked; allowed are the methods deflate and store");
    unpack_entry(archive.get(), directory / name,
                 name == contents.description ? kLargestDescription_bytes : kLargestFmu_bytes, bytes);
    if (unzCloseCurrentFile(archive.get()) != UNZ_OK)
      throw FmuError("its entry " + shown(name) + " is damaged: its checksum is wrong");
  }
  if (const std::string description(contents.description); !seen.contains(description))
    throw FmuError(
        "it has no " + description +
        (deeper.empty() ? "" : " at its top, only " + shown(deeper) + ": archive what is in the folder"));
  return all;
}

}  // namespace

FreshDirectory::FreshDirectory() {
  std::string name = (std::filesystem::temp_directory_path() / "takt_fmu_").string() + std::string(6, 'X');
  if (::mkdtemp(name.data()) == nullptr) throw FmuError("no directory " + name + " can be made to unpack it");
  path_ = name;
}

FreshDirectory::~FreshDirectory() {
  std::error_code left_behind;
  std::filesystem::remove_all(path_, left_behind);
}

std::set<std::string> unpack_fmu(const std::filesystem::path& file, const std::filesystem::path& directory) {
  std::set<std::string> platforms;
  constexpr std::string_view kFolder = "binaries/";
  for (const std::string& name : unpack(file, directory, kFmu))
    if (const std::size_t end = name.find('/', kFolder.size());
        name.starts_with(kFolder) && end != std::string::npos && !name.ends_with('/'))
      platforms.insert(printable(name.substr(kFolder.size(), end - kFolder.size())));
  return platforms;
}

void unpack_ssp(const std::filesystem::path& file, const std::filesystem::path& directory) {
  unpack(file, directory, kSsp);
}

std::string sha256_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  const std::unique_ptr<EVP_MD_CTX, void (*)(EVP_MD_CTX*)> context(EVP_MD_CTX_new(), &EVP_MD_CTX_free);
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  bool good = in.good() && context && EVP_DigestInit_ex(context.get(), EVP_sha256(), nullptr) == 1;
  std::vector<char> buffer(std::size_t{1} << 16U);
  while (good && in) {
    in.read(buffer.data(), static_cast<std::streamsize>(buffer.size()));
    good = EVP_DigestUpdate(context.get(), buffer.data(), static_cast<std::size_t>(in.gcount())) == 1;
  }
  good = good && in.eof() && EVP_DigestFinal_ex(context.get(), digest.data(), &size) == 1;
  if (!good) throw FmuError("it cannot be read");
  std::string text;
  constexpr std::string_view kDigits = "0123456789abcdef";
  for (unsigned i = 0; i < size; ++i) text += {kDigits[digest[i] >> 4U], kDigits[digest[i] & 15U]};
  return text;
}

}  // namespace takt
