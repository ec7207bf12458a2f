#include "adapters/simulation/d3plot/binout.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>

namespace lbea::io::d3plot {
namespace {

struct ReadDatabase {
  const char* directory;
  const char* name;
  HistoryOwner owner;
};
constexpr std::array read_databases{ReadDatabase{"/glstat", "glstat", HistoryOwner::run},
                                    ReadDatabase{"/matsum", "matsum", HistoryOwner::part},
                                    ReadDatabase{"/rwforc/forces", "rwforc", HistoryOwner::wall}};

constexpr std::string_view time_name = "time", ids_name = "ids", metadata = "metadata";

/// The number of a process, none of a single one, and that of a file of it.
using FileNumbers = std::pair<std::optional<std::uint64_t>, std::uint64_t>;

/// Of the end of a name, "0003%012"; none of other names.
std::optional<FileNumbers> numbers_of(std::string_view end) {
  const auto number = [](std::string_view digits) -> std::optional<std::uint64_t> {
    std::uint64_t value = 0;
    const auto [rest, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    return error == std::errc() && rest == digits.data() + digits.size() ? std::optional(value) : std::nullopt;
  };
  const std::size_t percent = std::min(end.find('%'), end.size());
  const auto process = number(end.substr(0, percent));
  const auto file = percent == end.size() ? std::optional<std::uint64_t>(0) : number(end.substr(percent + 1));
  if ((percent > 0 && !process) || !file) return std::nullopt;
  return FileNumbers{process, *file};
}

std::map<FileNumbers, std::filesystem::path> files_beside(const std::filesystem::path& d3plot) {
  constexpr std::string_view ending = "d3plot";
  std::string prefix = d3plot.filename().string();
  if (!prefix.ends_with(ending)) return {};
  prefix.replace(prefix.size() - ending.size(), ending.size(), "binout");
  std::map<FileNumbers, std::filesystem::path> files;
  std::error_code unknown;
  for (const auto& entry : std::filesystem::directory_iterator(d3plot.parent_path() / ".", unknown)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(prefix) || !entry.is_regular_file(unknown)) continue;
    const auto numbers = numbers_of(std::string_view(name).substr(prefix.size()));
    if (numbers && !files.emplace(*numbers, d3plot.parent_path() / name).second)
      throw Error{Status::bad_input, (d3plot.parent_path() / name).string() +
                                         " has the number of another binout; remove the files of an earlier run"};
  }
  return files;
}

}  // namespace

Binout::Binout(const std::filesystem::path& d3plot) : databases_(read_databases.size()) {
  constexpr std::uint64_t alone = std::numeric_limits<std::uint64_t>::max();
  for (const auto& [numbers, path] : files_beside(d3plot)) {
    paths_.push_back(path);
    files_.emplace_back(path, [this, process = numbers.first.value_or(alone)](
                                  const std::string& directory, const std::string& name,
                                  const LsdaNumbers& of_variable) { add(process, directory, name, of_variable); });
  }
  for (std::size_t i = 0; i < databases_.size(); ++i) list_histories(i);
}

std::uint32_t Binout::number_of(const std::string& name) {
  const auto found = std::ranges::find(names_, name);
  const auto place = static_cast<std::uint32_t>(found - names_.begin());
  if (found == names_.end()) names_.push_back(name);
  return place;
}

const Binout::Variable* Binout::Database::find(std::size_t place, std::uint32_t name) const noexcept {
  const auto variables_of_state = state(place);
  const auto found = std::ranges::find(variables_of_state, name, &Variable::name);
  return found == variables_of_state.end() ? nullptr : &*found;
}

/// A directory with a variable that its last state has is that of another state, after a restart.
void Binout::add(std::uint64_t process, const std::string& directory, const std::string& name,
                 const LsdaNumbers& numbers) {
  const std::size_t end = std::min(directory.rfind('/'), directory.size());
  const auto found = std::ranges::find(read_databases, std::string_view(directory).substr(0, end),
                                       [](const ReadDatabase& known) { return std::string_view(known.directory); });
  if (found == read_databases.end()) return;
  Database& database = databases_[static_cast<std::size_t>(found - read_databases.begin())];
  if (database.process.value_or(process) != process)
    throw Error{Status::bad_input, paths_.back().string() + " has " + found->name +
                                       ", as has the binout of another process; remove the files of an earlier run"};
  database.process = process;
  const Variable variable{static_cast<std::uint32_t>(paths_.size() - 1), number_of(name), numbers};
  if (std::string_view(directory).substr(end + 1) == metadata) {
    if (name == ids_name) database.ids = variable;
    return;
  }
  const bool continues = database.states() > 0 && directory == database.directory &&
                         database.find(database.states() - 1, variable.name) == nullptr;
  if (!continues) {
    database.begins.push_back(database.variables.size());
    database.directory = directory;
  }
  database.variables.push_back(variable);
}

/// Real numbers, as many in each state as the database has owners.
void Binout::list_histories(std::size_t place) {
  Database& database = databases_[place];
  const HistoryOwner owner = read_databases[place].owner;
  // An interrupted run may have written a part of its last state.
  if (database.states() > 1 && database.state(database.states() - 1).size() < database.state(0).size()) {
    database.variables.resize(database.begins.back());
    database.begins.pop_back();
  }
  if (database.states() == 0) return;
  const std::vector<std::uint32_t> ids = ids_of(database);
  const std::size_t owners = owner == HistoryOwner::run ? 1 : ids.size();
  std::vector<std::uint32_t> listed;
  for (const Variable& first : database.state(0)) {
    bool is_in_all = owners > 0 && names_[first.name] != time_name;
    for (std::size_t state = 0; state < database.states() && is_in_all; ++state) {
      const Variable* own = database.find(state, first.name);
      is_in_all = own != nullptr && binary::is_real(own->numbers.type) && own->numbers.count == owners;
    }
    if (is_in_all) listed.push_back(first.name);
  }
  std::ranges::sort(listed, {}, [this](std::uint32_t name) { return names_[name]; });
  for (const std::uint32_t name : listed) {
    histories_.push_back({std::string(read_databases[place].name) + "." + names_[name], owner,
                          owner == HistoryOwner::run ? std::vector<std::uint32_t>() : ids});
    for (std::size_t i = 0; i < owners; ++i) numbers_.push_back({place, name, i});
  }
}

std::vector<std::uint32_t> Binout::ids_of(const Database& database) const {
  std::vector<std::uint32_t> ids;
  if (!database.ids) return ids;
  for (const double id : files_[database.ids->file].read(database.ids->numbers)) {
    if (!(id >= 0) || id > std::numeric_limits<std::uint32_t>::max()) return {};
    ids.push_back(static_cast<std::uint32_t>(id));
  }
  return ids;
}

std::vector<std::filesystem::path> Binout::files() const { return paths_; }

double Binout::read(const Variable& variable, std::uint64_t place) const {
  const LsdaNumbers& all = variable.numbers;
  return files_[variable.file].read({all.type, all.byte + place * binary::size_of(all.type), 1}).front();
}

const bake::HistorySeries& Binout::series(std::uint32_t place) {
  if (place == read_place_) return read_;
  const Number& number = numbers_.at(place);
  const Database& database = databases_[number.database];
  const std::uint32_t time_number = number_of(std::string(time_name));
  bake::HistorySeries series;
  for (std::size_t state = 0; state < database.states(); ++state) {
    const Variable* const time = database.find(state, time_number);
    const Variable& value = *database.find(state, number.name);
    const bool has_time = time != nullptr && time->numbers.count > 0;
    const double now = has_time ? read(*time, 0) : std::numeric_limits<double>::quiet_NaN();
    if (!std::isfinite(now))
      throw Error{Status::bad_input, paths_[value.file].string() + ": state " + std::to_string(state + 1) + " of " +
                                         read_databases[number.database].name +
                                         " has no time; the file is damaged, copy or compute it again"};
    while (!series.times.empty() && series.times.back() >= now) {
      series.times.pop_back();
      series.values.pop_back();
    }
    series.times.push_back(now);
    series.values.push_back(read(value, number.place));
  }
  read_ = std::move(series);
  read_place_ = place;
  return read_;
}

}  // namespace lbea::io::d3plot
