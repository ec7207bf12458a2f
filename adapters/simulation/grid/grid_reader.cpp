#include "adapters/simulation/grid/grid_reader.hpp"

#include "adapters/files/text_line.hpp"
#include "adapters/simulation/grid/joined_points.hpp"
#include "adapters/simulation/open.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <set>

namespace lbea::io::grid {
namespace {
constexpr std::string_view displacement = "displacement";

/// The time in "displacement_t0.005".
std::optional<double> displacement_time(const Array& array) {
  std::string_view rest = array.name;
  if (array.components != 3 || !rest.starts_with(displacement)) return std::nullopt;
  rest.remove_prefix(displacement.size());
  if (!rest.starts_with("_t")) return std::nullopt;
  rest.remove_prefix(2);
  double time = 0;
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), time);
  const bool is_whole = error == std::errc{} && end == rest.data() + rest.size() && std::isfinite(time);
  return is_whole ? std::optional(time) : std::nullopt;
}

/// The name of an array that looks like the displacements of the points; empty when there is none.
std::string displacement_vector(const Grid& grid) {
  constexpr std::array<std::string_view, 4> names{"displacement", "displacements", "disp", "u"};
  for (const Array& array : grid.point_arrays)
    if (array.components == 3 && std::ranges::find(names, text::lower(array.name)) != names.end()) return array.name;
  return {};
}

/// Node and element ids in one list, for comparison between files.
std::vector<double> all_ids(const Grid& grid) {
  std::vector<double> ids;
  for (const auto& [arrays, name] :
       {std::pair(&grid.point_arrays, "NODE_ID"), std::pair(&grid.cell_arrays, "ELEMENT_ID")})
    if (const Array* array = find_array(*arrays, name))
      ids.insert(ids.end(), array->values.begin(), array->values.end());
  return ids;
}

std::string counts(const Cells& cells, std::size_t points) {
  return std::to_string(points) + " points and " + std::to_string(cells.size()) + " cells";
}

/// Except those of free nodes.
void require_finite(const std::vector<float>& positions, const bake::SimulationMesh& mesh,
                    const std::vector<std::uint8_t>& alive, const std::string& file) {
  const auto is_finite = [](float value) { return std::isfinite(value); };
  if (std::ranges::all_of(positions, is_finite)) return;
  const std::vector<std::uint8_t> is_free = free_nodes(mesh, alive);
  for (std::size_t i = 0; i < positions.size(); ++i)
    if (is_free[i / 3] == 0 && !is_finite(positions[i]))
      throw Error{Status::bad_input,
                  file + ": node " + std::to_string(mesh.node_ids[i / 3]) +
                      " has a position that is not a number; the run has diverged or the file is damaged"};
}

/// The mean position of the neighbors in the mesh that have one. Free nodes in the order of their distance from others.
void guess_positions(bake::SimulationMesh& mesh, std::vector<std::uint8_t> is_free) {
  mesh.guessed = is_free;
  for (std::size_t node = 0; node < is_free.size(); ++node)
    if (is_free[node] != 0) std::fill_n(&mesh.positions[3 * node], 3, 0.0f);
  struct Sum {
    std::array<double, 3> positions{};
    double count = 0;
  };
  for (std::map<std::uint32_t, Sum> next;; next.clear()) {
    for (const bake::Quad& element : mesh.elements)
      for (std::size_t i = 0; i < element.size(); ++i)
        for (const std::size_t beside : {i + 1, i + 3}) {
          const std::uint32_t node = element[i], neighbor = element[beside % element.size()];
          if (is_free[node] == 0 || is_free[neighbor] != 0) continue;
          Sum& sum = next[node];
          for (std::size_t axis = 0; axis < 3; ++axis)
            sum.positions[axis] += double{mesh.positions[3 * std::size_t{neighbor} + axis]};
          ++sum.count;
        }
    if (next.empty()) return;
    for (const auto& [node, sum] : next) {
      for (std::size_t axis = 0; axis < 3; ++axis)
        mesh.positions[3 * std::size_t{node} + axis] = static_cast<float>(sum.positions[axis] / sum.count);
      is_free[node] = 0;
    }
  }
}

