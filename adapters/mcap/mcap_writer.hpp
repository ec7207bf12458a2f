// Writes an MCAP file: header, chunks with their message indexes, metadata, and at the end a summary that makes it
// seekable. Nothing is remembered of what the sink did not take.
#pragma once

#include "adapters/mcap/compression.hpp"
#include "adapters/mcap/record_walk.hpp"
#include "adapters/mcap/sink.hpp"

namespace lbea::mcap {

class Writer {
 public:
  explicit Writer(Sink& sink, Compression compression = Compression::none);

  // Each returns 0 or the sink's error number, and throws std::bad_alloc before anything is written. After either
  // the next call may succeed: the file stays sound.
  [[nodiscard]] int begin(const Header& header);
  /// Records that make up one chunk together, one piece after the other: schemas, channels and messages, each
  /// whole within its piece.
  [[nodiscard]] int chunk(std::span<const Bytes> pieces);
  /// A chunk from another file, compressed as it is there; `records` are what it holds.
  [[nodiscard]] int chunk_as_is(Chunk chunk, Bytes records);
  [[nodiscard]] int define(const Schema& schema);
  [[nodiscard]] int define(const Channel& channel);
  [[nodiscard]] int metadata(const Metadata& metadata);
  [[nodiscard]] int attachment(const Attachment& attachment);
  /// The end of the data and the summary. Nothing may follow.
  [[nodiscard]] int finish();

  [[nodiscard]] const Definitions& definitions() const noexcept { return definitions_; }
  [[nodiscard]] const Statistics& statistics() const noexcept { return statistics_; }
  [[nodiscard]] std::uint64_t size() const noexcept { return size_; }

 private:
  /// What a chunk's records turn out to be.
  struct Contents {
    std::map<std::uint16_t, MessageIndex> index;
    Definitions defined;
    std::map<std::uint16_t, std::uint64_t> messages_by_channel;
    std::uint64_t start_time = 0, end_time = 0, messages = 0;
  };
  static Contents survey(std::span<const Bytes> pieces);
  /// Pieces of one record, with their checksum where that costs less than reading them again.
  struct Stored {
    Bytes head;
    std::span<const Bytes> records;
    std::uint64_t records_bytes = 0;
    std::uint32_t records_crc = 0;
  };
  int append_chunk(const Stored& stored, const Chunk& chunk, Contents& contents);
  int append(std::span<const Bytes> pieces, std::uint32_t crc);
  int append_buffer();
  void remember(Contents& contents) noexcept;

  Sink& sink_;
  Compression compression_;
  std::uint64_t size_ = 0;
  std::uint32_t crc_ = 0;  // of all so far
  Definitions definitions_;
  Statistics statistics_;
  std::vector<ChunkIndex> chunks_;
  std::vector<MetadataIndex> metadata_;
  std::vector<AttachmentIndex> attachments_;
  Buffer buffer_, head_, index_;
};

}  // namespace lbea::mcap
