#include "adapters/simulation/d3plot/binout.hpp"
#include "adapters/simulation/d3plot/database.hpp"
#include "adapters/simulation/open.hpp"
#include "adapters/simulation/surface.hpp"
#include "precompute/simulation.hpp"

#include <algorithm>
#include <utility>

namespace lbea::io::d3plot {
namespace {
constexpr std::uint32_t no_row = std::numeric_limits<std::uint32_t>::max();
constexpr std::uint64_t words_at_a_time = 1 << 18;

/// A d3plot family as a SimulationReader.
class Reader final : public bake::SimulationReader {
 public:
  explicit Reader(const std::filesystem::path& first_file) : database_(open_database(first_file)), file_(database_) {
    build_mesh();
    number_shell_rows();
    stored_ = stored_fields(database_.layout);
    std::transform(stored_.begin(), stored_.end(), std::back_inserter(fields_), describe);
    // Without a state, nothing limits NGLBV.
    if (states() > 0) histories_ = stored_histories(database_.header, database_.geometry.part_ids);
    database_.geometry = {};
  }

  [[nodiscard]] const bake::SimulationMesh& mesh() const noexcept override { return mesh_; }
  [[nodiscard]] const std::vector<bake::SimulationField>& fields() const noexcept override { return fields_; }
  [[nodiscard]] std::uint32_t states() const noexcept override {
    return static_cast<std::uint32_t>(database_.states.size());
  }
  [[nodiscard]] std::string remark() const override { return database_.remark; }
  [[nodiscard]] double time_s(std::uint32_t state) const override { return place(state).time_s; }
  void read(std::uint32_t state, bake::SimulationState& into) override {
    const StatePlace& at = place(state);
    into.time_s = at.time_s;
    read_positions(at, into.positions);
    read_alive(at, into.alive);
    read_fields(at, into);
  }
  /// Those of d3plot, then those of binout, which is read now: most bakes need none.
  [[nodiscard]] std::vector<bake::SimulationHistory> histories() override {
    std::vector<bake::SimulationHistory> all = histories_.histories;
    open_binout();
    if (binout_) all.insert(all.end(), binout_->histories().begin(), binout_->histories().end());
    return all;
  }
  [[nodiscard]] double history(std::uint32_t state, std::uint32_t number) override {
    const StatePlace& at = place(state);
    const auto in_binout = place_in_binout(number);
    if (!in_binout) return file_.real(at, histories_.words[number]);
    const bake::HistorySeries& series = binout_->series(*in_binout);
    return series.covers(at.time_s) ? series.at(at.time_s) : std::numeric_limits<double>::quiet_NaN();
  }
  [[nodiscard]] bake::HistorySeries history_series(std::uint32_t number) override {
    const auto in_binout = place_in_binout(number);
    return in_binout ? binout_->series(*in_binout) : bake::HistorySeries();
  }
  /// With those of binout, if it was read.
  [[nodiscard]] std::vector<std::filesystem::path> files() const override {
    std::vector<std::filesystem::path> all = database_.family;
    if (binout_) std::ranges::copy(binout_->files(), std::back_inserter(all));
    return all;
  }

 private:
  [[nodiscard]] const StatePlace& place(std::uint32_t state) const {
    if (state >= database_.states.size())
      throw Error{Status::bad_input, database_.family.front().string() + " has " + std::to_string(states()) +
                                         " states; state " + std::to_string(state) + " does not exist"};
    return database_.states[state];
  }

