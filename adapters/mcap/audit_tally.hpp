// What an audit has counted so far, for audit.cpp and audit_summary.cpp.
#pragma once

#include "adapters/mcap/audit.hpp"

namespace lbea::mcap {

class AuditTally {
 public:
  AuditTally(Audit& audit, const MessageVisitor& visit) : audit_(audit), visit_(visit) {}
  void complain(std::uint64_t byte, const std::string& what);
  /// Any record of the data section.
  void take(const Record& record, const OpenChunk& chunk);
  [[nodiscard]] const std::vector<ChunkIndex>& chunks() const noexcept { return chunks_; }
  [[nodiscard]] const std::vector<MetadataIndex>& metadata() const noexcept { return metadata_; }
  [[nodiscard]] const std::vector<AttachmentIndex>& attachments() const noexcept { return attachments_; }
  [[nodiscard]] const Audit& audit() const noexcept { return audit_; }

 private:
  void take_simple(const Record& record);
  void take_message(const Record& record, std::uint64_t offset, bool in_chunk);
  void take_chunk(const Record& record, const OpenChunk& chunk);
  void take_index(const Record& record);
  void take_attachment(const Record& record);
  Audit& audit_;
  const MessageVisitor& visit_;
  std::map<std::uint16_t, MessageIndex> expected_;  // of the last chunk
  std::vector<ChunkIndex> chunks_;
  std::vector<MetadataIndex> metadata_;
  std::vector<AttachmentIndex> attachments_;
};

/// Footer and summary, from the end of the data on.
void audit_summary(const ByteSource& source, std::uint64_t data_end, AuditTally& tally, Audit& audit);

}  // namespace lbea::mcap
