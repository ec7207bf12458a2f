// A d3plot file as an array of 4- or 8-byte words, with random access.
#pragma once

#include "adapters/files/binary_numbers.hpp"

#include <lbea/lbea.hpp>

#include <optional>

namespace lbea::io::d3plot {
using binary::plus;
using binary::times;

/// One file of a database, with little-endian words.
class WordFile {
 public:
  /// Throws Error{file_not_found | bad_input}.
  explicit WordFile(std::filesystem::path path, std::uint64_t word_bytes = 4);
  ~WordFile();
  WordFile(const WordFile&) = delete;
  WordFile& operator=(const WordFile&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
  [[nodiscard]] std::uint64_t bytes() const noexcept { return bytes_; }
  [[nodiscard]] std::uint64_t words() const noexcept { return bytes_ / word_bytes_; }
  [[nodiscard]] std::uint64_t word_bytes() const noexcept { return word_bytes_; }
  void set_word_bytes(std::uint64_t word_bytes) noexcept { word_bytes_ = word_bytes; }

  /// Each throws Error{bad_input} that names the block `what` when the file ends before it does.
  void require(std::uint64_t word, std::uint64_t count, const std::string& what) const;
  void read(std::uint64_t byte, std::span<std::byte> into, const std::string& what) const;
  [[nodiscard]] std::vector<std::int64_t> integers(std::uint64_t word, std::uint64_t count,
                                                   const std::string& what) const;
  void reals(std::uint64_t word, std::span<float> into, const std::string& what) const;
  [[nodiscard]] double real(std::uint64_t word, const std::string& what) const;
  /// The next word at or after `word` that may differ from zero: the holes of sparse files are skipped.
  [[nodiscard]] std::uint64_t next_data(std::uint64_t word) const noexcept;
  /// Whether all bytes from `word` to the end are zero.
  [[nodiscard]] bool is_zero_from(std::uint64_t word) const;

  /// Throws Error with the message "<path>, byte <byte of word>: <sentence>".
  [[noreturn]] void refuse(Status status, std::uint64_t word, const std::string& sentence) const;

  /// The same with Error{bad_input} and the advice to copy or compute the damaged file again.
  [[noreturn]] void refuse_damaged(std::uint64_t word, const std::string& sentence) const;

 private:
  template <typename Word, typename Out>
  void convert(std::uint64_t word, std::span<Out> into, const std::string& what) const;

  std::filesystem::path path_;
  int descriptor_ = -1;
  std::uint64_t bytes_ = 0;
  std::uint64_t word_bytes_ = 4;
};

/// The real after the last state of a file.
inline constexpr double end_marker = -999999.0;

inline constexpr std::uint64_t base_words = 64;  // number of control words that every database has
inline constexpr std::uint64_t file_type_word = 11, dimensions_word = 15;
inline constexpr std::int64_t type_d3plot = 1, type_d3part = 5, type_d3eigv = 11;
inline constexpr std::int64_t wide_ids = 1000;  // added to the file type when ids take 8 bytes

struct Encoding {
  std::uint64_t word_bytes;
  bool is_big_endian;
};

/// Word size and byte order, from two control words with known values. Nothing when the file does not begin like the
/// first file of a d3plot database.
[[nodiscard]] std::optional<Encoding> detect_encoding(const WordFile& file);
}  // namespace lbea::io::d3plot
