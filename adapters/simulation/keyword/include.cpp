#include "adapters/simulation/keyword/include.hpp"

#include <algorithm>

namespace lbea::io::keyword {
namespace {
namespace fs = std::filesystem;

constexpr std::size_t deepest = 32;  // files that are open at once
constexpr std::size_t most_files = 10'000;
constexpr std::string_view goes_on = " +";

/// Windows separates folders by backslashes.
fs::path as_path(std::string name) {
  std::replace(name.begin(), name.end(), '\\', '/');
  return name;
}
}  // namespace

bool Includes::next_name(Cards& cards, std::string& name) {
  std::string_view line;
  name.clear();
  while (name.empty()) {
    if (!cards.next(line)) return false;
    name = text::trimmed(line);
  }
  while (name.ends_with(goes_on) && cards.next(line)) {
    name.resize(name.size() - goes_on.size());
    name += text::trimmed(line);
  }
  return true;
}

void Includes::add_folders(Cards& cards) {
  for (std::string name; next_name(cards, name);) folders_.push_back(open_.front().parent_path() / as_path(name));
}

fs::path Includes::find(const Cards& cards, const std::string& name) const {
  const fs::path file = as_path(name);
  std::vector<fs::path> places{open_.front().parent_path(), open_.back().parent_path()};
  places.insert(places.end(), folders_.begin(), folders_.end());
  std::error_code error;
  for (const fs::path& place : places)
    if (fs::is_regular_file(place / file, error)) return place / file;
  cards.fail("the included file " + name + " is neither beside the first file nor beside this one" +
                 (folders_.empty() ? "" : " nor in a folder of *INCLUDE_PATH") + "; copy it along",
             Status::file_not_found);
}

void Includes::refuse_cycle(const Cards& cards, const fs::path& file) const {
  std::error_code error;
  for (const fs::path& other : open_)
    if (fs::equivalent(other, file, error))
      cards.fail("the included file " + file.string() + " includes this file, or is it; remove one *INCLUDE");
}

void Includes::read(const Cards& cards, const std::string& name, const std::function<void(std::size_t file)>& read) {
  const fs::path file = find(cards, name);
  refuse_cycle(cards, file);
  if (open_.size() == deepest)
    cards.fail("files include one another more than " + std::to_string(deepest) + " deep; join some");
  if (files_.size() == most_files) cards.fail("more than " + std::to_string(most_files) + " files are included");
  files_.push_back(file.string());
  open_.push_back(file);
  read(files_.size() - 1);
  open_.pop_back();
}
}  // namespace lbea::io::keyword
