#include "adapters/simulation/d3plot/words.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace lbea::io::d3plot {
namespace {
constexpr std::size_t chunk_bytes = 1 << 18;

std::int64_t integer_at(std::span<const std::byte> bytes, std::uint64_t word, Encoding encoding) {
  const std::size_t size = encoding.word_bytes;
  const std::uint64_t bits = binary::load_bits(bytes.data() + word * size, size, encoding.is_big_endian);
  return size == 8 ? static_cast<std::int64_t>(bits) : static_cast<std::int32_t>(bits);
}
}  // namespace

static_assert(std::endian::native == std::endian::little, "words are read in their memory layout");

WordFile::WordFile(std::filesystem::path path, std::uint64_t word_bytes)
    : path_(std::move(path)), word_bytes_(word_bytes) {
  struct stat status {};
  // stat before open, which would wait for the writer of a fifo
  if (::stat(path_.c_str(), &status) != 0)
    throw Error{Status::file_not_found, path_.string() + ": " + std::strerror(errno) + "; check the path"};
  if (!S_ISREG(status.st_mode))
    throw Error{Status::bad_input, path_.string() + " is not a regular file; give the first file of a run"};
  descriptor_ = ::open(path_.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor_ < 0)
    throw Error{Status::file_not_found, path_.string() + ": " + std::strerror(errno) + "; check its permissions"};
  bytes_ = static_cast<std::uint64_t>(status.st_size);
}

WordFile::~WordFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void WordFile::refuse(Status status, std::uint64_t word, const std::string& sentence) const {
  throw Error{status, path_.string() + ", byte " + std::to_string(times(word, word_bytes_)) + ": " + sentence};
}

void WordFile::refuse_damaged(std::uint64_t word, const std::string& sentence) const {
  refuse(Status::bad_input, word, sentence + "; the file is damaged, copy or compute it again");
}

void WordFile::require(std::uint64_t word, std::uint64_t count, const std::string& what) const {
  if (plus(word, count) > words())
    refuse(Status::bad_input, word,
           what + " needs " + std::to_string(times(count, word_bytes_)) + " bytes, but the file ends at byte " +
               std::to_string(bytes_) + "; the file was cut short or is damaged, copy or compute it again");
}

void WordFile::read(std::uint64_t byte, std::span<std::byte> into, const std::string& what) const {
  while (!into.empty()) {
    const ::ssize_t got = ::pread(descriptor_, into.data(), into.size(), static_cast<::off_t>(byte));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0)
      throw Error{Status::bad_input, path_.string() + ", byte " + std::to_string(byte) + ": " + what +
                                         (got < 0 ? std::string(" cannot be read: ") + std::strerror(errno)
                                                  : std::string(" is missing, the file ends here")) +
                                         "; copy or compute the file again"};
    byte += static_cast<std::uint64_t>(got);
    into = into.subspan(static_cast<std::size_t>(got));
  }
}

template <typename Word, typename Out>
void WordFile::convert(std::uint64_t word, std::span<Out> into, const std::string& what) const {
  std::vector<Word> chunk(std::min(into.size(), chunk_bytes / sizeof(Word)));
  for (std::size_t done = 0; done < into.size();) {
    const std::span<Word> part = std::span(chunk).first(std::min(chunk.size(), into.size() - done));
    read((word + done) * sizeof(Word), std::as_writable_bytes(part), what);
    std::transform(part.begin(), part.end(), into.begin() + static_cast<std::ptrdiff_t>(done),
                   [](Word value) { return static_cast<Out>(value); });
    done += part.size();
  }
}

std::vector<std::int64_t> WordFile::integers(std::uint64_t word, std::uint64_t count, const std::string& what) const {
  require(word, count, what);
  std::vector<std::int64_t> values(count);
  if (word_bytes_ == 4)
    convert<std::int32_t>(word, std::span(values), what);
  else
    convert<std::int64_t>(word, std::span(values), what);
  return values;
}

void WordFile::reals(std::uint64_t word, std::span<float> into, const std::string& what) const {
  require(word, into.size(), what);
  if (word_bytes_ == 4)
    read(word * word_bytes_, std::as_writable_bytes(into), what);
  else
    convert<double>(word, into, what);
}

double WordFile::real(std::uint64_t word, const std::string& what) const {
  require(word, 1, what);
  double value = 0;
  if (word_bytes_ == 4)
    convert<float>(word, std::span(&value, 1), what);
  else
    convert<double>(word, std::span(&value, 1), what);
  return value;
}

std::uint64_t WordFile::next_data(std::uint64_t word) const noexcept {
  const ::off_t data =
      ::lseek(descriptor_, static_cast<::off_t>(std::min(times(word, word_bytes_), bytes_)), SEEK_DATA);
  if (data < 0) return errno == ENXIO ? std::max(word, words()) : word;  // no data follows; or holes are not supported
  return std::max(word, static_cast<std::uint64_t>(data) / word_bytes_);
}

bool WordFile::is_zero_from(std::uint64_t word) const {
  const std::uint64_t first = std::min(times(word, word_bytes_), bytes_);
  std::vector<std::byte> chunk(std::min<std::uint64_t>(chunk_bytes, bytes_ - first));
  for (std::uint64_t byte = first; byte < bytes_;) {
    byte = std::max(byte, times(next_data(byte / word_bytes_), word_bytes_));
    if (byte >= bytes_) break;
    const std::span<std::byte> part = std::span(chunk).first(std::min<std::uint64_t>(chunk.size(), bytes_ - byte));
    read(byte, part, "padding");
    if (std::any_of(part.begin(), part.end(), [](std::byte b) { return b != std::byte{}; })) return false;
    byte += part.size();
  }
  return true;
}

std::optional<Encoding> detect_encoding(const WordFile& file) {
  std::array<std::byte, base_words * 8> start{};
  for (const Encoding encoding : {Encoding{4, false}, {8, false}, {4, true}, {8, true}}) {
    const std::span bytes = std::span(start).first(base_words * encoding.word_bytes);
    if (file.bytes() < bytes.size()) continue;
    file.read(0, bytes, "the control words");
    const std::int64_t type = integer_at(bytes, file_type_word, encoding) % wide_ids;
    const std::int64_t dimensions = integer_at(bytes, dimensions_word, encoding);
    if ((type == type_d3plot || type == type_d3part || type == type_d3eigv) && dimensions >= 2 && dimensions <= 9)
      return encoding;
  }
  return std::nullopt;
}
}  // namespace lbea::io::d3plot
