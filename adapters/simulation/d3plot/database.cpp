#include "adapters/simulation/d3plot/database.hpp"

#include "precompute/work/stale_files.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace lbea::io::d3plot {
namespace {
namespace fs = std::filesystem;

/// 7 for "07", 100 for "100"; nothing for names that no solver writes: one digit, "007".
std::optional<std::uint32_t> member_number(std::string_view digits) {
  if (digits.size() < 2 || (digits.size() > 2 && digits.front() == '0')) return std::nullopt;
  std::uint32_t number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  if (error != std::errc{} || end != digits.data() + digits.size() || number == 0) return std::nullopt;
  return number;
}

/// "d3plot" for "d3plot07".
std::string without_digits(const std::string& name) { return name.substr(0, name.find_last_not_of("0123456789") + 1); }

void refuse_adaptive(const fs::path& first_file) {
  std::error_code none;
  const fs::path remeshed = first_file.string() + "aa";
  if (fs::exists(remeshed, none))
    throw Error{
        Status::unsupported_input,
        remeshed.string() + ", byte 0: the family is adaptive, its mesh changes; run without *CONTROL_ADAPTIVE"};
}

enum class End {
  marked,   // by the end marker
  plain,    // by the end of the file or by zeros up to it
  cut,      // in the middle of a state
  overrun,  // by an end marker inside the last state
  bad,      // by words that are not a state
};

struct Walk {
  std::vector<StatePlace> states;
  End end = End::plain;
  std::uint64_t word = 0;  // where it ended
};

bool has_marker_from(const WordFile& file, std::uint64_t word) {
  std::vector<float> chunk(std::min<std::uint64_t>(1 << 16, file.words() - std::min(word, file.words())));
  for (; (word = file.next_data(word)) < file.words(); word += chunk.size()) {
    const auto part = std::span(chunk).first(std::min<std::uint64_t>(chunk.size(), file.words() - word));
    file.reals(word, part, "a state");
    if (std::find(part.begin(), part.end(), static_cast<float>(end_marker)) != part.end()) return true;
  }
  return false;
}

/// Steps from state to state of one file. `previous` is the last state of the files before it.
Walk step_through(const WordFile& file, std::uint32_t index, std::uint64_t word, std::uint64_t state_words,
                  const StatePlace* previous) {
  Walk found;
  for (found.word = word; found.word < file.words(); found.word += state_words) {
    if (!found.states.empty()) previous = &found.states.back();
    const double time = file.real(found.word, "the time of a state");
    const bool is_late = std::isfinite(time) && (previous == nullptr || time >= previous->time_s);
    if (time == end_marker) {
      found.end = End::marked;
      return found;
    }
    if ((!is_late || time == 0) && file.is_zero_from(found.word)) return found;
    if (plus(found.word, state_words) > file.words() || !is_late) {
      found.end = plus(found.word, state_words) > file.words() ? End::cut : End::bad;
      return found;
    }
    found.states.push_back({index, found.word, time});
  }
  return found;
}

/// The same, and checks that no state contains an end marker, which would mean that states are shorter than computed.
Walk walk(const WordFile& file, std::uint32_t index, std::uint64_t word, std::uint64_t state_words,
          const StatePlace* previous) {
  Walk found = step_through(file, index, word, state_words, previous);
  if (found.end == End::marked || found.end == End::bad) return found;
  const std::uint64_t last = found.states.empty() ? word : found.states.back().word;
  if (!has_marker_from(file, last)) return found;
  found.end = End::overrun;
  found.word = last;
  return found;
}

void refuse_unfit(const WordFile& file, const Walk& found, bool is_last, std::uint64_t state_words) {
  const std::string state = "a state of " + std::to_string(times(state_words, file.word_bytes())) + " bytes";
  if (found.end == End::bad)
    file.refuse(Status::bad_input, found.word,
                "neither " + state + " nor an end marker is here, its time would be " +
                    std::to_string(file.real(found.word, "the time of a state")) +
                    "; the file is damaged, or files of two runs are mixed: keep one run's files in the folder");
  if (found.end == End::overrun)
    file.refuse(Status::bad_input, found.word,
                state +
                    " should be here, but the states end inside it; the control words do not match the states, copy or "
                    "compute the files again");
  if (found.end == End::cut && !is_last)
    file.refuse(Status::bad_input, found.word,
                "the file ends at byte " + std::to_string(file.bytes()) + " in the middle of " + state +
                    ", but later files follow; copy it again");
}

/// Throws when `file`, which does not begin like a first file, has the name of a later one (`d3plot07` beside
/// `d3plot`).
void refuse_continuation(const fs::path& file) {
  const std::string name = file.filename().string(), base = without_digits(name);
  std::error_code none;
  if (!base.empty() && member_number(std::string_view(name).substr(base.size())) &&
      fs::exists(file.parent_path() / base, none))
    throw Error{Status::bad_input,
                file.string() + ", byte 0: this is a later file of a family; give its first file, " + base};
}

/// The first file and its continuations `<name>01` ... `<name>99`, `<name>100`, ... in numeric order.
std::vector<fs::path> find_family(const fs::path& first_file) {
  refuse_adaptive(first_file);
  const std::string name = first_file.filename().string();
  const fs::path folder = first_file.has_parent_path() ? first_file.parent_path() : fs::path(".");
  std::vector<std::pair<std::uint32_t, fs::path>> members;
  std::error_code error;
  const std::vector<std::string> names = bake::names_in(folder, error);
  if (error) throw Error{Status::file_not_found, folder.string() + ": " + error.message() + "; check the path"};
  for (const std::string& other : names) {
    if (other.size() <= name.size() || other.compare(0, name.size(), name) != 0) continue;
    const auto number = member_number(std::string_view(other).substr(name.size()));
    if (number && fs::is_regular_file(folder / other, error))
      members.emplace_back(*number, first_file.parent_path() / other);
  }
  std::sort(members.begin(), members.end());
  std::vector<fs::path> family{first_file};
  for (auto& [number, path] : members) family.push_back(std::move(path));
  return family;
}

/// A family without one of its files would lack states, and later states would have lower numbers.
void refuse_gaps(const std::vector<fs::path>& family) {
  for (std::size_t number = 1; number < family.size(); ++number) {
    const std::string digits = (number < 10 ? "0" : "") + std::to_string(number);
    const fs::path expected = family.front().string() + digits;
    if (family[number].filename() != expected.filename())
      throw Error{Status::bad_input, expected.string() + " is missing, but " + family[number].filename().string() +
                                         " is there; copy the family again, or move its later files elsewhere"};
  }
}

/// The title blocks that may follow the geometry begin with their type; as a time it would be below 1e-39.
bool begins_titles(const WordFile& file, std::uint64_t word) {
  constexpr std::array types{90000, 90001, 90002, 90100};
  return word < file.words() && std::ranges::find(types, file.integers(word, 1, "a title block")[0]) != types.end();
}

/// Whether other data than states follow the geometry of a first file. Less than one state cannot be told from them.
bool is_other_data(const WordFile& file, const Walk& found, std::uint64_t word) {
  if (found.end == End::marked || found.end == End::plain) return false;
  const std::size_t doubtful = found.end == End::overrun ? 1 : 0;  // the state that contains the end marker
  return found.states.size() <= doubtful || begins_titles(file, word);
}

/// Finds the complete states, each of `state_words`. A state never spans files; a file ends with an end marker, with
/// its last byte, or with zeros. In the first file states may follow the geometry at `first_word`.
std::vector<StatePlace> index_states(const std::vector<fs::path>& family, std::uint64_t word_bytes,
                                     std::uint64_t first_word, std::uint64_t state_words, std::string& remark) {
  std::vector<StatePlace> states;
  for (std::uint32_t f = 0; f < family.size(); ++f) {
    const WordFile file(family[f], word_bytes);
    Walk found = walk(file, f, f == 0 ? first_word : 0, state_words, states.empty() ? nullptr : &states.back());
    const bool is_last = f + 1 == family.size();
    if (f == 0 && !is_last && is_other_data(file, found, first_word)) continue;
    refuse_unfit(file, found, is_last, state_words);
    if (f > 0 && !is_last && found.states.empty())
      file.refuse(Status::bad_input, 0, "the file holds no state, but later files follow; copy it again");
    if (found.end == End::cut)
      remark = file.path().string() + " ends in the middle of a state, which is left out; is the run complete?";
    else if (f > 0 && found.states.empty())
      remark = file.path().string() + " holds no state; is the run complete?";
    states.insert(states.end(), found.states.begin(), found.states.end());
  }
  return states;
}
}  // namespace

