#pragma once
// FMUs and SSPs: ZIP archives, unpacked into a fresh directory.
#include <filesystem>
#include <set>
#include <string>
#include <string_view>

namespace takt {

/// A directory that ends with the object.
class FreshDirectory {
 public:
  /// Below the directory of temporary files. Throws FmuError.
  FreshDirectory();
  ~FreshDirectory();
  FreshDirectory(const FreshDirectory&) = delete;
  FreshDirectory& operator=(const FreshDirectory&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// Limits of an archive.
inline constexpr std::size_t kMostFmuFiles = 100'000;
inline constexpr std::size_t kLargestFmu_bytes = std::size_t{1} << 30U;  ///< unpacked, all files together
inline constexpr std::size_t kLargestDescription_bytes = std::size_t{64} << 20U;

/// Unpacks modelDescription.xml, binaries/PLATFORM for this platform, and resources/; names are checked for all entries.
/// Throws FmuError: no archive, encrypted, a name that leads out of it, a link, beyond the limits. A name that
/// stands twice is refused. Returns the platforms that the archive has binaries for.
std::set<std::string> unpack_fmu(const std::filesystem::path& file, const std::filesystem::path& directory);
/// The same for a system of FMUs: SystemStructure.ssd, and all FMUs and parameter sets (.fmu, .ssv).
void unpack_ssp(const std::filesystem::path& file, const std::filesystem::path& directory);

/// Folders of binaries for this platform, by FMI 2.0 and by 3.0.
inline constexpr std::string_view kPlatform2 = "linux64", kPlatform3 = "x86_64-linux";

/// The first 100 bytes of a name in an archive, without control characters.
std::string printable(const std::string& name);

/// SHA-256 as 64 hexadecimal digits. Throws FmuError.
std::string sha256_of(const std::filesystem::path& file);

}  // namespace takt
