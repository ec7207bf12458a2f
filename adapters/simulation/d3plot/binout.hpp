// Histories of binout, which LS-DYNA writes beside d3plot at more times: those of glstat, matsum and rwforc.
#pragma once

#include "adapters/simulation/d3plot/lsda.hpp"
#include "precompute/simulation.hpp"

#include <deque>
#include <map>

namespace lbea::io::d3plot {

class Binout {
 public:
  /// The files beside `d3plot`: binout or binout0000, binout0001 ..., of large runs also binout0000%001; with the
  /// prefix that its name has. Without any there are no histories. Throws Error{bad_input | unsupported_input} that
  /// names file and byte.
  explicit Binout(const std::filesystem::path& d3plot);

  [[nodiscard]] std::vector<std::filesystem::path> files() const;
  /// "glstat.kinetic_energy", "matsum.internal_energy" of each part, "rwforc.x_force" of each wall, and others that all
  /// states of their database have.
  [[nodiscard]] const std::vector<bake::SimulationHistory>& histories() const noexcept { return histories_; }
  [[nodiscard]] std::size_t numbers() const noexcept { return numbers_.size(); }  // of all histories
  /// place: among all numbers of histories(). Throws Error{bad_input} if the times do not increase.
  [[nodiscard]] const bake::HistorySeries& series(std::uint32_t place);
  /// Linear between the series' times. Throws Error{bad_input} if it ends earlier.
  [[nodiscard]] double value(std::uint32_t place, double time);

 private:
  struct Stored {
    std::size_t file = 0;
    LsdaVariable variable;
  };
  using State = std::map<std::string, Stored, std::less<>>;  // by the variables' names
  struct Database {
    std::string name;           // "glstat"
    std::vector<State> states;  // in the order of the files
    std::optional<Stored> ids;
  };
  struct Number {
    std::size_t database = 0;
    std::string variable;
    std::uint64_t place = 0;
  };
  void add(std::size_t file, const LsdaVariable& variable);
  void list_histories(std::size_t database);
  [[nodiscard]] std::vector<std::uint32_t> ids_of(const Database& database) const;
  [[nodiscard]] double read(const Stored& stored, std::uint64_t place) const;

  std::deque<LsdaFile> files_;
  std::vector<Database> databases_;
  std::map<std::string, std::size_t, std::less<>> state_of_;  // by directory: place in its database's states
  std::vector<bake::SimulationHistory> histories_;
  std::vector<Number> numbers_;
  std::uint32_t read_place_ = std::numeric_limits<std::uint32_t>::max();
  bake::HistorySeries read_;  // of that place
};

}  // namespace lbea::io::d3plot
