// Work in a child process. libhdf5 1.10 crashes on many damaged files, which must not end a bake of a thousand runs.
#pragma once

#include <cstddef>
#include <cstring>
#include <filesystem>
#include <functional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace lbea::io::child {
using Bytes = std::vector<std::byte>;

/// What `work`, which reads `file`, returns in a child process. Rethrows its Error or std::bad_alloc; throws
/// Error{bad_input} when it crashes, or takes much longer than the size of the file explains. It prints nothing.
[[nodiscard]] Bytes run(const std::filesystem::path& file, const std::function<Bytes()>& work);

/// Lists of plain values, one after the other, with their lengths.
class Packer {
 public:
  template <typename Value>
  void add(std::span<const Value> values) {
    const std::uint64_t size = values.size();
    append(&size, sizeof size);
    append(values.data(), values.size_bytes());
  }
  [[nodiscard]] Bytes take() { return std::move(bytes_); }

 private:
  void append(const void* from, std::size_t size) {
    const auto* const first = static_cast<const std::byte*>(from);
    bytes_.insert(bytes_.end(), first, first + size);
  }
  Bytes bytes_;
};

/// The same lists again. A child whose memory a damaged file has overwritten may return anything: throws
/// std::out_of_range when a list does not fit into the bytes.
class Unpacker {
 public:
  explicit Unpacker(std::span<const std::byte> bytes) : bytes_(bytes) {}
  template <typename Value>
  [[nodiscard]] std::vector<Value> next() {
    std::uint64_t size = 0;
    copy(&size, sizeof size);
    if (size > bytes_.size() / sizeof(Value)) throw std::out_of_range("list");
    std::vector<Value> values(size);
    copy(values.data(), size * sizeof(Value));
    return values;
  }

 private:
  void copy(void* into, std::size_t size) {
    if (size > bytes_.size()) throw std::out_of_range("list");
    if (size > 0) std::memcpy(into, bytes_.data(), size);
    bytes_ = bytes_.subspan(size);
  }
  std::span<const std::byte> bytes_;
};
}  // namespace lbea::io::child
