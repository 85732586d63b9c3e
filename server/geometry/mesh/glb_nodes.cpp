#include "server/geometry/mesh/glb_nodes.h"

#include <Eigen/SVD>
#include <algorithm>

#include "server/geometry/mesh/builder.h"

namespace takt {
namespace {

constexpr std::size_t kMostNamed = 20;
constexpr double kSinglePrecision = 1e-6;

std::string listed(const std::vector<std::string>& paths) {
  std::string list;
  for (std::size_t i = 0; i < std::min(paths.size(), kMostNamed); ++i)
    list += (i == 0 ? "'" : ", '") + paths[i] + "'";
  if (paths.size() > kMostNamed) list += " and " + std::to_string(paths.size() - kMostNamed) + " more";
  return list;
}

std::pair<std::size_t, std::size_t> range_with_faces(const GlbNodes& nodes, std::size_t node,
                                                     const std::string& name) {
  const std::size_t end = end_of_glb_node(nodes, node);
  if (!has_faces(nodes, node, end))
    throw MeshFault("the node '" + name + "' has no faces, and so have the nodes below it");
  return {node, end};
}

}  // namespace

std::string glb_node_path(const GlbNodes& nodes, std::size_t node) {
  std::string path = nodes[node].name;
  for (int above = nodes[node].parent; above >= 0; above = nodes[static_cast<std::size_t>(above)].parent)
    path.insert(0, nodes[static_cast<std::size_t>(above)].name + "/");
  return path;
}

std::size_t end_of_glb_node(const GlbNodes& nodes, std::size_t node) {
  std::size_t end = node + 1;
  while (end < nodes.size() && nodes[end].parent >= static_cast<int>(node)) ++end;
  return end;
}

bool has_faces(const GlbNodes& nodes, std::size_t first, std::size_t last) {
  return std::any_of(nodes.begin() + static_cast<std::ptrdiff_t>(first),
                     nodes.begin() + static_cast<std::ptrdiff_t>(last),
                     [](const GlbNode& node) { return node.has_faces; });
}

std::pair<std::size_t, std::size_t> find_glb_node(const GlbNodes& nodes, const std::string& name) {
  std::vector<std::string> paths, fitting;
  std::size_t found = nodes.size();
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const std::string path = glb_node_path(nodes, i);
    if (nodes[i].has_faces) paths.push_back(path);
    if (path == name) return range_with_faces(nodes, i, name);
    if (!path.ends_with("/" + name)) continue;
    if (!fitting.empty() && i < end_of_glb_node(nodes, found)) continue;  // below the one found
    found = i;
    fitting.push_back(path);
  }
  const std::string of = "the node '" + name + "'";
  if (fitting.empty())
    throw MeshFault(of + " is not there; nodes with faces are " +
                    (paths.empty() ? std::string("none") : listed(paths)));
  if (fitting.size() > 1)
    throw MeshFault(of + " is not unique: there are " + listed(fitting) + "; allowed is one of these paths");
  return range_with_faces(nodes, found, name);
}

Affine glb_node_in_file(const GlbNodes& nodes, std::size_t node) {
  Affine X = nodes[node].X_PN;
  for (int above = nodes[node].parent; above >= 0; above = nodes[static_cast<std::size_t>(above)].parent)
    X = nodes[static_cast<std::size_t>(above)].X_PN * X;
  return X;
}

std::pair<Pose, Affine> rigid_part(const Affine& X, const std::string& name) {
  const std::string of = "the transform of the node '" + name + "'";
  if (!X.A.allFinite() || !X.p.allFinite()) throw MeshFault(of + " is not finite");
  const Eigen::JacobiSVD<Mat3> svd(X.A, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Vec3 scale = svd.singularValues();
  if (!(scale.minCoeff() > 1e-9 * scale.maxCoeff()))
    throw MeshFault(of + " makes it flat: its scales are " + std::to_string(scale[0]) + ", " +
                    std::to_string(scale[1]) + " and " + std::to_string(scale[2]) +
                    "; allowed are three that are not 0");
  Mat3 R = svd.matrixU() * svd.matrixV().transpose();
  if (R.determinant() < 0.0) R.col(0) *= -1.0;
  Affine stretch{R.transpose() * X.A, Vec3::Zero()};
  if ((stretch.A - Mat3::Identity()).cwiseAbs().maxCoeff() < kSinglePrecision) stretch.A.setIdentity();
  return {Pose{R, X.p}, stretch};
}

}  // namespace takt
