// Small files that claim much: time and memory follow the size of the file.
#include "tests/mcap/format/mcap_support.hpp"

#include "adapters/mcap/bytes.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <chrono>

using namespace lbea::mcap;
using namespace lbea::test;

namespace {

Buffer begun() {
  const Bytes start = std::as_bytes(std::span(magic));
  Buffer file(start.begin(), start.end());
  append(file, Header{"", "elsewhere"});
  return file;
}

void end(Buffer& file, std::uint64_t summary_start) {
  append(file, Footer{summary_start, 0, 0});
  const Bytes last = std::as_bytes(std::span(magic));
  file.insert(file.end(), last.begin(), last.end());
}

class CountingSource final : public ByteSource {
 public:
  explicit CountingSource(Bytes bytes) : source_(bytes) {}
  [[nodiscard]] std::uint64_t size() const noexcept override { return source_.size(); }
  void read(std::uint64_t offset, std::span<std::byte> into) const override {
    read_bytes += into.size();
    source_.read(offset, into);
  }
  [[nodiscard]] const std::string& name() const noexcept override { return source_.name(); }
  mutable std::uint64_t read_bytes = 0;

 private:
  MemorySource source_;
};

/// Many metadata records, and their index in the order of the file or reversed.
Buffer with_metadata(std::size_t count, bool is_reversed) {
  Buffer file = begun();
  std::vector<MetadataIndex> index;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = file.size();
    append(file, Metadata{"m", {}});
    index.push_back({at, file.size() - at, "m"});
  }
  append(file, DataEnd{});
  const std::size_t summary_start = file.size();
  if (is_reversed) std::ranges::reverse(index);
  for (const MetadataIndex& entry : index) append(file, entry);
  end(file, summary_start);
  return file;
}

double seconds_to_check(const Buffer& file) {
  double least = 1e300;
  for (int repetition = 0; repetition < 3; ++repetition) {
    const auto begin = std::chrono::steady_clock::now();
    CHECK(check_file(MemorySource(file)).is_intact());
    least = std::min(least, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  }
  return least;
}

}  // namespace

TEST_CASE("a few kilobytes that decompress to 100 MB are damage: 393 kB took 8.4 GB of memory and 42 s") {
  const Buffer zeros(100'000'000);
  const Bytes records = zeros;
  Buffer compressed;
  REQUIRE(compress(Compression::zstd, {&records, 1}, compressed));
  Buffer file = begun();
  append_chunk_head(file, Chunk{0, 0, zeros.size(), 0, "zstd", {}}, compressed.size());
  file.insert(file.end(), compressed.begin(), compressed.end());
  append(file, DataEnd{});
  end(file, 0);
  REQUIRE(file.size() < 30'000);
  const FileCheck check = check_file(MemorySource(file));
  REQUIRE(check.gaps.size() == 1);
  CHECK(check.gaps[0].what == "damaged chunk: too_large");
}

TEST_CASE("nested headers of chunks are not all followed to the end of the file: 2 MB took seconds") {
  constexpr std::size_t head_bytes = 49, count = 20'000, most_read_per_byte = 200;
  Buffer file = begun();
  file.push_back(std::byte{0});  // no record: the search begins
  const std::size_t last = file.size() + count * head_bytes + 64;
  while (file.size() + head_bytes <= last - 64) {
    const std::size_t records = last - file.size() - head_bytes;
    append_chunk_head(file, Chunk{0, 0, records, 1, "", {}}, records);
  }
  file.resize(last);
  const CountingSource source(file);
  CHECK_FALSE(check_file(source).is_intact());
  CHECK(source.read_bytes < most_read_per_byte * file.size());
}

TEST_CASE("the order of an index does not change the time of the check: a reversed one took quadratic time") {
  constexpr std::size_t count = 10'000;
  CHECK(seconds_to_check(with_metadata(count, true)) < 8 * seconds_to_check(with_metadata(count, false)));
}