  /// A run can be read without its binout.
  void open_binout() {
    if (std::exchange(has_opened_binout_, true)) return;
    try {
      binout_.emplace(database_.family.front());
    } catch (const Error& error) {
      if (!database_.remark.empty()) database_.remark += "; ";
      database_.remark += std::string("its binout is not used: ") + error.what();
    }
  }
  /// None: the number is in d3plot.
  [[nodiscard]] std::optional<std::uint32_t> place_in_binout(std::uint32_t number) {
    if (number >= histories_.words.size()) open_binout();
    const std::size_t in_d3plot = histories_.words.size(), in_binout = binout_ ? binout_->numbers() : 0;
    if (number < in_d3plot) return std::nullopt;
    if (number - in_d3plot < in_binout) return static_cast<std::uint32_t>(number - in_d3plot);
    throw Error{Status::bad_input, database_.family.front().string() + " has " + std::to_string(in_d3plot + in_binout) +
                                       " numbers of histories; it changed while it was read, try again"};
  }

  void build_mesh() {
    const Geometry& geometry = database_.geometry;
    add_elements(shell_faces(geometry.shells.nodes), geometry.shells.ids, geometry.shells.parts);
    shell_elements_ = mesh_.elements.size();
    mesh_.has_solver_ids = database_.header.numbering_words > 0;
    const SolidFaces solids = solid_faces(geometry.solids.nodes);
    add_elements(solids.outer, geometry.solids.ids, geometry.solids.parts);
    if (mesh_.elements.empty())
      throw Error{Status::bad_input, database_.family.front().string() +
                                         ", byte 0: every element is degenerate, there is no surface; check the model"};
    if (database_.header.deletion == Deletion::elements) {
      add_elements(solids.touching, geometry.solids.ids, geometry.solids.parts);
      mesh_.touching = solids.touching.size();
    }
    keep_used_nodes();
  }

  void add_elements(const std::vector<SurfaceElement>& faces, const std::vector<std::uint32_t>& ids,
                    const std::vector<std::uint32_t>& parts) {
    const std::vector<std::uint32_t>& part_ids = database_.geometry.part_ids;
    for (const SurfaceElement& face : faces) {
      const std::uint32_t part = parts[face.source];
      mesh_.elements.push_back(face.nodes);
      mesh_.element_ids.push_back(ids[face.source]);
      mesh_.element_parts.push_back(part <= part_ids.size() ? part_ids[part - 1] : part);
      source_.push_back(face.source);
    }
  }

  void keep_used_nodes() {
    const Geometry& geometry = database_.geometry;
    std::vector<std::uint32_t> kept(database_.header.nodes, 0);
    for (const auto& element : mesh_.elements)
      for (const std::uint32_t node : element) kept[node] = 1;
    for (std::uint32_t node = 0; node < kept.size(); ++node) {
      if (kept[node] == 0) continue;
      kept[node] = static_cast<std::uint32_t>(node_source_.size());
      node_source_.push_back(node);
      mesh_.node_ids.push_back(geometry.node_ids[node]);
      const auto from = geometry.positions.begin() + static_cast<std::ptrdiff_t>(node) * 3;
      mesh_.positions.insert(mesh_.positions.end(), from, from + 3);
    }
    for (auto& element : mesh_.elements)
      for (std::uint32_t& node : element) node = kept[node];
  }

  void number_shell_rows() {
    std::uint32_t row = 0;
    for (const std::uint8_t is_rigid : database_.geometry.shell_is_rigid)
      shell_row_.push_back(is_rigid && !database_.header.stores_rigid_shells ? no_row : row++);
  }
  void read_positions(const StatePlace& place, std::vector<float>& into) {
    scratch_.resize(database_.header.nodes * 3);
    file_.read(place, database_.layout.positions, scratch_);
    into.resize(node_source_.size() * 3);
    for (std::size_t node = 0; node < node_source_.size(); ++node)
      std::copy_n(scratch_.begin() + static_cast<std::ptrdiff_t>(node_source_[node]) * 3, 3,
                  into.begin() + static_cast<std::ptrdiff_t>(node) * 3);
  }