Database open_database(const std::filesystem::path& first_file) {
  WordFile file(first_file);
  if (!detect_encoding(file)) refuse_continuation(first_file);
  Database database;
  database.family = find_family(first_file);
  database.header = read_header(file);
  database.word_bytes = file.word_bytes();
  if (database.header.shells == 0 && database.header.solids == 0 && database.header.thick_shells == 0)
    file.refuse(
        Status::unsupported_input, 31,
        "the model has neither shells nor solids, so no surface (beams are not read); give a run with a surface");
  refuse_gaps(database.family);
  database.geometry = read_geometry(file, database.header);
  database.layout = lay_out_state(file, database.header, database.geometry);
  database.states = index_states(database.family, database.word_bytes, database.geometry.end_word,
                                 database.layout.words, database.remark);
  if (!database.states.empty() && !database.header.has_positions)
    file.refuse(Status::unsupported_input, 20,
                "the states hold no node positions (IU = 0), so no deformation; write the run with "
                "*DATABASE_BINARY_D3PLOT of the structural solver");
  return database;
}

StateFile::StateFile(const Database& database) : family_(database.family), word_bytes_(database.word_bytes) {}

WordFile& StateFile::file_of(const StatePlace& place) {
  if (!file_ || place.file != open_) file_.emplace(family_[place.file], word_bytes_);
  open_ = place.file;
  return *file_;
}

void StateFile::read(const StatePlace& place, std::uint64_t start, std::span<float> into) {
  file_of(place).reals(place.word + start, into, "a state");
}

double StateFile::real(const StatePlace& place, std::uint64_t word) {
  return file_of(place).real(place.word + word, "a global value of a state");
}
}  // namespace lbea::io::d3plot
