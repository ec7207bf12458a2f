// Serializes values to and from work files and into their keys; one list of members serves all three.
#pragma once

#include "precompute/work/work_file.hpp"
#include "runtime/src/model/checksum.hpp"

#include <Eigen/Dense>

#include <type_traits>

namespace lbea::bake {
/// Numbers and arrays of numbers are written as they are in memory.
template <class T>
inline constexpr bool is_plain = std::is_arithmetic_v<T> || std::is_enum_v<T>;
template <class T, std::size_t N>
inline constexpr bool is_plain<std::array<T, N>> = is_plain<T>;

/// Sink: bytes(span<const byte>). Structs need a function `members(archive, value)` that calls archive(member, ...).
template <class Sink>
class Saver {
 public:
  explicit Saver(Sink& sink) : sink_(sink) {}
  template <class... T>
  void operator()(const T&... values) {
    (save(values), ...);
  }

 private:
  template <class T>
  requires is_plain<T>
  void save(const T& value) { sink_.bytes(std::as_bytes(std::span(&value, 1))); }
  void save(const std::string& text) {
    save(std::uint64_t{text.size()});
    sink_.bytes(std::as_bytes(std::span(text)));
  }
  void save(const std::filesystem::path& path) { save(path.string()); }
  template <class T>
  void save(const std::vector<T>& values) {
    save(std::uint64_t{values.size()});
    if constexpr (is_plain<T>)
      sink_.bytes(std::as_bytes(std::span(values)));
    else
      for (const T& value : values) save(value);
  }
  template <class T>
  void save(const std::optional<T>& value) {
    save(std::uint8_t{value.has_value()});
    if (value) save(*value);
  }
  template <int Columns>
  void save(const Eigen::Matrix<double, Eigen::Dynamic, Columns>& matrix) {
    save(static_cast<std::uint64_t>(matrix.rows()));
    save(static_cast<std::uint64_t>(matrix.cols()));
    sink_.bytes(std::as_bytes(std::span(matrix.data(), static_cast<std::size_t>(matrix.size()))));
  }
  template <class T>
  requires(std::is_class_v<T> && !is_plain<T>) void save(const T& value) {
    members(*this, const_cast<T&>(value));  // members() also serves reading; nothing is changed here
  }

  Sink& sink_;
};

/// A count is accepted only if the file has at least as many bytes left.
class Loader {
 public:
  explicit Loader(WorkReader& file) : file_(file) {}
  template <class... T>
  void operator()(T&... values) {
    (load(values), ...);
  }

 private:
  std::size_t count(std::size_t bytes_each) {
    std::uint64_t count = 0;
    load(count);
    if (count > file_.rest() / bytes_each) file_.fail("is damaged");
    return static_cast<std::size_t>(count);
  }
  template <class T>
  requires is_plain<T>
  void load(T& value) { file_.bytes(std::as_writable_bytes(std::span(&value, 1))); }
  void load(std::string& text) {
    text.resize(count(1));
    file_.bytes(std::as_writable_bytes(std::span(text)));
  }
  void load(std::filesystem::path& path) {
    std::string text;
    load(text);
    path = text;
  }
  template <class T>
  void load(std::vector<T>& values) {
    if constexpr (is_plain<T>) {
      values.resize(count(sizeof(T)));
      file_.bytes(std::as_writable_bytes(std::span(values)));
    } else {
      values.resize(count(1));
      for (T& value : values) load(value);
    }
  }
  template <class T>
  void load(std::optional<T>& value) {
    std::uint8_t is_there = 0;
    load(is_there);
    if (is_there != 0) load(value.emplace());
  }
  template <int Columns>
  void load(Eigen::Matrix<double, Eigen::Dynamic, Columns>& matrix) {
    const std::size_t rows = count(1), columns = count(1);
    if (columns > 0 && rows > file_.rest() / sizeof(double) / columns) file_.fail("is damaged");
    matrix.resize(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(columns));
    file_.bytes(std::as_writable_bytes(std::span(matrix.data(), static_cast<std::size_t>(matrix.size()))));
  }
  template <class T>
  requires(std::is_class_v<T> && !is_plain<T>) void load(T& value) { members(*this, value); }

  WorkReader& file_;
};

/// Hash of values: the key of a result that depends on nothing else.
class KeySink {
 public:
  void bytes(std::span<const std::byte> bytes) { key_ = XXH3_64bits_withSeed(bytes.data(), bytes.size(), key_); }
  [[nodiscard]] std::uint64_t key() const noexcept { return key_; }

 private:
  std::uint64_t key_ = 0;
};

template <class... T>
[[nodiscard]] std::uint64_t key_of(const T&... values) {
  KeySink sink;
  Saver{sink}(values...);
  return sink.key();
}
}  // namespace lbea::bake
