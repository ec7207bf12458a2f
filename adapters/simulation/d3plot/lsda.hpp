// LSDA, the container of LS-DYNA's binout files: variables in directories, in the order in which they were written.
#pragma once

#include "adapters/simulation/d3plot/words.hpp"

namespace lbea::io::d3plot {

/// Where a variable's numbers are.
struct LsdaVariable {
  std::string directory, name;  // directory: from the root, "/glstat/d000001"
  binary::Scalar type{};
  std::uint64_t byte = 0, count = 0;
};

class LsdaFile {
 public:
  /// Reads the places of all variables by the records of the data, not by the symbol tables, which an interrupted run
  /// lacks; a last record that is cut short is left out.
  /// Throws Error{file_not_found | bad_input | unsupported_input} that names file and byte.
  explicit LsdaFile(std::filesystem::path path);

  [[nodiscard]] const std::filesystem::path& path() const noexcept { return file_.path(); }
  [[nodiscard]] const std::vector<LsdaVariable>& variables() const noexcept { return variables_; }
  /// All numbers, or the one at `place`. Throws Error{bad_input} if the file has become shorter.
  [[nodiscard]] std::vector<double> read(const LsdaVariable& variable) const;
  [[nodiscard]] double read(const LsdaVariable& variable, std::uint64_t place) const;

 private:
  struct Record {
    std::uint64_t byte = 0, bytes = 0, command = 0, content = 0;  // content: its first byte after the command
    [[nodiscard]] std::uint64_t end() const noexcept { return byte + bytes; }
  };
  void read_header();
  [[nodiscard]] std::optional<Record> record_at(std::uint64_t byte) const;
  void add_variable(const Record& record, const std::string& directory);
  [[nodiscard]] std::uint64_t unsigned_at(std::uint64_t byte, std::uint64_t bytes) const;
  [[nodiscard]] std::string text_at(std::uint64_t byte, std::uint64_t bytes) const;

  WordFile file_;
  std::uint64_t header_bytes_ = 0, length_bytes_ = 0, command_bytes_ = 0, type_bytes_ = 0;
  std::vector<LsdaVariable> variables_;
};

}  // namespace lbea::io::d3plot
