// LSDA, the container of LS-DYNA's binout files: variables in directories, in the order in which they were written.
#pragma once

#include "adapters/simulation/d3plot/words.hpp"

#include <functional>

namespace lbea::io::d3plot {

/// Where a variable's numbers are.
struct LsdaNumbers {
  binary::Scalar type{};
  std::uint64_t byte = 0, count = 0;
};

class LsdaFile {
 public:
  /// Of a variable; directory: from the root, "/glstat/d000001".
  using Visit = std::function<void(const std::string& directory, const std::string& name, const LsdaNumbers& numbers)>;

  /// Calls `visit` for every variable of a known type, by the records of the data, not by the symbol tables, which an
  /// interrupted run lacks; a last record that is cut short is left out.
  /// Throws Error{file_not_found | bad_input | unsupported_input} that names file and byte.
  LsdaFile(std::filesystem::path path, const Visit& visit);

  [[nodiscard]] const std::filesystem::path& path() const noexcept { return file_.path(); }
  /// All of them. Throws Error{bad_input} if the file has become shorter.
  [[nodiscard]] std::vector<double> read(const LsdaNumbers& numbers) const;

 private:
  struct Record {
    std::uint64_t byte = 0, bytes = 0, command = 0, content = 0;  // content: its first byte after the command
    [[nodiscard]] std::uint64_t end() const noexcept { return byte + bytes; }
  };
  void read_header();
  [[nodiscard]] std::optional<Record> record_at(std::uint64_t byte);
  void change(std::string& directory, const Record& record);
  void visit_variable(const Record& record, const std::string& directory, const Visit& visit);
  [[nodiscard]] const std::byte* bytes_at(std::uint64_t byte, std::uint64_t bytes);
  [[nodiscard]] std::uint64_t unsigned_at(std::uint64_t byte, std::uint64_t bytes);
  [[nodiscard]] std::string text_at(std::uint64_t byte, std::uint64_t bytes);

  WordFile file_;
  std::uint64_t header_bytes_ = 0, length_bytes_ = 0, command_bytes_ = 0, type_bytes_ = 0;
  std::vector<std::byte> buffer_;  // of the file, from buffered_at_ on
  std::uint64_t buffered_at_ = 0;
};

}  // namespace lbea::io::d3plot