/// Of nodes with an undeformed position.
bool have_moved(const std::vector<float>& positions, const bake::SimulationMesh& mesh) {
  for (std::size_t i = 0; i < positions.size(); ++i)
    if (positions[i] != mesh.positions[i] && (mesh.guessed.empty() || mesh.guessed[i / 3] == 0)) return true;
  return false;
}
}  // namespace

bool holds_run(const Grid& grid) {
  return std::ranges::any_of(grid.point_arrays,
                             [](const Array& array) { return displacement_time(array).has_value(); });
}

GridReader::GridReader(std::vector<GridState> states, ReadState read_state, ReadGrid read_time, ListParts list_parts)
    : given_(std::move(states)), read_(std::move(read_state)) {
  std::set<std::filesystem::path> known;
  for (const GridState& state : given_) {
    if (files_.empty() || files_.back() != state.file) files_.push_back(state.file);
    if (list_parts == nullptr) continue;
    for (const auto& part : list_parts(state.file))
      if (known.insert(part).second) parts_.push_back(part);
  }
  grid_ = read_(given_.front());
  const std::string name = given_.front().name();
  check_grid(grid_, name);
  joined_ = joined_points(grid_);
  require_joined(grid_, joined_, name, name);
  join(grid_);
  cells_ = grid_.cells;
  points_ = grid_.points();
  ids_ = all_ids(grid_);
  has_flags_ = has_alive_flags(grid_);
  unused_vector_ = displacement_vector(grid_);
  if (given_.size() == 1) find_displacements(grid_);
  sourced_ = mesh_of(grid_, name);
  check_positions(name);
  if (states_.empty()) find_times(given_, grid_, read_time);
  sources_ = fields_of(grid_, states_.front().suffix);
  for (const FieldSource& source : sources_) fields_.push_back(source.field);
}

// The points of a file with displacements are undeformed, those of others are deformed as in its first state.
void GridReader::check_positions(const std::string& name) {
  bake::SimulationMesh& mesh = sourced_.mesh;
  if (!states_.empty()) return require_finite(mesh.positions, mesh, {}, name);
  const std::vector<std::uint8_t> alive = alive_elements(grid_, sourced_, name);
  require_finite(mesh.positions, mesh, alive, name);
  std::vector<std::uint8_t> is_free = free_nodes(mesh, alive);
  if (std::ranges::find(is_free, 1) != is_free.end()) guess_positions(mesh, std::move(is_free));
}

void GridReader::find_displacements(const Grid& grid) {
  for (const Array& array : grid.point_arrays)
    if (const auto time = displacement_time(array))
      states_.push_back({0, *time, array.name.substr(displacement.size())});
  std::stable_sort(states_.begin(), states_.end(), [](const Place& a, const Place& b) { return a.time < b.time; });
}

void GridReader::find_times(const std::vector<GridState>& states, const Grid& first, ReadGrid read_time) {
  if (!states.front().time && !first.time) refuse_gap(files_);
  for (std::size_t i = 0; i < states.size(); ++i) {
    auto time = states[i].time;
    if (!time) time = i == 0 ? first.time : read_time == nullptr ? std::nullopt : read_time(states[i].file).time;
    if (!time && i > 0 && first.time)
      throw Error{Status::bad_input, states[i].name() + ": has no time, but " + files_.front().string() +
                                         " has; they are not states of one run"};
    states_.push_back({i, time.value_or(static_cast<double>(i)), {}});
    if (!std::isfinite(states_[i].time))
      throw Error{Status::bad_input, states[i].name() + ": its time is not a number; export it again"};
    if (i > 0 && states_[i].time < states_[i - 1].time)
      throw Error{Status::bad_input, states[i].name() + ": its time " + std::to_string(states_[i].time) +
                                         " is earlier than that of the " +
                                         (states[i].step ? "previous step; export the steps in the order of time"
                                                         : "previous file; number the files in the order of time")};
  }
}

