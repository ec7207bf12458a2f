// Recordings in memory, disks that fail on demand, and the messages that a reader finds.
#pragma once

#include "adapters/mcap/salvage.hpp"
#include "adapters/mcap/writer.hpp"

#include <cerrno>
#include <string>
#include <vector>

namespace lbea::test {

using namespace lbea::mcap;

/// Stores appended bytes. Call number `fail_at` fails, counting append, sync and commit together from 1. With
/// `persists` all later calls fail too.
class MemorySink final : public mcap::Sink {
 public:
  int append(std::span<const mcap::Bytes> pieces) noexcept override {
    if (fails()) return ENOSPC;
    for (const mcap::Bytes piece : pieces) bytes.insert(bytes.end(), piece.begin(), piece.end());
    ends.push_back(bytes.size());
    return 0;
  }
  int sync() noexcept override { return fails() ? EIO : 0; }
  int commit() noexcept override {
    if (fails()) return EIO;
    committed = true;
    return 0;
  }

  mcap::Buffer bytes;
  std::vector<std::size_t> ends;  // of each append
  bool committed = false, persists = false;
  std::size_t fail_at = 0, calls = 0;

 private:
  bool fails() noexcept {
    ++calls;
    return fail_at != 0 && (calls == fail_at || (persists && calls > fail_at));
  }
};

/// A message that owns its data.
struct Said {
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time = 0, publish_time = 0;
  std::string data;
  friend bool operator==(const Said&, const Said&) = default;
};

inline Said said(const mcap::Message& message) {
  return {message.channel_id, message.sequence, message.log_time, message.publish_time,
          std::string(reinterpret_cast<const char*>(message.data.data()), message.data.size())};
}

inline mcap::Message to_message(const Said& said) {
  return {said.channel, said.sequence, said.log_time, said.publish_time, std::as_bytes(std::span(said.data))};
}

inline constexpr std::array<std::uint16_t, 2> both_channels{1, 2};
inline mcap::Schema a_schema(std::uint16_t id) {
  return {id, "schema " + std::to_string(id), "flatbuffer", mcap::Buffer(id, std::byte{7})};
}
inline mcap::Channel a_channel(std::uint16_t id, std::uint16_t schema) {
  return {id, schema, "/topic" + std::to_string(id), "flatbuffer", {{"session", "00ff"}, {"", "empty key"}}};
}

/// `count` messages on channels 1 and 2 with unordered times and data of different small sizes.
inline std::vector<Said> some_messages(std::size_t count) {
  std::vector<Said> messages;
  for (std::size_t i = 0; i < count; ++i)
    messages.push_back({static_cast<std::uint16_t>(1 + i % 2), static_cast<std::uint32_t>(i),
                        1'000 + 10 * i - 15 * (i % 3), 7 * i,
                        std::string(i * 13 % 101, static_cast<char>('a' + i % 26))});
  return messages;
}

/// The records of one chunk.
inline mcap::Buffer records_of(std::span<const Said> messages) {
  mcap::Buffer records;
  for (const Said& message : messages) mcap::append(records, to_message(message));
  return records;
}

/// Definitions and `messages`, `per_chunk` per chunk, after metadata.
inline int write_file(mcap::Sink& sink, std::span<const Said> messages, std::size_t per_chunk,
                      mcap::Compression compression = mcap::Compression::none) {
  mcap::Writer writer(sink, compression);
  int error = writer.begin({"a profile", "a library"});
  if (error == 0) error = writer.metadata({"about", {{"key", "value"}, {"other", ""}}});
  mcap::Buffer definitions;
  for (const std::uint16_t id : both_channels) {
    mcap::append(definitions, a_schema(id));
    mcap::append(definitions, a_channel(id, id));
  }
  for (std::size_t i = 0; i < messages.size() && error == 0; i += per_chunk) {
    const mcap::Buffer records = records_of(messages.subspan(i, std::min(per_chunk, messages.size() - i)));
    const std::array<mcap::Bytes, 2> pieces{definitions, records};
    error = writer.chunk(pieces);
  }
  if (error == 0) error = writer.finish();
  return error == 0 ? sink.commit() : error;
}

struct Heard {
  mcap::FileCheck audit;
  std::vector<Said> messages;
};

inline Heard hear(mcap::Bytes file) {
  Heard heard;
  const mcap::MemorySource source(file);
  heard.audit = mcap::check_file(
      source, [&](const mcap::Message& message, const mcap::Channel*) { heard.messages.push_back(said(message)); });
  return heard;
}

}  // namespace lbea::test
