// The files of an LS-DYNA keyword input, which include one another.
#pragma once

#include "adapters/simulation/keyword/cards.hpp"

#include <deque>
#include <filesystem>
#include <functional>

namespace lbea::io::keyword {
class Includes {
 public:
  explicit Includes(const std::string& main_file) : files_{main_file}, open_{main_file} {}

  /// Reads the next file name of *INCLUDE, which may go on over three lines; false when there is none.
  [[nodiscard]] static bool next_name(Cards& cards, std::string& name);
  /// Reads *INCLUDE_PATH or *INCLUDE_PATH_RELATIVE: folders to search.
  void add_folders(Cards& cards);

  /// Finds the file `name` beside the main file, beside the including file, or in a folder of *INCLUDE_PATH, and calls
  /// `read` with its number. Throws Error{file_not_found | bad_input} that names the line of the *INCLUDE.
  void read(const Cards& cards, const std::string& name, const std::function<void(std::size_t file)>& read);

  /// The main file, then all included ones in the order of reading.
  [[nodiscard]] const std::deque<std::string>& files() const noexcept { return files_; }

 private:
  [[nodiscard]] std::filesystem::path find(const Cards& cards, const std::string& name) const;
  void refuse_cycle(const Cards& cards, const std::filesystem::path& file) const;

  std::deque<std::string> files_;            // names stay where they are
  std::vector<std::filesystem::path> open_;  // the files that are being read: the main one, one that it includes, ...
  std::vector<std::filesystem::path> folders_;
};
}  // namespace lbea::io::keyword
