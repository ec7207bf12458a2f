// What can be read of a file that may be cut or damaged: every record of its data that is whole, in order.
#pragma once

#include "adapters/mcap/record_walk.hpp"

namespace lbea::mcap {

/// Bytes that are no record, or one that is damaged.
struct Gap {
  std::uint64_t begin = 0, end = 0;
  std::string what;
};

/// Walks the data section. In an intact file it shows each record and no gap. Chunks are shown when their checksum
/// is right and their contents are whole records; behind damage it goes on at the next sound chunk or metadata.
class SalvageWalk {
 public:
  /// The source outlives the walk.
  explicit SalvageWalk(const ByteSource& source);
  /// The next sound record; nothing after the last. Its content, and chunk(), are valid until the next call.
  [[nodiscard]] std::optional<Record> next();
  /// Of the chunk record that next() returned.
  [[nodiscard]] const OpenChunk& chunk() const noexcept { return chunk_; }

  [[nodiscard]] const std::vector<Gap>& gaps() const noexcept { return gaps_; }
  [[nodiscard]] bool starts_with_magic() const noexcept { return starts_with_magic_; }
  /// Whether the data's own end was found; then position() is where a summary or the footer begins.
  [[nodiscard]] bool reached_data_end() const noexcept { return reached_data_end_; }
  [[nodiscard]] std::uint64_t position() const noexcept { return walk_.position(); }

 private:
  std::string flaw_of(const Record& record);
  [[nodiscard]] bool is_data_end(const Record& record) const;
  [[nodiscard]] bool may_begin_record(std::uint64_t at) const;
  void resume_after(std::uint64_t begin, std::string what);
  std::uint64_t find_anchor(std::uint64_t from);
  bool is_anchor(std::uint64_t at);

  const ByteSource& source_;
  FileWalk walk_;
  OpenChunk chunk_;
  std::vector<Gap> gaps_;
  bool starts_with_magic_ = false, reached_data_end_ = false;
};

}  // namespace lbea::mcap
