// Files cut or damaged at any byte: every whole chunk is recovered, and the new file is sound.
#include "tests/mcap/format/mcap_support.hpp"

#include "adapters/mcap/salvage.hpp"

#include <lbea/lbea.hpp>

#include <doctest/doctest.h>

#include <algorithm>

using namespace lbea;
using namespace lbea::mcap;
using namespace lbea::test;

namespace {

constexpr std::size_t per_chunk = 3;

/// The messages of the chunks outside [begin, end).
std::vector<Said> outside(const MemorySink& sink, std::span<const Said> messages, std::size_t begin, std::size_t end) {
  std::vector<Said> expected;
  const MemorySource source(sink.bytes);
  FileReader reader(source, magic.size(), sink.bytes.size() - magic.size());
  std::size_t next = 0;
  while (const auto record = reader.next()) {
    if (record->opcode != Opcode::chunk) continue;
    const auto its = messages.subspan(next, std::min(per_chunk, messages.size() - next));
    if (record->end() <= begin || record->offset >= end) expected.insert(expected.end(), its.begin(), its.end());
    next += its.size();
  }
  return expected;
}

std::vector<Said> before(const MemorySink& sink, std::span<const Said> messages, std::size_t size) {
  return outside(sink, messages, size, sink.bytes.size());
}

/// Whether all of `part` is in `all`, in this order.
bool is_within(std::span<const Said> part, std::span<const Said> all) {
  auto at = all.begin();
  for (const Said& message : part) {
    at = std::find(at, all.end(), message);
    if (at == all.end()) return false;
  }
  return true;
}

/// The result of recovering `file`; checks that it is a sound file.
Heard recovered(Bytes file) {
  const MemorySource source(file);
  MemorySink sink;
  recover(source, sink);
  CHECK(sink.committed);
  Heard heard = hear(sink.bytes);
  for (const std::string& error : heard.audit.errors) CHECK_MESSAGE(false, error);
  CHECK(heard.audit.is_intact());
  CHECK(heard.audit.has_summary);
  return heard;
}

/// The position of the first record of this kind.
std::size_t position_of(Bytes file, Opcode opcode) {
  const MemorySource source(file);
  FileReader reader(source, magic.size(), file.size());
  while (const auto record = reader.next())
    if (record->opcode == opcode) return static_cast<std::size_t>(record->offset);
  return file.size();
}

}  // namespace

TEST_CASE("cut at every byte: every complete chunk is recovered") {
  for (const Compression compression : {Compression::none, Compression::lz4, Compression::zstd}) {
    const auto messages = some_messages(14);
    MemorySink sink;
    REQUIRE(write_file(sink, messages, per_chunk, compression) == 0);
    const std::size_t first_record_end = position_of(sink.bytes, Opcode::metadata);
    for (std::size_t size = 0; size <= sink.bytes.size(); ++size) {
      CAPTURE(size);
      const Bytes cut = Bytes(sink.bytes).first(size);
      if (size < first_record_end) {
        MemorySink nothing;
        const MemorySource source(cut);
        CHECK_THROWS_AS(recover(source, nothing), Error);
        continue;
      }
      CHECK(recovered(cut).messages == before(sink, messages, size));
    }
  }
}

TEST_CASE("a damaged byte loses at most the chunk that contains it") {
  const auto messages = some_messages(15);
  MemorySink sink;
  REQUIRE(write_file(sink, messages, per_chunk) == 0);
  const Buffer sound = sink.bytes;
  for (std::size_t byte = 0; byte < sound.size(); ++byte)
    for (const unsigned flip : {0x01u, 0x80u, 0xffu}) {
      CAPTURE(byte);
      CAPTURE(flip);
      sink.bytes[byte] ^= static_cast<std::byte>(flip);
      const Heard heard = recovered(sink.bytes);
      sink.bytes[byte] = sound[byte];
      CHECK(heard.messages.size() + per_chunk >= messages.size());
      CHECK(is_within(heard.messages, messages));
      CHECK(is_within(outside(sink, messages, byte, byte + 1), heard.messages));
    }
}

TEST_CASE("after zeroing any range, the chunks outside it are recovered") {
  const auto messages = some_messages(15);
  MemorySink sink;
  REQUIRE(write_file(sink, messages, per_chunk) == 0);
  for (std::size_t begin = 0; begin < sink.bytes.size(); begin += 13) {
    CAPTURE(begin);
    Buffer damaged = sink.bytes;
    const std::size_t end = std::min(damaged.size(), begin + 200);
    std::fill(damaged.begin() + static_cast<std::ptrdiff_t>(begin), damaged.begin() + static_cast<std::ptrdiff_t>(end),
              std::byte{});
    const Heard heard = recovered(damaged);
    CHECK(is_within(heard.messages, messages));
    CHECK(is_within(outside(sink, messages, begin, end), heard.messages));
  }
}

