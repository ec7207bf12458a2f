// Tables of numbers in an HDF5 file. Their sizes are checked before memory is allocated; libhdf5 prints nothing.
#pragma once

#include "adapters/files/atomic_file.hpp"

#include <lbea/lbea.hpp>

namespace lbea::io::hdf5 {
struct Shape {
  std::uint64_t rows = 0, columns = 1;
};

class File {
 public:
  /// Throws Error{file_not_found | bad_input}.
  explicit File(const std::filesystem::path& path);
  ~File();
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  /// Names in these functions are paths from the root: "VTKHDF/Points".
  [[nodiscard]] bool has(const std::string& name) const;
  [[nodiscard]] std::vector<std::string> names_in(const std::string& group) const;  // sorted; none without the group
  [[nodiscard]] std::string text_attribute(const std::string& group, const char* attribute) const;
  [[nodiscard]] std::uint64_t first_of_attribute(const std::string& group, const char* attribute) const;

  /// Datasets of integers or reals with one or two dimensions. Throw Error{bad_input | unsupported_input} for others.
  [[nodiscard]] Shape shape(const std::string& dataset) const;
  /// `rows` rows from `first`; refused when the dataset ends before.
  [[nodiscard]] std::vector<double> read(const std::string& dataset, std::uint64_t first, std::uint64_t rows) const;
  /// The same of counts and indices, below 2^53.
  [[nodiscard]] std::vector<std::uint64_t> read_counts(const std::string& dataset, std::uint64_t first,
                                                       std::uint64_t rows) const;

  [[noreturn]] void fail(const std::string& what, Status status = Status::bad_input) const;

 private:
  struct Dataset;
  [[nodiscard]] Dataset opened(const std::string& name) const;
  void check_storage(const Dataset& dataset, const std::string& name) const;

  InputFile input_;
  std::int64_t file_ = -1;
};
}  // namespace lbea::io::hdf5
