#include "server/geometry/mesh/diagnostic.h"

#include <array>
#include <cmath>
#include <sstream>

namespace takt {

namespace {
// In the order of the enumerators.
constexpr std::array<std::string_view, 15> kKinds{"bad vertex",
                                                  "faces without area",
                                                  "duplicate faces",
                                                  "open edges",
                                                  "edges of more than two faces",
                                                  "surface with one side",
                                                  "mixed orientation",
                                                  "inside out",
                                                  "encloses nothing",
                                                  "cavities",
                                                  "solids inside others",
                                                  "needle triangles",
                                                  "sharp edges",
                                                  "coarse for contact",
                                                  "far from the origin"};
constexpr std::array<std::string_view, 4> kSeverities{"info", "warning", "repaired", "refused"};
}  // namespace

std::string_view to_string(MeshDiagnosticKind kind) {
  return kKinds.at(static_cast<std::size_t>(kind));
}

std::string_view to_string(MeshSeverity severity) {
  return kSeverities.at(static_cast<std::size_t>(severity));
}

std::string place_text(const Vec3& p) {
  std::ostringstream text;
  text.precision(6);
  // To the nanometre; + 0: no -0.
  const auto rounded = [](double x) { return std::round(x * 1e9) / 1e9 + 0.0; };
  text << "(" << rounded(p.x()) << ", " << rounded(p.y()) << ", " << rounded(p.z()) << ") m";
  return text.str();
}

std::string counted(std::size_t count, const char* one, const char* many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

}  // namespace takt
