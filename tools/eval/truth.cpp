#include "tools/eval/truth.hpp"

#include "tools/shared/ensemble/model_mesh.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <unordered_map>

namespace lbea::tool {
namespace {

double distance(const float* a, const float* b) {
  return std::hypot(double{a[0]} - double{b[0]}, double{a[1]} - double{b[1]}, double{a[2]} - double{b[2]});
}

/// Whether the first edges of the elements are as long in `other`, on average within a tenth. Rigid motion between the
/// two changes nothing. positions, other: nodes x 3.
bool has_same_edges(std::span<const float> positions, std::span<const float> other,
                    std::span<const std::uint32_t> elements) {
  double length = 0, change = 0;
  for (std::size_t e = 0; e + 3 < elements.size(); e += 4) {
    const std::size_t a = 3 * std::size_t{elements[e]}, b = 3 * std::size_t{elements[e + 1]};
    length += distance(&positions[a], &positions[b]);
    change += std::abs(distance(&other[a], &other[b]) - distance(&positions[a], &positions[b]));
  }
  return change <= 0.1 * length;
}

std::unordered_map<std::uint32_t, std::uint32_t> index_of(std::span<const std::uint32_t> ids) {
  std::unordered_map<std::uint32_t, std::uint32_t> index;
  for (std::uint32_t i = 0; i < ids.size(); ++i) index.emplace(ids[i], i);
  return index;
}

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> cells(1);
  for (const char c : line) {
    if (c == ',')
      cells.emplace_back();
    else if (c != '\r')
      cells.back() += c;
  }
  return cells;
}

/// A CSV table that is read row by row. Errors name the file and the line.
class TruthTable {
 public:
  explicit TruthTable(const std::filesystem::path& file) : file_(file), in_(file) {
    if (!in_) throw Error(Status::file_not_found, file.string() + ": cannot open the table of true states");
    if (!next()) fail("empty; lbea-sense writes this table with its frames");
    header_ = cells_;
  }
  bool next() {
    std::string line;
    if (!std::getline(in_, line)) return false;
    ++line_;
    cells_ = split(line);
    return true;
  }
  [[nodiscard]] const std::string& text(const char* column) const {
    const auto found = std::ranges::find(header_, column);
    if (found == header_.end()) fail(std::string("no column '") + column + "'");
    const auto index = static_cast<std::size_t>(found - header_.begin());
    if (index >= cells_.size()) fail(std::string("no value in column '") + column + "'");
    return cells_[index];
  }
  template <typename T>
  [[nodiscard]] T number(const char* column) const {
    const std::string& cell = text(column);
    T value{};
    const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
    if (error != std::errc{} || end != cell.data() + cell.size())
      fail(std::string("column '") + column + "': '" + cell + "' is not a number");
    return value;
  }
  [[noreturn]] void fail(const std::string& what) const {
    throw Error(Status::bad_input, file_.string() + ": line " + std::to_string(line_) + ": " + what);
  }

 private:
  std::filesystem::path file_;
  std::ifstream in_;
  std::size_t line_ = 0;
  std::vector<std::string> header_, cells_;
};

}  // namespace

TrueMesh::TrueMesh(const bake::SimulationMesh& mesh, const Model& model, const bake::MappingSettings& mapping) {
  if (!find_by_number(mesh, model)) find_by_place(mesh, model, mapping);
}

