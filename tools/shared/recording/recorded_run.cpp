#include "tools/shared/recording/recorded_run.hpp"

#include "tools/shared/recording/topics.hpp"

#include <algorithm>
#include <charconv>
#include <limits>

namespace lbea::tool {
namespace {

using Kind = RecordedMessage::Kind;
constexpr std::size_t chunk_times_bytes = 2 * sizeof(std::uint64_t);
constexpr std::int64_t first_time = std::numeric_limits<std::int64_t>::min(),
                       last_time = std::numeric_limits<std::int64_t>::max();

std::int64_t time_of(std::uint64_t ns) {
  return static_cast<std::int64_t>(std::min<std::uint64_t>(ns, static_cast<std::uint64_t>(last_time)));
}

bool read_hexadecimal(const mcap::Texts& texts, std::string_view key, std::uint64_t& into) {
  const auto found = texts.find(std::string(key));
  if (found == texts.end()) return false;
  const std::string& text = found->second;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), into, 16);
  return error == std::errc() && end == text.data() + text.size();
}

bool ends_with_magic(const mcap::ByteSource& source) {
  std::array<std::byte, mcap::magic.size()> bytes{};
  if (source.size() < 2 * bytes.size()) return false;
  source.read(source.size() - bytes.size(), bytes);
  return std::ranges::equal(bytes, std::as_bytes(std::span(mcap::magic)));
}

bool begins_with_magic(const mcap::ByteSource& source) {
  std::array<std::byte, mcap::magic.size()> bytes{};
  if (source.size() < bytes.size()) return false;
  source.read(0, bytes);
  return std::ranges::equal(bytes, std::as_bytes(std::span(mcap::magic)));
}

}  // namespace

std::optional<RecordedChannel> channel_of(const mcap::Channel& channel) {
  if (channel.topic == results_topic) return RecordedChannel{Kind::result};
  if (channel.topic == state_topic) return RecordedChannel{Kind::state};
  if (channel.topic != frames_topic) return RecordedChannel{};
  RecordedChannel frames{Kind::frame};
  const bool good = read_hexadecimal(channel.metadata, session_key, frames.session) &&
                    read_hexadecimal(channel.metadata, id_high_key, frames.id_high) && frames.id_high >> 32 == 0;
  if (!good) return std::nullopt;
  return frames;
}

RecordedMessage recorded_message(const mcap::Message& message, const RecordedChannel& channel) {
  RecordedMessage recorded{channel.kind, time_of(message.log_time), message.data};
  if (channel.kind != Kind::frame) return recorded;
  recorded.session = channel.session;
  recorded.id = channel.id_high << 32 | message.sequence;
  recorded.stamp_ns = time_of(message.publish_time);
  return recorded;
}

RecordedRun::RecordedRun(const std::filesystem::path& file)
    : source_(file), walk_(source_, mcap::magic.size(), source_.size()), from_ns_(first_time), to_ns_(last_time) {
  if (!begins_with_magic(source_))
    throw Error(Status::bad_input, source_.name() + ": not a recording (MCAP); check the name");
  if (!ends_with_magic(source_))
    throw Error(Status::bad_input,
                source_.name() + ": the recording was cut off; make a whole one of it with lbea-inspect --recover");
  read_front();
}

void RecordedRun::read_front() {
  for (auto front = walk_.peek(0); front && front->opcode != mcap::Opcode::chunk; front = walk_.peek(0)) {
    if (front->opcode == mcap::Opcode::data_end) break;
    const auto record = walk_.next();
    if (record->opcode != mcap::Opcode::metadata) continue;
    const auto metadata = mcap::parse<mcap::Metadata>(record->content);
    if (metadata && metadata->name == settings_metadata_name) settings_ = settings_from(*metadata, source_.name());
  }
  rewind();
}

void RecordedRun::limit(std::int64_t from_ns, std::int64_t to_ns) {
  from_ns_ = from_ns;
  to_ns_ = to_ns;
}

void RecordedRun::rewind() {
  walk_.go_to(mcap::magic.size());
  rest_ = {};
}

std::optional<RecordedMessage> RecordedRun::next() {
  while (true) {
    while (!rest_.empty()) {
      const auto record = mcap::next_record(rest_, offset_);
      if (!record) fail(chunk_offset_, "a chunk with damaged contents");
      if (auto message = take(*record)) return message;
    }
    if (!next_chunk()) return std::nullopt;
  }
}

/// Opens the next chunk that may hold something; false at the end of the data. Definitions and messages outside
/// chunks are taken in passing.
bool RecordedRun::next_chunk() {
  while (true) {
    const std::uint64_t at = walk_.position();
    const auto front = walk_.peek(chunk_times_bytes);
    if (!front) fail(at, "no record begins here");
    if (front->opcode == mcap::Opcode::data_end) return false;
    if (front->opcode != mcap::Opcode::chunk) {
      const auto record = walk_.next();
      take_channel(*record);
      if (record->opcode == mcap::Opcode::message)
        fail(at, "messages outside chunks, which lbea does not write; see lbea-inspect --recover");
      continue;
    }
    mcap::ByteCursor times(front->content);
    const std::int64_t start = time_of(times.number<std::uint64_t>()), end = time_of(times.number<std::uint64_t>());
    const auto record = walk_.next();
    if (const auto damage = chunk_.open(record->content); damage != mcap::ChunkDamage::none)
      fail(at, "a damaged chunk: " + std::string(to_string(damage)));
    rest_ = chunk_.records();
    chunk_offset_ = at;
    offset_ = 0;
    if (end >= from_ns_ && start <= to_ns_) return true;
    while (const auto inner = mcap::next_record(rest_, offset_)) take_channel(*inner);
    rest_ = {};
  }
}

std::optional<RecordedMessage> RecordedRun::take(const mcap::Record& record) {
  take_channel(record);
  if (record.opcode != mcap::Opcode::message) return std::nullopt;
  const auto message = mcap::parse<mcap::Message>(record.content);
  if (!message) fail(chunk_offset_, "a damaged message in a chunk");
  const auto channel = channels_.find(message->channel_id);
  if (channel == channels_.end()) fail(chunk_offset_, "a message on a channel that is not defined");
  RecordedMessage recorded = recorded_message(*message, channel->second);
  if (recorded.log_time_ns < from_ns_ || recorded.log_time_ns > to_ns_) return std::nullopt;
  return recorded;
}

void RecordedRun::take_channel(const mcap::Record& record) {
  if (record.opcode != mcap::Opcode::channel) return;
  const auto channel = mcap::parse<mcap::Channel>(record.content);
  const auto carried = channel ? channel_of(*channel) : std::nullopt;
  if (!carried) fail(chunk_offset_, "a channel of frames without session and id_high");
  channels_[channel->id] = *carried;
}

void RecordedRun::fail(std::uint64_t byte, const std::string& what) const {
  throw Error(Status::bad_input, source_.name() + ": byte " + std::to_string(byte) + ": " + what +
                                     "; lbea-inspect says what is whole, and --recover makes a new file of it");
}

}  // namespace lbea::tool