TEST_CASE("a sound file is recovered with the same messages, metadata and attachments") {
  MemorySink sink;
  Writer writer(sink);
  REQUIRE(writer.begin({"p", "l"}) == 0);
  REQUIRE(writer.attachment({1, 2, "name", "text/plain", std::as_bytes(std::span("abc", 3)), 0}) == 0);
  REQUIRE(writer.define(a_channel(5, 0)) == 0);
  REQUIRE(writer.metadata({"m", {{"a", "b"}}}) == 0);
  REQUIRE(writer.finish() == 0);
  CHECK(hear(sink.bytes).audit.is_intact());
  const Heard heard = recovered(sink.bytes);
  CHECK(heard.audit.counted.attachments == 1);
  CHECK(heard.audit.metadata.at(0).texts.at("a") == "b");
  CHECK(heard.audit.header.profile == "p");
}

// Regression: a recording that had lost a chunk without frames was complete after its recovery.
TEST_CASE("what says that the file is complete is not recovered with a part of the file") {
  const auto names = [](Bytes file) {
    const MemorySource source(file);
    MemorySink fixed;
    recover(source, fixed, "closed");
    std::vector<std::string> found;
    for (const Metadata& one : hear(fixed.bytes).audit.metadata) found.push_back(one.name);
    return found;
  };
  MemorySink closed;
  Writer writer(closed);
  REQUIRE(writer.begin({"p", "l"}) == 0);
  REQUIRE(writer.metadata({"opened", {}}) == 0);
  const std::size_t end_of_opened = closed.bytes.size();
  REQUIRE(writer.metadata({"lost", {}}) == 0);
  REQUIRE(writer.metadata({"closed", {}}) == 0);
  REQUIRE(writer.finish() == 0);
  CHECK(names(closed.bytes) == std::vector<std::string>{"opened", "lost", "closed"});
  closed.bytes[end_of_opened + 1] = std::byte{0xff};  // the record's length
  CHECK(names(closed.bytes) == std::vector<std::string>{"opened"});
}

TEST_CASE("messages outside chunks are recovered too, and those on unknown channels counted") {
  Buffer file;
  const Bytes start = std::as_bytes(std::span(magic));
  file.assign(start.begin(), start.end());
  append(file, Header{"", "elsewhere"});
  append(file, a_channel(1, 0));
  const auto messages = some_messages(6);  // on channels 1 and 2; channel 2 is not defined
  for (const Said& message : messages) append(file, to_message(message));
  const MemorySource source(file);
  MemorySink sink;
  const Recovery done = recover(source, sink);
  CHECK(done.messages == 3);
  CHECK(done.undefined_messages == 3);
  CHECK_FALSE(done.was_closed);
  CHECK(done.gaps.empty());
  CHECK(hear(sink.bytes).audit.is_intact());
  CHECK(hear(sink.bytes).messages == std::vector<Said>{messages[0], messages[2], messages[4]});
}

TEST_CASE("a chunk whose definitions were lost is read with definitions from elsewhere") {
  const auto messages = some_messages(6);
  MemorySink sink;
  Writer writer(sink);
  REQUIRE(writer.begin({"", ""}) == 0);
  const Buffer alone = records_of(std::span(messages).first(3));
  const Bytes first = alone;
  REQUIRE(writer.chunk({&first, 1}) == 0);
  Buffer defined;
  for (const std::uint16_t id : both_channels) append(defined, a_channel(id, 0));
  const Buffer more = records_of(std::span(messages).subspan(3));
  defined.insert(defined.end(), more.begin(), more.end());
  const Bytes second = defined;
  REQUIRE(writer.chunk({&second, 1}) == 0);
  REQUIRE(writer.finish() == 0);
  CHECK_FALSE(hear(sink.bytes).audit.is_intact());
  CHECK(recovered(sink.bytes).messages == messages);
}

TEST_CASE("whichever write of the new file fails, the error is reported and nothing is committed") {
  MemorySink sink;
  REQUIRE(write_file(sink, some_messages(10), per_chunk) == 0);
  const MemorySource source(sink.bytes);
  std::size_t n = 1;
  for (; n < 100; ++n) {
    MemorySink failing;
    failing.fail_at = n;
    bool failed = false;
    try {
      recover(source, failing);
    } catch (const Error& error) { failed = error.status == Status::write_failed; }
    if (!failed) break;
    CHECK_FALSE(failing.committed);
  }
  CHECK(n > 5);
  CHECK(n < 100);
}

TEST_CASE("a file without any MCAP record causes a clear error") {
  for (const std::size_t size : {0u, 1u, 8u, 9u, 100'000u}) {
    const Buffer zeroes(size);
    const MemorySource source(zeroes, "some.file");
    MemorySink sink;
    try {
      recover(source, sink);
      CHECK(false);
    } catch (const Error& error) {
      CHECK(error.status == Status::bad_input);
      CHECK(std::string(error.what()).starts_with("some.file: "));
    }
  }
}