bool TrueMesh::find_by_number(const bake::SimulationMesh& mesh, const Model& model) {
  const auto nodes = index_of(mesh.node_ids), elements = index_of(mesh.element_ids);
  std::vector<bake::CarriedNode> carriers;
  std::vector<float> positions;
  for (std::size_t i = 0; i < model.node_ids().size(); ++i) {
    const auto found = nodes.find(model.node_ids()[i]);
    if (found == nodes.end()) return false;
    carriers.push_back({{found->second, found->second, found->second}, {1, 0, 0}});
    positions.insert(positions.end(), &mesh.positions[3 * std::size_t{found->second}],
                     &mesh.positions[3 * std::size_t{found->second}] + 3);
  }
  if (!has_same_edges(model.node_positions(0), positions, model.element_nodes())) return false;
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

void TrueMesh::find_by_place(const bake::SimulationMesh& mesh, const Model& model,
                             const bake::MappingSettings& mapping) {
  const bake::SurfaceTree tree(mesh.positions, mesh.elements);
  if (tree.triangles() == 0)
    throw Error(Status::bad_input, "the run of the experiment has no surface to project the nodes of the model onto");
  const bake::SimulationMesh own = mesh_of(model);
  for (std::size_t i = 0; bake::SurfacePlace place : bake::places_of_nodes(own, mesh, mapping)) {
    const float* p = &own.positions[3 * i++];
    if (!place.found()) place = tree.nearest({double{p[0]}, double{p[1]}, double{p[2]}});
    carriers_.push_back({place.nodes, place.shares, place.element});
  }
}

void TrueMesh::positions(std::span<const float> run, std::vector<float>& into) const {
  bake::carry(carriers_, run, into);
}

TrueFields true_fields(const TrueMesh& mesh, const bake::SimulationReader& run, const bake::SimulationState& state,
                       const Model& model) {
  TrueFields fields;
  if (!mesh.same_mesh()) return fields;
  const std::vector<std::uint8_t> exposed = exposed_elements(run.mesh(), state.alive);
  for (const std::uint32_t element : mesh.elements()) fields.present.push_back(exposed[element]);
  for (std::uint32_t f = 0; f < model.fields(); ++f) {
    std::vector<float>& values = fields.values.emplace_back(model.elements(), std::numeric_limits<float>::quiet_NaN());
    const auto found = std::ranges::find(run.fields(), model.field(f).name, &bake::SimulationField::name);
    if (found == run.fields().end()) continue;
    const std::vector<float>& of_run = state.fields[static_cast<std::size_t>(found - run.fields().begin())];
    std::ranges::transform(mesh.elements(), values.begin(), [&](std::uint32_t element) { return of_run[element]; });
  }
  return fields;
}

Truth::Truth(const std::filesystem::path& table_file, std::unique_ptr<bake::SimulationReader> run, const Model& model)
    : run_(std::move(run)), mesh_(run_->mesh(), model, {}) {
  for (TruthTable table(table_file); table.next();) {
    Row row{table.number<std::uint64_t>("frame"), table_file.parent_path() / table.text("file"),
            table.number<std::int64_t>("stamp_ns"), table.number<double>("state"), table.number<double>("time_s")};
    if (!(row.state >= 0 && row.state <= run_->states() - 1.0))
      table.fail("the run has no state " + table.text("state"));
    rows_.push_back(std::move(row));
  }
}

const Truth::Row* Truth::at(std::int64_t stamp_ns) const noexcept {
  const auto found = std::ranges::find(rows_, stamp_ns, &Row::stamp_ns);
  return found == rows_.end() ? nullptr : &*found;
}

const std::vector<float>& Truth::positions(const Row& row) {
  const double whole = std::floor(row.state);
  const auto share = static_cast<float>(row.state - whole);
  const auto state = static_cast<std::uint32_t>(whole);
  read_state(state, positions_);
  if (share > 0) {
    read_state(state + 1, next_);
    for (std::size_t i = 0; i < positions_.size(); ++i) positions_[i] += share * (next_[i] - positions_[i]);
  }
  return positions_;
}

void Truth::read_state(std::uint32_t state, std::vector<float>& into) {
  run_->read(state, state_);
  hide_free_nodes(run_->mesh(), state_.alive, state_.positions);
  mesh_.positions(state_.positions, into);
}

void hide_free_nodes(const bake::SimulationMesh& mesh, const std::vector<std::uint8_t>& alive,
                     std::vector<float>& positions) {
  const std::vector<std::uint8_t> is_free = free_nodes(mesh, alive);
  for (std::size_t node = 0; node < is_free.size(); ++node)
    if (is_free[node] != 0) std::fill_n(&positions[3 * node], 3, std::numeric_limits<float>::quiet_NaN());
}

double experiment_error(std::span<const float> truth, std::span<const float> sample) {
  double sum = 0;
  std::size_t nodes = 0;
  for (std::size_t i = 0; i + 2 < truth.size(); i += 3) {
    const double dx = double{truth[i]} - double{sample[i]}, dy = double{truth[i + 1]} - double{sample[i + 1]},
                 dz = double{truth[i + 2]} - double{sample[i + 2]};
    const double distance = std::sqrt(dx * dx + dy * dy + dz * dz);
    if (std::isnan(distance)) continue;
    sum += distance;
    ++nodes;
  }
  return sum / static_cast<double>(nodes);
}

Oracle oracle(const Model& model, std::span<const float> truth) {
  Oracle best{.error = std::numeric_limits<double>::infinity()};
  for (std::uint32_t s = 0; s < model.samples(); ++s) {
    const double error = experiment_error(truth, model.node_positions(s));
    if (error < best.error) best = {s, error};
  }
  return best;
}

}  // namespace lbea::tool
