#include "precompute/model_file/model_writer.hpp"

#include "precompute/work/stale_files.hpp"
#include "runtime/src/model/checksum.hpp"
#include "runtime/src/model/section_reader.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>

#include <fcntl.h>
#include <unistd.h>

namespace lbea::bake {
namespace {
constexpr std::size_t largest_transfer = std::size_t{1} << 30;  // one pwrite() moves at most 2^31 - 4096 bytes

std::uint64_t product(std::uint64_t a, std::uint64_t b) {
  constexpr std::uint64_t largest_file = std::uint64_t{1} << 55;  // few enough that sums of some sections fit, too
  if (b != 0 && a > largest_file / b)
    throw Error(Status::bad_config, "the model would be larger than any disk; use fewer samples or fewer references");
  return a * b;
}

format::SectionEntry entry_of(const PlannedSection& section) {
  if (section.shape.empty() || section.shape.size() > 3) throw std::logic_error("a section has 1 to 3 dimensions");
  format::SectionEntry entry{};
  entry.id = static_cast<std::uint32_t>(section.id);
  entry.part = section.part;
  entry.element_type = static_cast<std::uint32_t>(section.type);
  entry.rank = static_cast<std::uint32_t>(section.shape.size());
  entry.shape.fill(1);
  std::ranges::copy(section.shape, entry.shape.begin());
  entry.length = format::size_of(section.type);
  for (const std::uint64_t extent : section.shape) entry.length = product(entry.length, extent);
  return entry;
}

auto section_key(const format::SectionEntry& entry) { return std::pair(entry.id, entry.part); }

std::string name_of(const format::SectionEntry& entry) {
  return "section " + std::to_string(entry.id) + " '" + title(static_cast<format::SectionId>(entry.id)) + "' part " +
         std::to_string(entry.part);
}

/// Moves all bytes by transfer(byte, count, offset), which is pread() or pwrite(); fail(error) throws.
template <typename Byte>
void transfer_all(const auto& transfer, std::uint64_t offset, std::span<Byte> bytes, const auto& fail) {
  while (!bytes.empty()) {
    const ssize_t n = transfer(bytes.data(), std::min(bytes.size(), largest_transfer), static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) fail(n < 0 ? errno : EIO);
    offset += static_cast<std::uint64_t>(n);
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
}

/// Resolves links. Only a model or an empty file may be replaced; any other file, for example an input of the ensemble,
/// is refused.
std::filesystem::path replaceable(std::filesystem::path file) {
  namespace fs = std::filesystem;
  std::error_code missing;
  if (!fs::exists(file, missing)) return file;
  file = fs::canonical(file);
  std::array<char, format::magic.size()> begin{};
  const bool is_empty = fs::is_regular_file(file) && fs::file_size(file) == 0;
  const bool is_model = fs::is_regular_file(file) &&
                        std::ifstream(file, std::ios::binary).read(begin.data(), begin.size()) &&
                        std::memcmp(begin.data(), format::magic.data(), begin.size()) == 0;
  if (!is_empty && !is_model)
    throw Error(Status::write_failed,
                file.string() + ": exists and is not a model; nothing was overwritten, choose another name");
  return file;
}
}  // namespace

void check_replaceable(const std::filesystem::path& file) { (void)replaceable(file); }

std::uint64_t model_size(const std::vector<PlannedSection>& sections) {
  std::uint64_t size = sizeof(format::Header) + sections.size() * sizeof(format::SectionEntry);
  for (const PlannedSection& section : sections) size += format::aligned(entry_of(section).length);
  return size;
}

ModelWriter::ModelWriter(std::filesystem::path file, std::vector<PlannedSection> sections)
    : file_(replaceable(std::move(file))) {
  plan(std::move(sections));
  create();
  try {
    reserve();
  } catch (...) {  // the destructor does not run
    ::close(descriptor_);
    ::unlink(temporary_.c_str());
    throw;
  }
}

ModelWriter::~ModelWriter() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

void ModelWriter::plan(std::vector<PlannedSection> sections) {
  for (const PlannedSection& section : sections) directory_.push_back(entry_of(section));
  std::ranges::sort(directory_, {}, section_key);
  if (std::ranges::adjacent_find(directory_, {}, section_key) != directory_.end())
    throw std::logic_error("a section is planned twice");
  written_ = std::make_unique<Written[]>(directory_.size());
  header_.magic = format::magic;
  header_.endian_tag = format::endian_tag;
  header_.version_major = format::version_major;
  header_.version_minor = format::version_minor;
  header_.directory_offset = sizeof(format::Header);
  header_.section_count = static_cast<std::uint32_t>(directory_.size());
  std::uint64_t offset = sizeof(format::Header) + directory_.size() * sizeof(format::SectionEntry);
  for (format::SectionEntry& entry : directory_) {
    entry.offset = offset;
    offset += format::aligned(entry.length);
  }
  header_.file_size = offset;
}

void ModelWriter::create() {
  if (!file_.has_filename()) fail("create", "no file name", EISDIR);
  remove_stale_files(file_);
  descriptor_ = create_temporary(file_, "", temporary_);
  if (descriptor_ < 0) fail("create", "temporary file", errno);
}

// Detects a full disk before the work. On file systems that cannot reserve space, writing fails instead.
void ModelWriter::reserve() {
  const auto size = static_cast<off_t>(header_.file_size);
  const std::string where = std::to_string(header_.file_size) + " bytes";
  if (::fallocate(descriptor_, 0, 0, size) != 0 && errno != EOPNOTSUPP && errno != ENOSYS && errno != EINTR)
    fail("reserve space for", where, errno);
  if (::ftruncate(descriptor_, size) != 0) fail("reserve space for", where, errno);
}

std::size_t ModelWriter::place_of(format::SectionId id, std::uint32_t part, std::uint64_t begin,
                                  std::size_t bytes) const {
  const std::pair key(static_cast<std::uint32_t>(id), part);
  const auto entry = std::ranges::lower_bound(directory_, key, {}, section_key);
  if (entry == directory_.end() || section_key(*entry) != key)
    throw std::logic_error("section " + title(id) + " is not planned");
  if (begin > entry->length || bytes > entry->length - begin)
    throw std::logic_error("more bytes for " + name_of(*entry) + " than planned");
  return static_cast<std::size_t>(entry - directory_.begin());
}

void ModelWriter::write_bytes(format::SectionId id, std::uint32_t part, std::uint64_t begin,
                              std::span<const std::byte> bytes) {
  const std::size_t place = place_of(id, part, begin, bytes.size());
  write_at(directory_[place].offset + begin, bytes, name_of(directory_[place]));
  written_[place].bytes += bytes.size();
}

void ModelWriter::read_bytes(format::SectionId id, std::uint32_t part, std::uint64_t begin,
                             std::span<std::byte> bytes) const {
  const std::size_t place = place_of(id, part, begin, bytes.size());
  read_at(directory_[place].offset + begin, bytes, name_of(directory_[place]));
}

void ModelWriter::read_at(std::uint64_t offset, std::span<std::byte> bytes, const std::string& where) const {
  const auto read = [&](std::byte* to, std::size_t count, off_t at) { return ::pread(descriptor_, to, count, at); };
  transfer_all(read, offset, bytes, [&](int error) { fail("read back", where, error); });
}

void ModelWriter::write_at(std::uint64_t offset, std::span<const std::byte> bytes, const std::string& where) {
  const auto write = [&](const std::byte* from, std::size_t count, off_t at) {
    return ::pwrite(descriptor_, from, count, at);
  };
  transfer_all(write, offset, bytes, [&](int error) { fail("write", where, error); });
}

void ModelWriter::commit() {
  check_complete();
  fill_checksums();
  const auto directory = std::as_bytes(std::span(directory_));
  header_.directory_checksum = checksum(directory);
  header_.header_checksum =
      checksum(std::as_bytes(std::span(&header_, 1)).first(offsetof(format::Header, header_checksum)));
  write_at(header_.directory_offset, directory, "directory");
  write_at(0, std::as_bytes(std::span(&header_, 1)), "header");
  publish();
}

void ModelWriter::check_complete() const {
  for (std::size_t i = 0; i < directory_.size(); ++i)
    if (written_[i].bytes != directory_[i].length)
      throw std::logic_error(name_of(directory_[i]) + ": " + std::to_string(written_[i].bytes) + " of " +
                             std::to_string(directory_[i].length) + " bytes were written");
}

// Sections are written in pieces and in any order, so their checksums are computed from the file.
void ModelWriter::fill_checksums() {
  std::vector<std::byte> buffer(std::size_t{1} << 20);
  for (format::SectionEntry& entry : directory_) {
    RunningChecksum checksum;
    for (std::uint64_t done = 0; done < entry.length;) {
      const auto piece = std::span(buffer).first(
          static_cast<std::size_t>(std::min<std::uint64_t>(buffer.size(), entry.length - done)));
      read_at(entry.offset + done, piece, name_of(entry));
      checksum.add(piece);
      done += piece.size();
    }
    entry.checksum = checksum.value();
  }
}

void ModelWriter::publish() {
  if (::fsync(descriptor_) != 0) fail("flush", "all sections", errno);
  if (::close(std::exchange(descriptor_, -1)) != 0) fail("close", "all sections", errno);
  if (::rename(temporary_.c_str(), file_.c_str()) != 0) fail("rename the finished file to", "all sections", errno);
  temporary_.clear();
  const int error = flush_folder_of(file_);
  if (error == 0 || error == EINVAL) return;
  ::unlink(
      file_.c_str());  // the caller reports a failure, so the file must not exist; it may vanish in a power failure
  fail("flush the folder of", "all sections", error);
}

void ModelWriter::fail(const std::string& action, const std::string& where, int error) const {
  throw Error(Status::write_failed, "cannot " + action + " " + file_.string() + " (" + where +
                                        "): " + std::generic_category().message(error) +
                                        "; check the folder, its rights and the free space");
}
}  // namespace lbea::bake
