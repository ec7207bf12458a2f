#include "adapters/clouds/xyz_columns.hpp"

#include "adapters/clouds/pointcloud.hpp"
#include "adapters/files/atomic_file.hpp"
#include "adapters/files/text_line.hpp"

#include <algorithm>

namespace lbea::io {

namespace clouds {
namespace {

constexpr std::string_view utf8_mark = "\xef\xbb\xbf";

class XyzParser {
 public:
  XyzParser(std::string_view text, const std::string& name) : lines_(text), name_(name) {}

  PointCloud parse() {
    cloud_.source = name_;
    for (std::string_view line; lines_.next(line);) {
      line = text::trimmed(line);
      if (line.empty()) continue;
      if (const std::size_t mark = comment_mark(line))
        take_comment(line.substr(mark));
      else if (columns_)
        take_point(line);
      else
        take_first(line);
    }
    return std::move(cloud_);
  }

 private:
  /// Characters that make the line a comment, 0: it is none.
  static std::size_t comment_mark(std::string_view line) {
    if (line[0] == '#' || line[0] == '%') return 1;
    return line.starts_with("//") ? 2 : 0;
  }

  void take_comment(std::string_view comment) {
    if (!cloud_.stamp_ns) cloud_.stamp_ns = text::find_stamp(comment);
    if (!columns_) remark_ = text::trimmed(comment);
  }

  /// The first line that is no comment: names, or already a point.
  void take_first(std::string_view line) {
    if (names_.empty() && is_name_line(line)) {
      names_ = line;
      return;
    }
    std::string problem;
    columns_ = find_columns(names_, remark_, line, problem);
    if (!columns_) fail(problem);
    last_column_ = *std::max_element(columns_->axes.begin(), columns_->axes.end());
    cloud_.points.reserve(lines_.rest().size() / (line.size() + 1) + 1);  // exact when all lines are alike
    take_point(line);
  }

  void take_point(std::string_view line) {
    std::array<float, 3> position{};
    Fields fields(line, columns_->separator);
    std::string_view field;
    for (std::size_t column = 0; column <= last_column_; ++column) {
      if (!fields.next(field)) fail_short(column);
      for (std::size_t axis = 0; axis < 3; ++axis)
        if (columns_->axes[axis] == column && !parse_field(field, columns_->has_decimal_comma, position[axis]))
          fail("\"" + std::string(field.substr(0, 40)) + "\" is not a number");
    }
    cloud_.points.push_back({position[0], position[1], position[2]});
  }

  [[noreturn]] void fail_short(std::size_t columns) const {
    fail(std::to_string(columns) + " columns where " + std::to_string(last_column_ + 1) + " are needed");
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(Status::bad_input, name_ + ", line " + std::to_string(lines_.line()) + ": " + what);
  }

  text::LineReader lines_;
  const std::string& name_;
  PointCloud cloud_;
  std::string_view names_, remark_;
  std::optional<XyzColumns> columns_;
  std::size_t last_column_ = 0;
};

}  // namespace
}  // namespace clouds

PointCloud parse_xyz(std::span<const std::byte> bytes, const std::string& name) {
  if (bytes.empty()) throw Error(Status::bad_input, name + ": the file is empty");
  std::string_view text = as_text(bytes);
  if (text.starts_with(clouds::utf8_mark)) text.remove_prefix(clouds::utf8_mark.size());
  return clouds::XyzParser(text, name).parse();
}

}  // namespace lbea::io
