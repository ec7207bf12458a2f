// The writer writes exactly what it is given, and its file stays sound, whichever write fails.
#include "tests/mcap/format/mcap_support.hpp"

#include "adapters/mcap/bytes.hpp"

#include <doctest/doctest.h>

using namespace lbea;
using namespace lbea::mcap;
using namespace lbea::test;

namespace {
constexpr std::array all_compressions{Compression::none, Compression::lz4, Compression::zstd};
}

TEST_CASE("messages are read back for every count, chunk size and compression") {
  for (const Compression compression : all_compressions)
    for (const std::size_t count : {0u, 1u, 2u, 3u, 100u})
      for (const std::size_t per_chunk : {1u, 2u, 7u, 1000u}) {
        CAPTURE(name_of(compression));
        CAPTURE(count);
        CAPTURE(per_chunk);
        const auto messages = some_messages(count);
        MemorySink sink;
        REQUIRE(write_file(sink, messages, per_chunk, compression) == 0);
        const Heard heard = hear(sink.bytes);
        for (const std::string& error : heard.audit.errors) CHECK_MESSAGE(false, error);
        CHECK(heard.audit.is_intact());
        CHECK(heard.audit.has_summary);
        CHECK(heard.messages == messages);
        CHECK(heard.audit.counted.chunks == (count + per_chunk - 1) / per_chunk);
        CHECK(heard.audit.header.library == "a library");
        REQUIRE(heard.audit.metadata.size() == 1);
        CHECK(heard.audit.metadata[0].texts.at("key") == "value");
        if (count > 0) CHECK(heard.audit.definitions.channels.at(2) == a_channel(2, 2));
      }
}

TEST_CASE("compressible and incompressible data of any size are restored; wrong sizes and damage are rejected") {
  for (const Compression compression : {Compression::lz4, Compression::zstd})
    for (const std::size_t bytes : {0u, 1u, 65'535u, 65'536u, 65'537u, 3'000'000u})
      for (const bool random : {false, true}) {
        CAPTURE(name_of(compression));
        CAPTURE(bytes);
        Buffer data(bytes);
        std::uint32_t state = 1;
        for (std::byte& byte : data)
          byte = static_cast<std::byte>(random ? (state = state * 1664525u + 1013904223u) >> 24 : 3);
        const std::array<Bytes, 2> pieces{Bytes(data).first(bytes / 3), Bytes(data).subspan(bytes / 3)};
        Buffer packed, unpacked;
        REQUIRE(compress(compression, pieces, packed));
        CHECK(decompress(compression, packed, bytes, unpacked));
        CHECK(unpacked == data);
        CHECK_FALSE(decompress(compression, packed, bytes + 1, unpacked));
        CHECK_FALSE(decompress(compression, Bytes(packed).first(packed.size() - 1), bytes, unpacked));
        if (bytes > 0) CHECK_FALSE(decompress(compression, packed, bytes - 1, unpacked));
        packed.push_back(std::byte{0});
        CHECK_FALSE(decompress(compression, packed, bytes, unpacked));
      }
}

TEST_CASE("memory is not allocated for a claimed size without data") {
  Buffer packed, unpacked;
  const Buffer data(100);
  const Bytes piece = data;
  REQUIRE(compress(Compression::zstd, {&piece, 1}, packed));
  CHECK_FALSE(decompress(Compression::zstd, packed, std::uint64_t{1} << 62, unpacked));
  CHECK(unpacked.capacity() <= 1 << 17);
}

TEST_CASE("the checksum of joined pieces is that of the whole") {
  Buffer data(1000);
  for (std::size_t i = 0; i < data.size(); ++i) data[i] = static_cast<std::byte>(i * i);
  const Bytes all = data;
  CHECK(crc32(std::as_bytes(std::span("123456789", 9))) == 0xcbf43926);  // the check value of CRC-32
  for (const std::size_t cut : {0u, 1u, 500u, 999u, 1000u}) {
    CHECK(crc32(all.subspan(cut), crc32(all.first(cut))) == crc32(all));
    CHECK(crc32_joined(crc32(all.first(cut)), crc32(all.subspan(cut)), all.size() - cut) == crc32(all));
  }
}

// Ten times slower under the address sanitizer, which sees one bit of every byte. The release build checks all.
#ifdef __SANITIZE_ADDRESS__
constexpr unsigned flipped_bits = 1;
#else
constexpr unsigned flipped_bits = 8;
#endif

TEST_CASE("any flipped bit is detected") {
  for (const Compression compression : all_compressions) {
    CAPTURE(name_of(compression));
    MemorySink sink;
    REQUIRE(write_file(sink, some_messages(9), 4, compression) == 0);
    for (std::size_t byte = 0; byte < sink.bytes.size(); ++byte)
      for (unsigned i = 0; i < flipped_bits; ++i) {
        const unsigned bit = (byte + i) % 8;
        sink.bytes[byte] ^= static_cast<std::byte>(1u << bit);
        if (hear(sink.bytes).audit.is_intact()) {
          CAPTURE(byte);
          CAPTURE(bit);
          CHECK(false);
        }
        sink.bytes[byte] ^= static_cast<std::byte>(1u << bit);
      }
    CHECK(hear(sink.bytes).audit.is_intact());
  }
}

TEST_CASE("a file cut at any byte is not intact") {
  MemorySink sink;
  REQUIRE(write_file(sink, some_messages(20), 4) == 0);
  for (std::size_t size = 0; size < sink.bytes.size(); ++size)
    CHECK_FALSE(hear(Bytes(sink.bytes).first(size)).audit.is_intact());
}

TEST_CASE("whichever write fails once, the file stays sound without it") {
  const auto messages = some_messages(30);
  MemorySink whole;
  REQUIRE(write_file(whole, messages, 3) == 0);
  for (std::size_t n = 1; n <= whole.calls; ++n) {
    CAPTURE(n);
    MemorySink sink;
    sink.fail_at = n;
    Writer writer(sink);
    int begun = writer.begin({"", ""});
    if (begun != 0) begun = writer.begin({"", ""});
    REQUIRE(begun == 0);
    static_cast<void>(writer.metadata({"about", {}}));
    std::vector<Said> kept;
    for (std::size_t i = 0; i < messages.size(); i += 3) {
      Buffer records;
      if (writer.definitions().channels.size() < 2)
        for (const std::uint16_t id : both_channels) append(records, a_channel(id, 0));
      const auto three = std::span(messages).subspan(i, 3);
      const Buffer more = records_of(three);
      records.insert(records.end(), more.begin(), more.end());
      const Bytes piece = records;
      if (writer.chunk({&piece, 1}) == 0) kept.insert(kept.end(), three.begin(), three.end());
    }
    int finished = writer.finish();
    if (finished != 0) finished = writer.finish();
    CHECK(finished == 0);
    const Heard heard = hear(sink.bytes);
    for (const std::string& error : heard.audit.errors) CHECK_MESSAGE(false, error);
    CHECK(heard.audit.is_intact());
    CHECK(heard.messages == kept);
    CHECK(kept.size() + 3 >= messages.size());
  }
}
