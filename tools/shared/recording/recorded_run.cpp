#include "tools/shared/recording/recorded_run.hpp"

#include "tools/shared/text/formatted.hpp"

#include <algorithm>

namespace lbea::tool {
namespace {

using Kind = RecordedMessage::Kind;
constexpr std::size_t chunk_times_bytes = 2 * sizeof(std::uint64_t);
constexpr std::int64_t first_time = std::numeric_limits<std::int64_t>::min(),
                       last_time = std::numeric_limits<std::int64_t>::max();

std::int64_t time_of(std::uint64_t ns) {
  return static_cast<std::int64_t>(std::min<std::uint64_t>(ns, static_cast<std::uint64_t>(last_time)));
}

std::optional<std::uint64_t> hexadecimal_in(const mcap::Texts& texts, std::string_view key) {
  const auto found = texts.find(std::string(key));
  return found == texts.end() ? std::nullopt : parsed<std::uint64_t>(found->second, 16);
}

bool has_magic_at(const mcap::ByteSource& source, std::uint64_t offset) {
  std::array<std::byte, mcap::magic.size()> bytes{};
  source.read(offset, bytes);
  return std::ranges::equal(bytes, std::as_bytes(std::span(mcap::magic)));
}

}  // namespace

std::optional<RecordedChannel> channel_of(const mcap::Channel& channel) {
  if (channel.topic == results_topic) return RecordedChannel{Kind::result};
  if (channel.topic == state_topic) return RecordedChannel{Kind::state};
  if (channel.topic != frames_topic && !channel.topic.starts_with(std::string(frames_topic) + "/"))
    return RecordedChannel{};
  const auto session = hexadecimal_in(channel.metadata, session_key),
             id = hexadecimal_in(channel.metadata, id_high_key);
  if (!session || !id || *id >> 32 != 0) return std::nullopt;
  const auto rig = channel.metadata.find(std::string(rig_key));
  return RecordedChannel{Kind::frame, *session, *id, rig == channel.metadata.end() ? "" : rig->second};
}

RecordedMessage recorded_message(const mcap::Message& message, const RecordedChannel& channel) {
  RecordedMessage recorded{channel.kind, time_of(message.log_time), message.data};
  if (channel.kind != Kind::frame) return recorded;
  recorded.session = channel.session;
  recorded.id = channel.id_high << 32 | message.sequence;
  recorded.stamp_ns = time_of(message.publish_time);
  recorded.rig = channel.rig;
  return recorded;
}

RecordedRun::RecordedRun(const std::filesystem::path& file)
    : source_(file),
      reader_(source_, mcap::magic.size(), source_.size()),
      chunk_(source_.size()),
      from_ns_(first_time),
      to_ns_(last_time) {
  constexpr std::size_t magic_bytes = mcap::magic.size();
  if (source_.size() < magic_bytes || !has_magic_at(source_, 0))
    throw Error(Status::bad_input, source_.name() + ": not a recording (MCAP); check the name");
  if (source_.size() < 2 * magic_bytes || !has_magic_at(source_, source_.size() - magic_bytes))
    throw Error(Status::bad_input,
                source_.name() + ": the recording was cut off; repair it with lbea-inspect --recover");
  read_front();
}

void RecordedRun::read_front() {
  for (auto front = reader_.peek(0); front && front->opcode != mcap::Opcode::chunk; front = reader_.peek(0)) {
    if (front->opcode == mcap::Opcode::data_end) break;
    const auto record = reader_.next();
    if (record->opcode != mcap::Opcode::metadata) continue;
    const auto metadata = mcap::parse<mcap::Metadata>(record->content);
    if (metadata) read(*metadata, settings_, source_.name());
  }
  rewind();
}

void RecordedRun::limit(std::int64_t from_ns, std::int64_t to_ns) {
  from_ns_ = from_ns;
  to_ns_ = to_ns;
}

void RecordedRun::rewind() {
  reader_.go_to(mcap::magic.size());
  chunk_ = mcap::OpenChunk(source_.size());
  rest_ = {};
}

std::optional<RecordedMessage> RecordedRun::next() {
  while (true) {
    while (!rest_.empty()) {
      const auto record = mcap::next_record(rest_, offset_);
      if (!record) fail(chunk_offset_, "a chunk with damaged contents");
      if (auto message = decode(*record)) return message;
    }
    if (!next_chunk()) return std::nullopt;
  }
}

/// Opens the next chunk that may contain wanted messages and reads all definitions before it; false at the end of the
/// data.
bool RecordedRun::next_chunk() {
  while (true) {
    const std::uint64_t at = reader_.position();
    const auto front = reader_.peek(chunk_times_bytes);
    if (!front) fail(at, "no record starts here");
    if (front->opcode == mcap::Opcode::data_end) return false;
    if (front->opcode != mcap::Opcode::chunk) {
      const auto record = reader_.next();
      add_channel(*record);
      if (record->opcode == mcap::Opcode::message)
        fail(at, "messages outside chunks, which lbea does not write; see lbea-inspect --recover");
      continue;
    }
    mcap::ByteCursor times(front->content);
    const std::int64_t start = time_of(times.number<std::uint64_t>()), end = time_of(times.number<std::uint64_t>());
    const auto record = reader_.next();
    if (const auto damage = chunk_.open(record->content); damage != mcap::ChunkDamage::none)
      fail(at, "a damaged chunk: " + std::string(to_string(damage)));
    rest_ = chunk_.records();
    chunk_offset_ = at;
    offset_ = 0;
    if (end >= from_ns_ && start <= to_ns_) return true;
    while (const auto inner = mcap::next_record(rest_, offset_)) add_channel(*inner);
    rest_ = {};
  }
}

std::optional<RecordedMessage> RecordedRun::decode(const mcap::Record& record) {
  add_channel(record);
  if (record.opcode != mcap::Opcode::message) return std::nullopt;
  const auto message = mcap::parse<mcap::Message>(record.content);
  if (!message) fail(chunk_offset_, "a damaged message in a chunk");
  const auto channel = channels_.find(message->channel_id);
  if (channel == channels_.end()) fail(chunk_offset_, "a message on a channel that is not defined");
  RecordedMessage recorded = recorded_message(*message, channel->second);
  if (recorded.log_time_ns < from_ns_ || recorded.log_time_ns > to_ns_) return std::nullopt;
  return recorded;
}

void RecordedRun::add_channel(const mcap::Record& record) {
  if (record.opcode != mcap::Opcode::channel) return;
  const auto channel = mcap::parse<mcap::Channel>(record.content);
  const auto carried = channel ? channel_of(*channel) : std::nullopt;
  if (!carried) fail(chunk_offset_, "a frame channel without valid session and id_high");
  channels_[channel->id] = *carried;
}

void RecordedRun::fail(std::uint64_t byte, const std::string& what) const {
  throw Error(Status::bad_input, source_.name() + ": byte " + std::to_string(byte) + ": " + what +
                                     "; lbea-inspect lists the damage, and lbea-inspect --recover repairs the file");
}

}  // namespace lbea::tool
