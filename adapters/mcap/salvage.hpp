// Reads, checks and recovers files that may be cut or damaged.
#pragma once

#include "adapters/mcap/reader.hpp"
#include "adapters/mcap/writer.hpp"

#include <functional>

namespace lbea::mcap {
/// Bytes that are not a record or a damaged one.
struct Gap {
  std::uint64_t begin = 0, end = 0;
  std::string what;
};

/// Reads all whole records of the data section. In an intact file it returns every record and finds no gap. A chunk is
/// returned when its checksum is right and it contains whole records. After damage, reading continues at the next sound
/// chunk or metadata record.
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

/// What check_file() found: every byte is read, and every record is compared with the others that describe it.
struct FileCheck {
  std::uint64_t bytes = 0;
  Header header;
  bool is_mcap = false;      // starts with the magic bytes
  bool is_closed = false;    // ends with a footer and the magic bytes
  bool has_summary = false;  // with indexes
  std::vector<Gap> gaps;
  std::vector<std::string> errors;  // each with its byte offset; at most max_errors
  Definitions definitions;
  Statistics counted;  // from the data, independent of the file's own statistics
  std::vector<Metadata> metadata;

  static constexpr std::size_t max_errors = 20;
  /// Closed, no damaged byte, and no contradiction between records.
  [[nodiscard]] bool is_intact() const noexcept { return is_mcap && is_closed && gaps.empty() && errors.empty(); }
};

/// `channel` is null for a message whose channel is not defined before it.
using MessageVisitor = std::function<void(const Message& message, const Channel* channel)>;

/// Throws Error{bad_input} only when the system cannot read the file.
[[nodiscard]] FileCheck check_file(const ByteSource& source, const MessageVisitor& visit = {});

struct Recovery {
  std::uint64_t chunks = 0, messages = 0, attachments = 0, metadata = 0;
  std::uint64_t undefined_messages = 0;  // omitted: their channel is not defined anywhere
  bool was_closed = false;               // the record that ends the data was found
  std::vector<Gap> gaps;                 // unreadable bytes
  [[nodiscard]] std::uint64_t lost_bytes() const noexcept;
};

/// Writes the readable part of a file to a new one with an index. Copies every sound chunk unchanged, compressed or
/// not, and writes messages outside chunks to new chunks. `closing`: name of metadata that say that the file is
/// complete; left out if bytes before them could not be read. Writes to `sink` and commits it. Throws Error{bad_input}
/// when `source` cannot be read or contains no MCAP record, and Error{write_failed}.
Recovery recover(const ByteSource& source, Sink& sink, std::string_view closing = {});
}  // namespace lbea::mcap