const GridReader::Place& GridReader::place(std::uint32_t state) const {
  if (state >= states_.size())
    throw Error{Status::bad_input, files_.front().string() + " has " + std::to_string(states()) + " states; state " +
                                       std::to_string(state) + " does not exist"};
  return states_[state];
}

void GridReader::check_same_mesh(const Grid& grid, const std::string& file) const {
  if (grid.cells != cells_ || grid.points() != points_ || all_ids(grid) != ids_)
    throw Error{
        Status::bad_input,
        file + ": its mesh (" + counts(grid.cells, grid.points()) + ") is not that of " + files_.front().string() +
            " (" + counts(cells_, points_) +
            ", the same numbers in the same order); files of one run share their mesh, keep others in another folder"};
  require_joined(grid, joined_, file, files_.front().string());
}

void GridReader::check_same_arrays(const Grid& grid, const std::string& file) const {
  for (const FieldSource& source : sources_)
    for (const auto& [arrays, array] :
         {std::pair(&grid.cell_arrays, &source.flat_array), std::pair(&grid.cell_arrays, &source.solid_array),
          std::pair(&grid.point_arrays, &source.point_array)})
      if (const Array* found = array->empty() ? nullptr : find_array(*arrays, *array);
          !array->empty() && (found == nullptr || found->components != 1))
        throw Error{Status::bad_input, file + ": has no array \"" + *array + "\", but " + files_.front().string() +
                                           " has; export all states with the same arrays"};
  // Without flags all elements would be alive again in this state.
  if (has_flags_ && !has_alive_flags(grid))
    throw Error{Status::bad_input, file + ": has no array of eroded elements (EROSION_STATUS), but " +
                                       files_.front().string() + " has; export all states with the same arrays"};
}

void GridReader::join(Grid& grid) const {
  if (joined_.empty() || grid.points() != joined_.size()) return;  // another mesh, which check_same_mesh refuses
  for (std::uint32_t& point : grid.cells.points) point = joined_[point];
}

void GridReader::load(std::size_t given) {
  if (loaded_ == given) return;
  Grid grid = read_(given_[given]);
  const std::string name = given_[given].name();
  check_grid(grid, name);
  join(grid);
  check_same_mesh(grid, name);
  if (given != 0) check_same_arrays(grid, name);
  grid_ = std::move(grid);
  loaded_ = given;
}

void GridReader::copy_positions(const Place& place, std::vector<float>& into) const {
  const Array* moved =
      place.suffix.empty() ? nullptr : find_array(grid_.point_arrays, std::string(displacement) + place.suffix);
  into.resize(3 * sourced_.node_source.size());
  for (std::size_t node = 0; node < sourced_.node_source.size(); ++node)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t at = 3 * std::size_t{sourced_.node_source[node]} + axis;
      const double by = moved == nullptr ? 0 : moved->values[at];
      into[3 * node + axis] = static_cast<float>(static_cast<double>(grid_.positions[at]) + by);
    }
}

std::string GridReader::remark() const {
  if (unused_vector_.empty() || !has_read_later_ || has_moved_) return {};
  return "the points do not move, and the vector '" + unused_vector_ +
         "' is not used; export deformed positions, or displacements as displacement_t<time> in one file";
}

void GridReader::read(std::uint32_t state, bake::SimulationState& into) {
  const Place& at = place(state);
  load(at.given);
  into.time_s = at.time;
  copy_positions(at, into.positions);
  into.alive = alive_elements(grid_, sourced_, given_[at.given].name());
  require_finite(into.positions, sourced_.mesh, into.alive, given_[at.given].name());
  has_read_later_ = has_read_later_ || at.given > 0;
  has_moved_ = has_moved_ || have_moved(into.positions, sourced_.mesh);
  into.fields.resize(sources_.size());
  for (std::size_t f = 0; f < sources_.size(); ++f)
    into.fields[f] = field_values(grid_, sourced_, sources_[f], at.suffix);
}
}  // namespace lbea::io::grid
