// Histories of binout, which LS-DYNA writes beside d3plot at more times: those of glstat, matsum and rwforc.
#pragma once

#include "adapters/simulation/d3plot/lsda.hpp"
#include "precompute/simulation.hpp"

#include <deque>

namespace lbea::io::d3plot {

class Binout {
 public:
  /// The files beside `d3plot`: binout, or binout0000, binout0001 ... of several processes, each perhaps continued in
  /// binout0000%001 ...; with the prefix that its name has. Without any there are no histories.
  /// Throws Error{bad_input | unsupported_input} that names file and byte, also for files of several runs.
  explicit Binout(const std::filesystem::path& d3plot);

  [[nodiscard]] std::vector<std::filesystem::path> files() const;
  /// "glstat.kinetic_energy", "matsum.internal_energy" of each part, "rwforc.x_force" of each wall, and others that all
  /// states of their database have.
  [[nodiscard]] const std::vector<bake::SimulationHistory>& histories() const noexcept { return histories_; }
  [[nodiscard]] std::size_t numbers() const noexcept { return numbers_.size(); }  // of all histories
  /// place: among all numbers of histories(). After a restart, the states that it computed again count.
  /// Throws Error{bad_input} that names file and state.
  [[nodiscard]] const bake::HistorySeries& series(std::uint32_t place);

 private:
  struct Variable {
    std::uint32_t file = 0, name = 0;  // places in files_ and names_
    LsdaNumbers numbers;
  };
  struct Database {
    std::optional<std::uint64_t> process;  // that wrote it
    std::vector<Variable> variables;       // state by state, in the order of the files
    std::vector<std::size_t> begins;       // of the states
    std::string directory;                 // of the last state
    std::optional<Variable> ids;
    [[nodiscard]] std::size_t states() const noexcept { return begins.size(); }
    [[nodiscard]] std::span<const Variable> state(std::size_t place) const noexcept {
      const std::size_t end = place + 1 < begins.size() ? begins[place + 1] : variables.size();
      return std::span(variables).subspan(begins[place], end - begins[place]);
    }
    [[nodiscard]] const Variable* find(std::size_t state, std::uint32_t name) const noexcept;
  };
  struct Number {
    std::size_t database = 0;
    std::uint32_t name = 0;
    std::uint64_t place = 0;
  };
  void add(std::uint64_t process, const std::string& directory, const std::string& name, const LsdaNumbers& numbers);
  void list_histories(std::size_t database);
  [[nodiscard]] std::uint32_t number_of(const std::string& name);
  [[nodiscard]] std::vector<std::uint32_t> ids_of(const Database& database) const;
  [[nodiscard]] double read(const Variable& variable, std::uint64_t place) const;

  std::deque<LsdaFile> files_;
  std::vector<std::filesystem::path> paths_;  // of the files, also of the one that is being read
  std::vector<std::string> names_;            // of variables
  std::vector<Database> databases_;
  std::vector<bake::SimulationHistory> histories_;
  std::vector<Number> numbers_;
  std::optional<std::uint32_t> read_place_;
  bake::HistorySeries read_;  // of that place
};

}  // namespace lbea::io::d3plot
