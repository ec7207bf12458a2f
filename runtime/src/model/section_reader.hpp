// Header and directory of a model file: finds and checks sections, whatever their content.
#pragma once

#include "runtime/src/model/model_format.hpp"
#include "runtime/src/model/section_content.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace lbea {
class SectionReader {
 public:
  using Release = lbea::Release;

  /// Checks header, directory, layout, padding and checksums by the rules of FORMAT.md. Reads the image once, from
  /// front to end.
  SectionReader(std::span<const std::byte> image, std::string name, const Release& release = {});

  using Shape = std::array<std::uint64_t, 3>;

  /// The section's elements, after a check of type and shape.
  template <typename T>
  [[nodiscard]] std::span<const T> required(format::SectionId id, Shape shape, std::uint32_t part = 0) const {
    const format::SectionEntry* entry = find(id, part);
    if (entry == nullptr) fail_missing(id, part);
    return typed<T>(*entry, shape);
  }
  /// The same; an empty span when the file has no such section.
  template <typename T>
  [[nodiscard]] std::span<const T> optional(format::SectionId id, Shape shape, std::uint32_t part = 0) const {
    const format::SectionEntry* entry = find(id, part);
    return entry == nullptr ? std::span<const T>{} : typed<T>(*entry, shape);
  }
  /// A section of text, of any length.
  [[nodiscard]] std::string_view text(format::SectionId id) const;
  [[nodiscard]] const format::SectionEntry* find(format::SectionId id, std::uint32_t part = 0) const noexcept;
  [[nodiscard]] std::span<const format::SectionEntry> entries() const noexcept { return entries_; }
  /// The section must exist.
  [[nodiscard]] const SectionContent& content(format::SectionId id, std::uint32_t part = 0) const noexcept;
  /// Whether match() by lbea and fit does not read it.
  [[nodiscard]] bool is_cold(const format::SectionEntry& entry) const noexcept;
  [[nodiscard]] std::uint64_t directory_checksum() const noexcept { return directory_checksum_; }
  /// Throws Error{corrupt_model}: "<name>: section <id> '<title>' part <part> at byte <offset>: <what>".
  [[noreturn]] void fail(format::SectionId id, std::uint32_t part, const std::string& what) const;

 private:
  // An array of three floats, say, counts as three elements of its scalar type.
  template <typename T>
  struct Scalar {
    using type = T;
  };
  template <typename T, std::size_t N>
  struct Scalar<std::array<T, N>> {
    using type = T;
  };
  template <typename T>
  static constexpr format::ElementType element_type() {
    using S = typename Scalar<T>::type;
    using enum format::ElementType;
    if constexpr (std::is_floating_point_v<S>) return sizeof(S) == 4 ? f32 : f64;
    static_assert(std::is_floating_point_v<S> || std::is_unsigned_v<S> || std::is_same_v<S, char>);
    return sizeof(S) == 1 ? u8 : sizeof(S) == 2 ? u16 : sizeof(S) == 4 ? u32 : u64;
  }
  template <typename T>
  std::span<const T> typed(const format::SectionEntry& entry, const Shape& shape) const {
    check_shape(entry, element_type<T>(), shape);
    const void* begin = image_.data() + entry.offset;
    return {static_cast<const T*>(begin), static_cast<std::size_t>(entry.length / sizeof(T))};
  }

  void check_header();
  void check_directory(const Release& release);
  void check_entry(const format::SectionEntry& entry, std::uint64_t expected_offset) const;
  [[nodiscard]] SectionContent check_content(const format::SectionEntry& entry, const Release& release) const;
  void check_zero(std::uint64_t begin, std::uint64_t end) const;
  void check_shape(const format::SectionEntry& entry, format::ElementType type, const Shape& shape) const;
  [[noreturn]] void fail_missing(format::SectionId id, std::uint32_t part) const;

  std::span<const std::byte> image_;
  std::string name_;
  std::span<const format::SectionEntry> entries_;
  std::vector<SectionContent> contents_;  // per entry
  std::uint64_t directory_checksum_ = 0;
};

/// The section's title in FORMAT.md, "unknown" for an id that has none.
[[nodiscard]] std::string title(format::SectionId id);
}  // namespace lbea
