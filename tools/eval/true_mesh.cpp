#include "tools/eval/true_mesh.hpp"

#include "precompute/registration/surface_tree.hpp"

#include <cmath>
#include <unordered_map>

namespace lbea::tool {
namespace {

double distance(const float* a, const float* b) {
  return std::hypot(double{a[0]} - double{b[0]}, double{a[1]} - double{b[1]}, double{a[2]} - double{b[2]});
}

double mean_edge(std::span<const float> positions, std::span<const std::uint32_t> elements) {
  double sum = 0;
  for (std::size_t e = 0; e + 3 < elements.size(); e += 4)
    sum += distance(&positions[3 * std::size_t{elements[e]}], &positions[3 * std::size_t{elements[e + 1]}]);
  return sum / std::max(1.0, static_cast<double>(elements.size() / 4));
}

std::unordered_map<std::uint32_t, std::uint32_t> index_of(std::span<const std::uint32_t> ids) {
  std::unordered_map<std::uint32_t, std::uint32_t> index;
  for (std::uint32_t i = 0; i < ids.size(); ++i) index.emplace(ids[i], i);
  return index;
}

}  // namespace

TrueMesh::TrueMesh(const bake::SimulationMesh& mesh, const Model& model) {
  if (!find_by_number(mesh, model)) find_by_place(mesh, model);
}

bool TrueMesh::find_by_number(const bake::SimulationMesh& mesh, const Model& model) {
  const auto nodes = index_of(mesh.node_ids), elements = index_of(mesh.element_ids);
  const auto undeformed = model.node_positions(0);
  double off = 0;
  std::vector<Carrier> carriers;
  for (std::size_t i = 0; i < model.node_ids().size(); ++i) {
    const auto found = nodes.find(model.node_ids()[i]);
    if (found == nodes.end()) return false;
    carriers.push_back({{found->second, found->second, found->second}});
    off += distance(&undeformed[3 * i], &mesh.positions[3 * std::size_t{found->second}]);
  }
  if (off / static_cast<double>(carriers.size()) > mean_edge(undeformed, model.element_nodes())) return false;
  std::vector<std::uint32_t> same;
  for (const std::uint32_t id : model.element_ids()) {
    const auto found = elements.find(id);
    if (found == elements.end()) return false;
    same.push_back(found->second);
  }
  carriers_ = std::move(carriers);
  elements_ = std::move(same);
  return true;
}

void TrueMesh::find_by_place(const bake::SimulationMesh& mesh, const Model& model) {
  const bake::SurfaceTree tree(mesh.positions, mesh.elements);
  if (tree.triangles() == 0)
    throw Error(Status::bad_input, "the experiment's run has no surface to carry the model's nodes");
  const auto undeformed = model.node_positions(0);
  for (std::size_t i = 0; i < model.nodes(); ++i) {
    const float* p = &undeformed[3 * i];
    const bake::SurfacePlace place = tree.nearest({double{p[0]}, double{p[1]}, double{p[2]}});
    carriers_.push_back({place.nodes,
                         {static_cast<float>(place.shares[0]), static_cast<float>(place.shares[1]),
                          static_cast<float>(place.shares[2])}});
  }
}

void TrueMesh::positions(std::span<const float> run, std::vector<float>& into) const {
  into.assign(3 * carriers_.size(), 0.0f);
  for (std::size_t i = 0; i < carriers_.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      if (carriers_[i].shares[k] == 0) continue;
      const float* p = &run[3 * std::size_t{carriers_[i].nodes[k]}];
      for (std::size_t axis = 0; axis < 3; ++axis) into[3 * i + axis] += carriers_[i].shares[k] * p[axis];
    }
}

}  // namespace lbea::tool
