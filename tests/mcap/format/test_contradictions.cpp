// Contradictions that no checksum detects: summaries, definitions, records within chunks, files that change while they
// are read.
#include "tests/mcap/format/mcap_support.hpp"
#include "tests/support/files.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

#include "adapters/mcap/bytes.hpp"
#include "adapters/mcap/salvage.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>

using namespace lbea;
using namespace lbea::mcap;
using namespace lbea::test;

namespace {

/// The decoded footer and the offset of the summary's checksum.
struct Ending {
  Footer footer;
  std::size_t checksum_at = 0;
};

Ending ending_of(Bytes file) {
  const std::size_t at = file.size() - magic.size() - 20;
  return {*parse<Footer>(file.subspan(at, 20)), at + 16};
}

/// Magic bytes, header, and `records` as a chunk, valid or not.
Buffer file_with_chunk(Bytes records) {
  Buffer file;
  const Bytes start = std::as_bytes(std::span(magic));
  file.assign(start.begin(), start.end());
  append(file, Header{"", "elsewhere"});
  append_chunk_head(file, Chunk{1, 2, records.size(), 0, "", {}}, records.size());
  file.insert(file.end(), records.begin(), records.end());
  return file;
}

std::string errors_of(Bytes file) {
  std::string all;
  for (const std::string& error : check_file(MemorySource(file)).errors) all += error + "\n";
  return all;
}

}  // namespace

TEST_CASE("a summary without checksum is compared with the data: any changed byte is detected") {
  MemorySink sink;
  Writer writer(sink);
  REQUIRE(writer.begin({"p", "l"}) == 0);
  for (const char* name : {"one", "two"}) {
    REQUIRE(writer.attachment({1, 2, name, "text/plain", std::as_bytes(std::span("abc", 3)), 0}) == 0);
    REQUIRE(writer.metadata({name, {{"a", "b"}}}) == 0);
  }
  for (const std::uint16_t id : both_channels) {
    REQUIRE(writer.define(a_schema(id)) == 0);
    REQUIRE(writer.define(a_channel(id, id)) == 0);
  }
  const auto messages = some_messages(8);
  for (std::size_t i = 0; i < messages.size(); i += 4) {
    const Buffer records = records_of(std::span(messages).subspan(i, 4));
    const Bytes piece = records;
    REQUIRE(writer.chunk({&piece, 1}) == 0);
  }
  REQUIRE(writer.finish() == 0);
  Buffer file = sink.bytes;
  const Ending ending = ending_of(file);
  std::memset(&file[ending.checksum_at], 0, 4);  // "not computed"
  REQUIRE(check_file(MemorySource(file)).is_intact());
  const Buffer sound = file;
  const std::size_t begin = ending.footer.summary_start;
  Bytes rest = Bytes(sound).subspan(begin, ending.footer.summary_offset_start - begin);
  std::uint64_t offset = 0;
  std::size_t records = 0;
  while (const auto record = next_record(rest, offset)) {
    ++records;
    for (std::size_t at = begin + record->offset + record_prefix_bytes; at < begin + record->end(); ++at) {
      CAPTURE(static_cast<int>(record->opcode));
      CAPTURE(at);
      file[at] ^= std::byte{1};
      CHECK_FALSE(check_file(MemorySource(file)).is_intact());
      file[at] ^= std::byte{1};
    }
  }
  CHECK(records == 2 + 2 + 1 + 2 + 2 + 2);  // schemas, channels, statistics, and an index entry for each of the rest
  for (std::size_t at = ending.checksum_at - 16; at < ending.checksum_at;
       ++at) {                                   // where it begins, where its offsets do
    if (at == ending.checksum_at - 8) continue;  // still within the summary
    file[at] ^= std::byte{0x80};
    CHECK(contains(errors_of(file), "footer points to the wrong place"));
    file[at] ^= std::byte{0x80};
  }
}

TEST_CASE("an incomplete index is detected, whatever is missing") {
  MemorySink sink;
  REQUIRE(write_file(sink, some_messages(8), 4) == 0);
  const Ending ending = ending_of(sink.bytes);
  const auto without = [&](Opcode left_out) {  // the first record of this kind
    Buffer file(sink.bytes.begin(), sink.bytes.begin() + static_cast<std::ptrdiff_t>(ending.footer.summary_start));
    Bytes rest =
        Bytes(sink.bytes)
            .subspan(ending.footer.summary_start, ending.footer.summary_offset_start - ending.footer.summary_start);
    std::uint64_t offset = 0;
    bool is_gone = false;
    while (true) {
      const Bytes before = rest;
      const auto record = next_record(rest, offset);
      if (!record) break;
      if (std::exchange(is_gone, is_gone || record->opcode == left_out) == is_gone)
        file.insert(file.end(), before.begin(), before.end() - static_cast<std::ptrdiff_t>(rest.size()));
    }
    append(file, Footer{ending.footer.summary_start, 0, 0});
    const Bytes end = std::as_bytes(std::span(magic));
    file.insert(file.end(), end.begin(), end.end());
    return errors_of(file);
  };
  CHECK(contains(without(Opcode::chunk_index), "an index without some of the chunks"));
  CHECK(without(Opcode::header).empty());  // nothing removed
}

