#include "adapters/simulation/d3plot/binout.hpp"

#include <algorithm>
#include <charconv>

namespace lbea::io::d3plot {
namespace {

struct KnownDatabase {
  const char* directory;
  const char* name;
  HistoryOwner owner;
};
constexpr std::array read_databases{KnownDatabase{"/glstat", "glstat", HistoryOwner::run},
                                    KnownDatabase{"/matsum", "matsum", HistoryOwner::part},
                                    KnownDatabase{"/rwforc/forces", "rwforc", HistoryOwner::wall}};

constexpr std::string_view time_name = "time", ids_name = "ids", metadata = "metadata";

/// The number of a process and that of a file of it, of the name's end "0003%012"; none of other names.
std::optional<std::pair<std::uint64_t, std::uint64_t>> numbers_of(std::string_view end) {
  std::pair<std::uint64_t, std::uint64_t> numbers{};
  const auto read = [](std::string_view digits, std::uint64_t& number) {
    const auto [rest, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
    return digits.empty() || (error == std::errc() && rest == digits.data() + digits.size());
  };
  const std::size_t percent = std::min(end.find('%'), end.size());
  const bool is_known =
      read(end.substr(0, percent), numbers.first) &&
      (percent == end.size() || (percent + 1 < end.size() && read(end.substr(percent + 1), numbers.second)));
  return is_known ? std::optional(numbers) : std::nullopt;
}

std::vector<std::filesystem::path> files_beside(const std::filesystem::path& d3plot) {
  constexpr std::string_view ending = "d3plot";
  std::string prefix = d3plot.filename().string();
  if (!prefix.ends_with(ending)) return {};
  prefix.replace(prefix.size() - ending.size(), ending.size(), "binout");
  std::map<std::pair<std::uint64_t, std::uint64_t>, std::filesystem::path> files;
  std::error_code unknown;
  for (const auto& entry : std::filesystem::directory_iterator(d3plot.parent_path() / ".", unknown)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(prefix) || !entry.is_regular_file(unknown)) continue;
    if (const auto numbers = numbers_of(std::string_view(name).substr(prefix.size())))
      files.emplace(*numbers, d3plot.parent_path() / name);
  }
  std::vector<std::filesystem::path> sorted;
  for (auto& [numbers, file] : files) sorted.push_back(std::move(file));
  return sorted;
}

}  // namespace

Binout::Binout(const std::filesystem::path& d3plot) {
  for (const KnownDatabase& database : read_databases) databases_.push_back({database.name, {}, {}});
  for (const std::filesystem::path& file : files_beside(d3plot)) {
    files_.emplace_back(file);
    for (const LsdaVariable& variable : files_.back().variables()) add(files_.size() - 1, variable);
  }
  for (std::size_t i = 0; i < databases_.size(); ++i) list_histories(i);
}

void Binout::add(std::size_t file, const LsdaVariable& variable) {
  const std::size_t end = std::min(variable.directory.rfind('/'), variable.directory.size());
  const auto found =
      std::ranges::find(read_databases, std::string_view(variable.directory).substr(0, end),
                        [](const KnownDatabase& database) { return std::string_view(database.directory); });
  if (found == read_databases.end()) return;
  Database& database = databases_[static_cast<std::size_t>(found - read_databases.begin())];
  if (std::string_view(variable.directory).substr(end + 1) == metadata) {
    if (variable.name == ids_name) database.ids = {file, variable};
    return;
  }
  const auto [state, is_new] = state_of_.emplace(variable.directory, database.states.size());
  if (is_new) database.states.emplace_back();
  database.states[state->second].insert_or_assign(variable.name, Stored{file, variable});
}

/// Real numbers, as many in each state as the database has owners.
void Binout::list_histories(std::size_t place) {
  Database& database = databases_[place];
  const HistoryOwner owner = read_databases[place].owner;
  // An interrupted run may have written a part of its last state.
  if (database.states.size() > 1 && database.states.back().size() < database.states.front().size())
    database.states.pop_back();
  if (database.states.empty()) return;
  const std::vector<std::uint32_t> ids = ids_of(database);
  const std::size_t owners = owner == HistoryOwner::run ? 1 : ids.size();
  for (const auto& [name, stored] : database.states.front()) {
    const auto has_it = [&, &name = name](const State& state) {
      const auto found = state.find(name);
      return found != state.end() && binary::is_real(found->second.variable.type) &&
             found->second.variable.count == owners;
    };
    if (name == time_name || owners == 0 || !std::ranges::all_of(database.states, has_it)) continue;
    histories_.push_back(
        {database.name + "." + name, owner, owner == HistoryOwner::run ? std::vector<std::uint32_t>() : ids});
    for (std::size_t i = 0; i < owners; ++i) numbers_.push_back({place, name, i});
  }
}

std::vector<std::uint32_t> Binout::ids_of(const Database& database) const {
  std::vector<std::uint32_t> ids;
  if (!database.ids) return ids;
  for (const double id : files_[database.ids->file].read(database.ids->variable)) {
    if (!(id >= 0) || id > std::numeric_limits<std::uint32_t>::max()) return {};
    ids.push_back(static_cast<std::uint32_t>(id));
  }
  return ids;
}

std::vector<std::filesystem::path> Binout::files() const {
  std::vector<std::filesystem::path> paths;
  for (const LsdaFile& file : files_) paths.push_back(file.path());
  return paths;
}

double Binout::read(const Stored& stored, std::uint64_t place) const {
  return files_[stored.file].read(stored.variable, place);
}

const bake::HistorySeries& Binout::series(std::uint32_t place) {
  if (place == read_place_) return read_;
  const Number& number = numbers_.at(place);
  bake::HistorySeries series;
  for (const State& state : databases_[number.database].states) {
    const auto time = state.find(time_name);
    const Stored& stored = state.find(number.variable)->second;
    const std::string where = files_[stored.file].path().string() + ", " + stored.variable.directory;
    if (time == state.end() || time->second.variable.count == 0)
      throw Error{Status::bad_input, where + " has no time; the file is damaged, copy or compute it again"};
    const double now = read(time->second, 0);
    if (!series.times.empty() && !(now > series.times.back()))
      throw Error{Status::bad_input, where + " has the time " + std::to_string(now) + ", not after the state before; " +
                                         "remove the binout files of an earlier run"};
    series.times.push_back(now);
    series.values.push_back(read(stored, number.place));
  }
  read_ = std::move(series);
  read_place_ = place;
  return read_;
}

double Binout::value(std::uint32_t place, double time) {
  const bake::HistorySeries& known_values = series(place);
  const std::vector<double>& times = known_values.times;
  const double interval = times.size() > 1 ? times.back() - times[times.size() - 2] : 0;
  if (time < times.front() - interval || time > times.back() + interval)
    throw Error{Status::bad_input, files_.front().path().string() + " has " +
                                       databases_[numbers_[place].database].name + " from " +
                                       std::to_string(times.front()) + " to " + std::to_string(times.back()) +
                                       ", not at the state's time " + std::to_string(time) +
                                       "; compute the run to its end, or remove the channel"};
  return known_values.at(time);
}

}  // namespace lbea::io::d3plot