  void read_alive(const StatePlace& place, std::vector<std::uint8_t>& into) {
    const Header& header = database_.header;
    const StateLayout& layout = database_.layout;
    into.assign(mesh_.elements.size(), 1);
    if (header.deletion == Deletion::nodes) {
      scratch_.resize(header.nodes);
      file_.read(place, layout.node_flags, scratch_);
      const auto is_dead = [&](std::uint32_t node) { return scratch_[node_source_[node]] == 0; };
      for (std::size_t e = 0; e < into.size(); ++e)
        into[e] = std::none_of(mesh_.elements[e].begin(), mesh_.elements[e].end(), is_dead) ? 1 : 0;
    } else if (header.deletion == Deletion::elements) {
      const auto copy = [&](std::uint64_t start, std::uint64_t count, std::size_t first, std::size_t last) {
        scratch_.resize(count);
        file_.read(place, start, scratch_);
        for (std::size_t e = first; e < last; ++e) into[e] = scratch_[source_[e]] != 0 ? 1 : 0;
      };
      copy(layout.shell_flags, header.shells, 0, shell_elements_);
      copy(layout.solid_flags, header.solids + header.thick_shells, shell_elements_, into.size());
    }
  }

  void read_fields(const StatePlace& place, bake::SimulationState& into) {
    const auto shells = read_rows(place, database_.layout.shells, database_.layout.shell);
    auto solids = read_rows(place, database_.layout.solids, database_.layout.solid);
    const auto thick_shells = read_rows(place, database_.layout.thick_shells, database_.layout.thick_shell);
    for (std::size_t f = 0; f < solids.size(); ++f)
      solids[f].insert(solids[f].end(), thick_shells[f].begin(), thick_shells[f].end());
    into.fields.resize(stored_.size());
    for (std::size_t f = 0; f < stored_.size(); ++f) {
      into.fields[f].assign(mesh_.elements.size(), 0.0f);
      for (std::size_t e = 0; e < shell_elements_; ++e)
        if (const std::uint32_t row = shell_row_[source_[e]]; row != no_row) into.fields[f][e] = shells[f][row];
      for (std::size_t e = shell_elements_; e < mesh_.elements.size(); ++e) into.fields[f][e] = solids[f][source_[e]];
    }
  }

  std::vector<std::vector<float>> read_rows(const StatePlace& place, const Block& block, const RowFields& row) {
    std::vector<std::vector<float>> values(stored_.size(), std::vector<float>(block.rows));
    if (block.row_words == 0 || stored_.empty()) return values;
    const std::uint64_t rows_at_a_time = std::max<std::uint64_t>(1, words_at_a_time / block.row_words);
    for (std::uint64_t first = 0; first < block.rows; first += rows_at_a_time) {
      const std::uint64_t count = std::min(rows_at_a_time, block.rows - first);
      scratch_.resize(count * block.row_words);
      file_.read(place, block.start + first * block.row_words, scratch_);
      for (std::uint64_t r = 0; r < count; ++r) {
        const auto words = std::span<const float>(scratch_).subspan(r * block.row_words, block.row_words);
        for (std::size_t f = 0; f < stored_.size(); ++f) values[f][first + r] = field_value(stored_[f], row, words);
      }
    }
    return values;
  }

  Database database_;
  StateFile file_;
  bake::SimulationMesh mesh_;
  std::vector<Field> stored_;
  std::vector<bake::SimulationField> fields_;
  StoredHistories histories_;
  std::optional<Binout> binout_;
  bool has_opened_binout_ = false;
  std::size_t shell_elements_ = 0;          // the first elements of the mesh are shells, the others faces of solids
  std::vector<std::uint32_t> source_;       // element -> shell, or solid or thick shell, of the database
  std::vector<std::uint32_t> node_source_;  // node -> node of the database
  std::vector<std::uint32_t> shell_row_;    // shell -> its row in a state, or no_row
  std::vector<float> scratch_;
};

}  // namespace
}  // namespace lbea::io::d3plot

namespace lbea::io {
std::unique_ptr<bake::SimulationReader> open_d3plot(const std::filesystem::path& first_file) {
  return std::make_unique<d3plot::Reader>(first_file);
}
}  // namespace lbea::io
