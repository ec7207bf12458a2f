#include "adapters/mcap/salvage.hpp"

#include <lbea/lbea.hpp>

#include <set>
#include <system_error>

namespace lbea::mcap {
namespace {
constexpr std::size_t new_chunk_bytes = std::size_t{1} << 20;

/// All definitions in the readable part. The first one with an id is used.
Definitions find_definitions(const ByteSource& source) {
  Definitions found;
  SalvageReader reader(source);
  while (const auto record = reader.next()) {
    static_cast<void>(found.add(*record));
    if (record->opcode != Opcode::chunk) continue;
    Bytes rest = reader.chunk().records();
    std::uint64_t offset = 0;
    while (const auto inner = next_record(rest, offset)) static_cast<void>(found.add(*inner));
  }
  return found;
}

/// Not without a name.
bool is_metadata(const Record& record, std::string_view name) {
  return !name.empty() && record.opcode == Opcode::metadata && parse<Metadata>(record.content)->name == name;
}

class Rebuilder {
 public:
  Rebuilder(Sink& sink, Definitions known, const std::string& source_name)
      : writer_(sink), known_(std::move(known)), source_name_(source_name) {}

  void begin(const Header& header) { check(writer_.begin(header)); }
  void copy(const Record& record, const OpenChunk& chunk) {
    // Definitions are written before their first message, and indexes are new.
    if (record.opcode == Opcode::chunk) copy_chunk(chunk);
    if (record.opcode == Opcode::message) copy_message(*parse<Message>(record.content));
    if (record.opcode == Opcode::metadata) copy_metadata(record);
    if (record.opcode == Opcode::attachment) copy_attachment(record);
  }
  Recovery finish(Sink& sink) {
    flush();
    check(writer_.finish());
    check(sink.commit());
    done.chunks = writer_.statistics().chunks;
    done.messages = writer_.statistics().messages;
    return done;
  }
  Recovery done;

 private:
  void check(int error) const {
    if (error != 0)
      throw Error(Status::write_failed, "the records recovered from " + source_name_ +
                                            " cannot be written: " + std::generic_category().message(error) +
                                            "; check the folder and the free space");
  }
  void copy_chunk(const OpenChunk& chunk) {
    flush();
    bool whole = true;
    each_message(chunk.records(), [&](const Message& message) { whole = define(message.channel_id) && whole; });
    if (whole) return check(writer_.chunk_as_is(chunk.chunk(), chunk.records()));
    each_message(chunk.records(), [&](const Message& message) { copy_message(message); });
    flush();
  }
  template <class Visit>
  static void each_message(Bytes records, Visit visit) {
    std::uint64_t offset = 0;
    while (const auto inner = next_record(records, offset))
      if (inner->opcode == Opcode::message) visit(*parse<Message>(inner->content));
  }
  void copy_message(const Message& message) {
    if (!define(message.channel_id)) {
      ++done.undefined_messages;
      return;
    }
    append(waiting_, message);
    if (waiting_.size() >= new_chunk_bytes) flush();
  }
  void flush() {
    if (waiting_.empty()) return;
    const Bytes piece = waiting_;
    check(writer_.chunk({&piece, 1}));
    waiting_.clear();
  }
  /// Writes the channel and its schema before the first message on it; false when they are not known.
  bool define(std::uint16_t channel_id) {
    if (defined_.contains(channel_id)) return true;
    const auto channel = known_.channels.find(channel_id);
    if (channel == known_.channels.end()) return false;
    const auto schema = known_.schemas.find(channel->second.schema_id);
    if (channel->second.schema_id != 0 && schema == known_.schemas.end()) return false;
    if (channel->second.schema_id != 0 && schemas_.insert(schema->first).second) check(writer_.define(schema->second));
    check(writer_.define(channel->second));
    return defined_.insert(channel_id).second;
  }
  void copy_metadata(const Record& record) {
    flush();
    check(writer_.metadata(*parse<Metadata>(record.content)));
    ++done.metadata;
  }
  void copy_attachment(const Record& record) {
    flush();
    check(writer_.attachment(*parse<Attachment>(record.content)));
    ++done.attachments;
  }

  Writer writer_;
  Definitions known_;
  std::string source_name_;
  std::set<std::uint16_t> defined_, schemas_;
  Buffer waiting_;
};
}  // namespace

std::uint64_t Recovery::lost_bytes() const noexcept {
  std::uint64_t sum = 0;
  for (const Gap& gap : gaps) sum += gap.end - gap.begin;
  return sum;
}

Recovery recover(const ByteSource& source, Sink& sink, std::string_view closing) {
  SalvageReader reader(source);
  auto record = reader.next();
  if (!record)
    throw Error(Status::bad_input,
                source.name() + ": no part of this file can be read as MCAP; there is nothing to recover");
  Rebuilder rebuilder(sink, find_definitions(source), source.name());
  const bool has_header = record->opcode == Opcode::header;
  rebuilder.begin(has_header ? *parse<Header>(record->content) : Header{"", "lbea recovery"});
  for (; record; record = reader.next())
    if (reader.gaps().empty() || !is_metadata(*record, closing)) rebuilder.copy(*record, reader.chunk());
  rebuilder.done.gaps = reader.gaps();
  rebuilder.done.was_closed = reader.reached_data_end();
  return rebuilder.finish(sink);
}
}  // namespace lbea::mcap
