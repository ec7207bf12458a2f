// Writes an MCAP file: header, chunks with their message indexes, metadata, and a summary that makes it seekable. What
// the sink failed to write is not part of the indexes and statistics.
#pragma once

#include "adapters/mcap/bytes.hpp"
#include "adapters/mcap/reader.hpp"
#include "adapters/mcap/sink.hpp"

namespace lbea::mcap {
class Writer {
 public:
  explicit Writer(Sink& sink, Compression compression = Compression::none);

  // Each function returns 0 or the sink's error number, and throws std::bad_alloc before anything is written. The file
  // stays sound after either failure, and the next call may succeed.
  [[nodiscard]] int begin(const Header& header);
  /// Writes one chunk. `pieces` contain its records in order: schemas, channels and messages, each in one piece.
  [[nodiscard]] int chunk(std::span<const Bytes> pieces);
  /// Copies a chunk of another file without changing its compression; `records` are its decompressed records.
  [[nodiscard]] int chunk_as_is(Chunk chunk, Bytes records);
  [[nodiscard]] int define(const Schema& schema);
  [[nodiscard]] int define(const Channel& channel);
  [[nodiscard]] int metadata(const Metadata& metadata);
  [[nodiscard]] int attachment(const Attachment& attachment);
  /// Writes the end of the data and the summary. No call may follow.
  [[nodiscard]] int finish();

  [[nodiscard]] const Definitions& definitions() const noexcept { return definitions_; }
  [[nodiscard]] const Statistics& statistics() const noexcept { return statistics_; }
  [[nodiscard]] std::uint64_t size() const noexcept { return size_; }

 private:
  /// What the records of a chunk contain.
  struct Contents {
    std::map<std::uint16_t, MessageIndex> index;
    Definitions defined;
    Statistics counted;  // messages
  };
  static Contents survey(std::span<const Bytes> pieces);
  /// One chunk record in pieces, with the checksum of its records, which is known before.
  struct Stored {
    Bytes head;
    std::span<const Bytes> records;
    std::uint64_t records_bytes = 0;
    std::uint32_t records_crc = 0;
  };
  int append_chunk(const Stored& stored, const Chunk& chunk, Contents& contents);
  int append(std::span<const Bytes> pieces, std::uint32_t crc);
  int append_buffer();
  int append_record(const auto& record);
  void add_to_summary(Contents& contents) noexcept;

  Sink& sink_;
  Compression compression_;
  std::uint64_t size_ = 0;
  std::uint32_t crc_ = 0;  // of all bytes so far
  Definitions definitions_;
  Statistics statistics_;
  std::vector<ChunkIndex> chunks_;
  std::vector<MetadataIndex> metadata_;
  std::vector<AttachmentIndex> attachments_;
  Buffer buffer_, head_, index_;
};
}  // namespace lbea::mcap
