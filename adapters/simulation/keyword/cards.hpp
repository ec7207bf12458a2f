// Lines of an LS-DYNA keyword file: keywords, cards with fixed columns or commas, comments.
#pragma once

#include "adapters/files/text_line.hpp"

namespace lbea::io::keyword {
/// Widths of integers and reals in fixed columns.
struct Widths {
  std::size_t integer = 8, real = 16;
};

/// `text` with the letters a to z as capitals.
[[nodiscard]] std::string in_capitals(std::string_view text);

class Cards {
 public:
  /// `general`: the widths until a *KEYWORD line says others.
  Cards(std::string_view text, const std::string& name, Widths general)
      : lines_(text::without_byte_order_mark(text), name, "LS-DYNA keyword file"),
        general_(general),
        widths_(general) {}

  /// Moves to the next keyword, in capitals and without marks of its widths; false at the end of the input.
  bool next_keyword(std::string& keyword);
  /// The next line before the next keyword that is no comment; false when there is none.
  bool next(std::string_view& line);

  /// The fields of a card of `integers` integers, then reals, of the widths of this keyword or of these.
  [[nodiscard]] std::vector<std::string_view> split(std::string_view line, std::size_t integers,
                                                    std::size_t reals) const {
    return split(line, integers, reals, widths_);
  }
  [[nodiscard]] static std::vector<std::string_view> split(std::string_view line, std::size_t integers,
                                                           std::size_t reals, Widths widths);
  [[nodiscard]] Widths general() const noexcept { return general_; }
  /// Of cards with eight equal columns, which are neither nodes nor elements.
  [[nodiscard]] std::size_t column_width() const noexcept { return widths_.integer == 20 ? 20 : 10; }
  [[nodiscard]] bool has_narrow_integers() const noexcept { return widths_.integer < widths_.real; }

  [[nodiscard]] std::size_t line() const noexcept { return lines_.line(); }
  [[noreturn]] void fail(const std::string& what, Status status = Status::bad_input) const {
    lines_.fail(what, status);
  }

  /// A field as an id, or as a number; an empty number is 0.
  [[nodiscard]] std::uint32_t id(std::string_view field) const;
  [[nodiscard]] float number(std::string_view field) const;

 private:
  void read_widths(std::string_view line, std::string& keyword);

  text::LineReader lines_;
  Widths general_, widths_;
};
}  // namespace lbea::io::keyword
