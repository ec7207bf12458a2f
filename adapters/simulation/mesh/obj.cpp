#include "adapters/files/text_line.hpp"
#include "adapters/simulation/grid/grid.hpp"

#include <algorithm>

namespace lbea::io::grid {
namespace {
constexpr std::array<std::string_view, 17> keywords{"v", "vn", "vt",     "vp",     "f",      "l",   "p",    "o",  "g",
                                                    "s", "mg", "mtllib", "usemtl", "cstype", "deg", "surf", "end"};

class ObjParser {
 public:
  ObjParser(std::string_view text, const std::string& name) : lines_(text, name, "OBJ") {}

  Grid parse() {
    for (std::string_view line; lines_.next(line);) {
      const std::string_view keyword = text::next_word(line);
      if (keyword == "v") read_vertex(line);
      if (keyword == "f") read_face(line);
    }
    return std::move(grid_);
  }

 private:
  void read_vertex(std::string_view line) {
    for (int axis = 0; axis < 3; ++axis) {
      float value = 0;
      if (!text::parse_number(text::next_word(line), value)) lines_.fail("a vertex needs three numbers");
      grid_.positions.push_back(value);
    }
  }

  void read_face(std::string_view line) {
    corners_.clear();
    for (std::string_view word = text::next_word(line); !word.empty(); word = text::next_word(line)) {
      if (word.ends_with('\\'))
        lines_.fail("a face that continues on the next line is not read; write the face in one line");
      corners_.push_back(vertex(word.substr(0, word.find('/'))));
    }
    if (corners_.size() < 3) lines_.fail("a face needs three vertices");
    grid_.cells.add(corners_.size() == 3 ? CellKind::triangle : CellKind::polygon, corners_);
  }

  std::uint32_t vertex(std::string_view word) const {
    std::int64_t index = 0;
    const auto points = static_cast<std::int64_t>(grid_.points());
    if (!text::parse_integer(word, index) || index == 0 || index < -points || index > 0xffffffff)
      lines_.fail(text::quoted(word) + " is not a vertex");
    return static_cast<std::uint32_t>(index > 0 ? index - 1 : points + index);
  }

  text::LineReader lines_;
  Grid grid_;
  std::vector<std::uint32_t> corners_;
};
}  // namespace

/// Every line of the start begins with a keyword of OBJ, and one of them is a vertex.
bool is_obj(std::string_view start) noexcept {
  text::LineReader lines(start.substr(0, start.find_last_of('\n')));  // the last line may be cut
  bool has_vertex = false, goes_on = false;
  for (std::string_view line; lines.next(line);) {
    if (std::exchange(goes_on, line.ends_with('\\'))) continue;
    const std::string_view keyword = text::next_word(line);
    if (keyword.empty() || keyword.starts_with('#')) continue;
    if (std::find(keywords.begin(), keywords.end(), keyword) == keywords.end()) return false;
    has_vertex = has_vertex || keyword == "v";
  }
  return has_vertex;
}

/// Reads vertices and faces; faces by position, texture and normal ("f 1/2/3 ..."), also with indices that count back
/// from the last vertex. All other lines are skipped.
Grid parse_obj(std::string_view text, const std::string& name) { return ObjParser(text, name).parse(); }
}  // namespace lbea::io::grid
