#include "tools/eval/truth.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <unordered_map>

namespace lbea::tool {
namespace {

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

// The table's columns by name, its numbers by row, and a place for every complaint.
class Table {
 public:
  explicit Table(const std::filesystem::path& file) : file_(file), in_(file) {
    if (!in_) throw Error(Status::file_not_found, file.string() + ": cannot open the table of true states");
    if (!next()) fail("empty; lbea-sense writes this table beside its frames");
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

std::vector<std::uint32_t> find_nodes(const bake::SimulationMesh& mesh, const Model& model) {
  std::unordered_map<std::uint32_t, std::uint32_t> index_of;
  for (std::uint32_t i = 0; i < mesh.nodes(); ++i) index_of.emplace(mesh.node_ids[i], i);
  std::vector<std::uint32_t> nodes;
  for (const std::uint32_t id : model.node_ids()) {
    const auto found = index_of.find(id);
    if (found == index_of.end())
      throw Error(Status::bad_input, "the experiment's run has no node " + std::to_string(id) +
                                         ", which the model has; EE needs the same mesh");
    nodes.push_back(found->second);
  }
  return nodes;
}

}  // namespace

Truth::Truth(const std::filesystem::path& table_file, std::unique_ptr<bake::SimulationReader> run, const Model& model)
    : run_(std::move(run)), node_of_(find_nodes(run_->mesh(), model)) {
  for (Table table(table_file); table.next();) {
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
  into.resize(3 * node_of_.size());
  for (std::size_t i = 0; i < node_of_.size(); ++i)
    std::copy_n(state_.positions.data() + std::size_t{3} * node_of_[i], 3, into.data() + 3 * i);
}

}  // namespace lbea::tool