TEST_CASE("different definitions with one id and incomplete records in a chunk are damage") {
  Buffer records;
  append(records, a_channel(1, 0));
  append(records, a_channel(1, 0));  // an equal repetition is not
  CHECK_FALSE(contains(errors_of(file_with_chunk(records)), "differs"));
  Channel other = a_channel(1, 0);
  other.topic = "/elsewhere";
  Buffer file = file_with_chunk(records);
  append(file, other);
  CHECK(contains(errors_of(file), "a schema or channel differs from the one with the same id"));
  append(file, Schema{3, "a", "b", {}});
  append(file, Schema{3, "a", "c", {}});
  CHECK(contains(errors_of(file), "differs"));

  append(records, to_message(some_messages(1)[0]));
  CHECK(are_whole(records));
  for (std::size_t size = 1; size < records.size(); ++size) {
    const Bytes cut = Bytes(records).first(size);
    CAPTURE(size);
    if (!are_whole(cut)) CHECK_FALSE(check_file(MemorySource(file_with_chunk(cut))).gaps.empty());
  }
  const Buffer short_message{std::byte{0x05},
                             std::byte{4},
                             {},
                             {},
                             {},
                             {},
                             {},
                             {},
                             {},
                             {},
                             {},
                             {},
                             {}};  // four bytes are too short for a message
  CHECK_FALSE(are_whole(short_message));
  CHECK_FALSE(check_file(MemorySource(file_with_chunk(short_message))).gaps.empty());
}

TEST_CASE("recovery omits messages on undefined channels and counts them") {
  Buffer records;
  append(records, a_schema(1));
  append(records, a_channel(1, 1));
  append(records, a_channel(2, 9));  // its schema is not defined
  const auto messages = some_messages(6);
  for (const Said& message : messages) append(records, to_message(message));
  MemorySink sink;
  const Recovery done = recover(MemorySource(file_with_chunk(records)), sink);
  CHECK(done.messages == 3);
  CHECK(done.undefined_messages == 3);
  CHECK(check_file(MemorySource(sink.bytes)).is_intact());

  Buffer loose;  // outside chunks, and more than fit in one new chunk
  const Bytes start = std::as_bytes(std::span(magic));
  loose.assign(start.begin(), start.end());
  append(loose, Header{"", ""});
  append(loose, a_channel(1, 0));
  const std::string large(400'000, 'x');
  for (std::uint32_t i = 0; i < 5; ++i) append(loose, to_message({1, i, i, i, large}));
  MemorySink rebuilt;
  CHECK(recover(MemorySource(loose), rebuilt).messages == 5);
  CHECK(check_file(MemorySource(rebuilt.bytes)).counted.chunks == 2);
}

TEST_CASE("files that are missing, not regular, or become shorter cause a clear error") {
  const TemporaryFolder folder;
  const auto error = [](const std::filesystem::path& path) { return error_of([&] { const FileSource source(path); }); };
  check_error(error(folder / "absent"), Status::file_not_found, {"no file", "absent"});
  check_error(error(put(folder / "file", "x") / "below"), Status::file_not_found, {"no file"});
  check_error(error(folder.path()), Status::bad_input, {"not a regular file"});
  check_error(error("/" + std::string(5000, 'x')), Status::bad_input, {"cannot read"});
  const FileSource source(put(folder / "short", "0123456789"));
  std::filesystem::resize_file(folder / "short", 4);
  std::vector<std::byte> into(8);
  check_error(error_of([&] { source.read(0, into); }), Status::bad_input, {"byte 4", "became shorter"});
}

TEST_CASE("compressed data of another size than claimed, or followed by other bytes, are rejected") {
  const std::string text(5000, 'a');
  const Bytes piece = std::as_bytes(std::span(text));
  for (const Compression compression : {Compression::lz4, Compression::zstd}) {
    Buffer packed, out;
    REQUIRE(compress(compression, {&piece, 1}, packed));
    CHECK(decompress(compression, packed, text.size(), out));
    for (const std::uint64_t wrong :
         {std::uint64_t{0}, std::uint64_t{4999}, std::uint64_t{5001}, std::uint64_t{1} << 40})
      CHECK_FALSE(decompress(compression, packed, wrong, out));
    for (std::size_t size = 0; size < packed.size(); ++size)
      CHECK_FALSE(decompress(compression, Bytes(packed).first(size), text.size(), out));
    packed.push_back(std::byte{});
    CHECK_FALSE(decompress(compression, packed, text.size(), out));
  }
}
