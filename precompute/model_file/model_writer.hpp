// Writes a model file as runtime/FORMAT.md specifies it: sections in any order, from any thread, in pieces.
#pragma once

#include "runtime/src/model/model_format.hpp"

#include <atomic>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace lbea::bake {
struct PlannedSection {
  format::SectionId id{};
  std::uint32_t part = 0;
  format::ElementType type{};
  std::vector<std::uint64_t> shape;  // 1 to 3 dimensions
};

/// Throws Error{write_failed} when a file of this name exists that is not a model: it would be overwritten.
void check_replaceable(const std::filesystem::path& file);

/// Size in bytes of the model with these sections.
[[nodiscard]] std::uint64_t model_size(const std::vector<PlannedSection>& sections);

/// The complete file appears under its name when commit() returns; until then there is a temporary one beside it, which
/// the destructor removes. Every failure is Error{write_failed} that names file, section and the system's reason.
/// The bytes do not depend on the order of the writes.
class ModelWriter {
 public:
  /// Reserves the space. Sections are sorted by (id, part).
  ModelWriter(std::filesystem::path file, std::vector<PlannedSection> sections);
  ~ModelWriter();
  ModelWriter(const ModelWriter&) = delete;
  ModelWriter& operator=(const ModelWriter&) = delete;

  /// Elements [first, first + values.size()) of a section. Pieces may not overlap. Safe from several threads.
  template <typename T>
  void write(format::SectionId id, std::uint32_t part, std::uint64_t first, std::span<const T> values) {
    static_assert(std::is_arithmetic_v<T>);
    write_bytes(id, part, first * sizeof(T), std::as_bytes(values));
  }
  /// The same in bytes from `begin`.
  void write_bytes(format::SectionId id, std::uint32_t part, std::uint64_t begin, std::span<const std::byte> bytes);
  /// Elements that were written before, from any thread.
  template <typename T>
  void read(format::SectionId id, std::uint32_t part, std::uint64_t first, std::span<T> values) const {
    read_bytes(id, part, first * sizeof(T), std::as_writable_bytes(values));
  }
  void read_bytes(format::SectionId id, std::uint32_t part, std::uint64_t begin, std::span<std::byte> bytes) const;
  /// Throws std::logic_error when a section was not written completely.
  void commit();

  [[nodiscard]] std::uint64_t file_size() const noexcept { return header_.file_size; }

 private:
  struct Written {
    std::atomic<std::uint64_t> bytes{0};
  };

  void plan(std::vector<PlannedSection> sections);
  void create();
  void reserve();

  [[nodiscard]] std::size_t place_of(format::SectionId id, std::uint32_t part, std::uint64_t begin,
                                     std::size_t bytes) const;
  void read_at(std::uint64_t offset, std::span<std::byte> bytes, const std::string& where) const;
  void write_at(std::uint64_t offset, std::span<const std::byte> bytes, const std::string& where);
  void check_complete() const;
  void fill_checksums();
  void publish();
  [[noreturn]] void fail(const std::string& action, const std::string& where, int error) const;

  std::filesystem::path file_, temporary_;  // temporary_ is empty once renamed
  int descriptor_ = -1;
  format::Header header_{};
  std::vector<format::SectionEntry> directory_;
  std::unique_ptr<Written[]> written_;  // per section
};
}  // namespace lbea::bake
