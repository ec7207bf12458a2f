// Reads all whole records of the data section of a file that may be cut or damaged.
#pragma once

#include "adapters/mcap/reader.hpp"

namespace lbea::mcap {

/// Bytes that are not a record or a damaged one.
struct Gap {
  std::uint64_t begin = 0, end = 0;
  std::string what;
};

/// Reads the data section. In an intact file it returns every record and finds no gap. A chunk is returned when its
/// checksum is right and it contains whole records. After damage, reading continues at the next sound chunk or metadata
/// record.
class SalvageReader {
 public:
  /// The source must outlive the reader.
  explicit SalvageReader(const ByteSource& source);
  /// The next sound record; nothing after the last. Its content and chunk() are valid until the next call.
  [[nodiscard]] std::optional<Record> next();
  /// The chunk that next() returned last.
  [[nodiscard]] const OpenChunk& chunk() const noexcept { return chunk_; }

  [[nodiscard]] const std::vector<Gap>& gaps() const noexcept { return gaps_; }
  [[nodiscard]] bool starts_with_magic() const noexcept { return starts_with_magic_; }
  /// Whether the record that ends the data was found. Then position() is the offset of the summary or footer.
  [[nodiscard]] bool reached_data_end() const noexcept { return reached_data_end_; }
  [[nodiscard]] std::uint64_t position() const noexcept { return reader_.position(); }

 private:
  std::string flaw_of(const Record& record);
  [[nodiscard]] bool is_data_end(const Record& record) const;
  [[nodiscard]] bool may_begin_record(std::uint64_t at) const;
  void resume_after(std::uint64_t begin, std::string what);
  std::uint64_t find_anchor(std::uint64_t from);
  bool is_anchor(std::uint64_t at);

  const ByteSource& source_;
  std::uint64_t search_budget_;  // bytes that is_anchor() may still read
  FileReader reader_;
  OpenChunk chunk_;
  std::vector<Gap> gaps_;
  bool starts_with_magic_ = false, reached_data_end_ = false;
};

}  // namespace lbea::mcap
