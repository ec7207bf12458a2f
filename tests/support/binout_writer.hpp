// Writes binout files as LS-DYNA does: LSDA records, with a symbol table at the end.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>

namespace lbea::test {

class BinoutWriter {
 public:
  BinoutWriter() {
    bytes_ = {8, 8, 8, 1, 1, 1, 0, 0};
    record(7, std::string(8, '\0'));  // where the symbol table begins; readers of the data do not need it
  }

  void change_directory(const std::string& path) { record(2, path); }
  void write(const std::string& name, std::span<const float> values) { data(9, name, values); }
  void write(const std::string& name, std::span<const double> values) { data(10, name, values); }
  void write(const std::string& name, std::span<const std::int32_t> values) { data(3, name, values); }

  /// A symbol table of one variable, as after every state.
  void write_symbols(const std::string& name) {
    const std::string variable = name + std::string(1 + 8 + 8, '\0');
    constexpr std::uint64_t head = 8 + 1;
    record_of(5, "", 3 * head + variable.size() + 8);
    record(4, variable);
    record(6, std::string(8, '\0'));
  }

  [[nodiscard]] const std::string& bytes() const noexcept { return bytes_; }
  void save(const std::filesystem::path& file) const {
    std::ofstream(file, std::ios::binary).write(bytes_.data(), static_cast<std::streamsize>(bytes_.size()));
  }

 private:
  void record(char command, const std::string& content) { record_of(command, content, 8 + 1 + content.size()); }
  void record_of(char command, const std::string& content, std::uint64_t length) {
    for (int i = 0; i < 8; ++i) bytes_ += static_cast<char>(length >> (8 * i) & 0xff);
    bytes_ += command;
    bytes_ += content;
  }
  template <class Value>
  void data(char type, const std::string& name, std::span<const Value> values) {
    std::string content{type, static_cast<char>(name.size())};
    content += name;
    const std::size_t begin = content.size();
    content.resize(begin + values.size_bytes());
    std::memcpy(content.data() + begin, values.data(), values.size_bytes());
    record(3, content);
  }

  std::string bytes_;
};

}  // namespace lbea::test
