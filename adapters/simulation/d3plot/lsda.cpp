#include "adapters/simulation/d3plot/lsda.hpp"

#include <algorithm>

namespace lbea::io::d3plot {
namespace {

enum Command : std::uint64_t { change_directory = 2, data = 3, begin_symbols = 5, last_command = 7 };

constexpr std::uint64_t least_header = 8, most_bytes_of_number = 8, longest_directory = 1024;
constexpr std::uint64_t most_bytes_of_record = std::uint64_t{1} << 32;  // of one that may be cut short
constexpr std::uint64_t buffer_bytes = 4096;                            // records of one number are small

/// Of the type ids 1 to 10; none of others.
std::optional<binary::Scalar> scalar_of(std::uint64_t type) {
  using enum binary::Scalar;
  constexpr std::array types{int8, int16, int32, int64, uint8, uint16, uint32, uint64, float32, float64};
  return type >= 1 && type <= types.size() ? std::optional(types[type - 1]) : std::nullopt;
}

/// `path` may be absolute, and have ".." as parts.
std::string changed(std::string directory, const std::string& path) {
  if (path.starts_with('/')) directory.clear();
  for (std::size_t begin = 0; begin <= path.size();) {
    const std::size_t end = std::min(path.find('/', begin), path.size());
    const std::string part = path.substr(begin, end - begin);
    if (part == "..") directory.resize(std::min(directory.rfind('/'), directory.size()));
    if (!part.empty() && part != "." && part != "..") directory += '/' + part;
    begin = end + 1;
  }
  return directory;
}

}  // namespace

LsdaFile::LsdaFile(std::filesystem::path path, const Visit& visit) : file_(std::move(path), 1) {
  read_header();
  std::string directory;
  std::uint64_t byte = header_bytes_;
  while (const auto record = record_at(byte)) {
    if (record->command == change_directory) change(directory, *record);
    if (record->command == data) visit_variable(*record, directory, visit);
    byte = record->command == begin_symbols ? record->content : record->end();  // its length is that of the table
  }
  buffer_ = {};
}

void LsdaFile::read_header() {
  std::array<std::byte, least_header> header{};
  file_.require(0, header.size(), "the header");
  file_.read(0, header, "the header");
  const auto number = [&](std::size_t place) { return std::to_integer<std::uint64_t>(header[place]); };
  header_bytes_ = number(0);
  length_bytes_ = number(1);
  command_bytes_ = number(3);
  type_bytes_ = number(4);
  if (number(5) != 1 || number(6) != 0)
    file_.refuse(Status::unsupported_input, 5, "numbers are not little-endian IEEE; write the file on such a machine");
  for (const std::uint64_t bytes : {length_bytes_, command_bytes_, type_bytes_})
    if (bytes < 1 || bytes > most_bytes_of_number || header_bytes_ < least_header)
      file_.refuse_damaged(0, "this is no header of a binout file");
}

/// None at the end, or of one that is cut short.
std::optional<LsdaFile::Record> LsdaFile::record_at(std::uint64_t byte) {
  const std::uint64_t content = plus(byte, length_bytes_ + command_bytes_);
  if (content > file_.bytes()) return std::nullopt;
  const Record record{byte, unsigned_at(byte, length_bytes_), unsigned_at(byte + length_bytes_, command_bytes_),
                      content};
  if (plus(byte, record.bytes) < content || record.bytes > most_bytes_of_record || record.command > last_command)
    file_.refuse_damaged(
        byte, "a record of kind " + std::to_string(record.command) + " has " + std::to_string(record.bytes) + " bytes");
  const bool is_cut = record.command != begin_symbols && record.end() > file_.bytes();
  return is_cut ? std::nullopt : std::optional(record);
}

void LsdaFile::change(std::string& directory, const Record& record) {
  const std::uint64_t bytes = record.end() - record.content;
  if (bytes <= longest_directory) directory = changed(std::move(directory), text_at(record.content, bytes));
  if (bytes > longest_directory || directory.size() > longest_directory)
    file_.refuse_damaged(record.byte, "the name of a directory is longer than LS-DYNA writes");
}

void LsdaFile::visit_variable(const Record& record, const std::string& directory, const Visit& visit) {
  const std::uint64_t name_at = record.content + type_bytes_ + 1;
  if (name_at > record.end()) file_.refuse_damaged(record.byte, "a variable has no name");
  const std::uint64_t begin = name_at + unsigned_at(name_at - 1, 1);
  if (begin > record.end()) file_.refuse_damaged(record.byte, "the name of a variable is longer than its record");
  if (const auto type = scalar_of(unsigned_at(record.content, type_bytes_)))  // else of a newer version
    visit(directory, text_at(name_at, begin - name_at),
          {*type, begin, (record.end() - begin) / binary::size_of(*type)});
}

/// Valid until the next call.
const std::byte* LsdaFile::bytes_at(std::uint64_t byte, std::uint64_t bytes) {
  if (byte < buffered_at_ || plus(byte, bytes) > buffered_at_ + buffer_.size()) {
    const std::uint64_t rest = file_.bytes() - std::min(byte, file_.bytes());
    buffer_.resize(std::max(bytes, std::min(buffer_bytes, rest)));
    file_.read(byte, buffer_, "a record");
    buffered_at_ = byte;
  }
  return buffer_.data() + (byte - buffered_at_);
}

std::uint64_t LsdaFile::unsigned_at(std::uint64_t byte, std::uint64_t bytes) {
  return binary::load_bits(bytes_at(byte, bytes), bytes, false);
}

std::string LsdaFile::text_at(std::uint64_t byte, std::uint64_t bytes) {
  return {reinterpret_cast<const char*>(bytes_at(byte, bytes)), bytes};
}

std::vector<double> LsdaFile::read(const LsdaNumbers& numbers) const {
  const std::size_t size = binary::size_of(numbers.type);
  std::vector<std::byte> bytes(numbers.count * size);
  file_.read(numbers.byte, bytes, "a variable");
  std::vector<double> values(numbers.count);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = binary::load(&bytes[i * size], numbers.type, false);
  return values;
}

}  // namespace lbea::io::d3plot
