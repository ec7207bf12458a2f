#include "adapters/files/text_line.hpp"
#include "adapters/simulation/grid/grid.hpp"

#include <algorithm>
#include <unordered_map>

namespace lbea::io::grid {
namespace {
std::string in_capitals(std::string_view text) {
  std::string result(text);
  std::transform(result.begin(), result.end(), result.begin(),
                 [](char c) { return text::is_letter(c) ? static_cast<char>(c & ~0x20) : c; });
  return result;
}

/// Widths of integers and reals in fixed columns.
struct Widths {
  std::size_t integer = 8, real = 16;
};

enum class Card { none, node, shell, solid };

class KeywordParser {
 public:
  KeywordParser(std::string_view text, const std::string& name)
      : lines_(text::without_byte_order_mark(text), name, "LS-DYNA keyword file"), name_(name) {}

  Grid parse() {
    for (std::string_view line; lines_.next(line);) {
      if (line.starts_with('$') || (text::trimmed(line).empty() && card_ == Card::none)) continue;
      if (line.starts_with("*END") || line.starts_with("*end")) break;
      if (line.starts_with('*'))
        begin(in_capitals(line));
      else if (skip_ > 0)
        skip_card(line);
      else if (card_ == Card::node)
        read_node(line);
      else if (card_ == Card::shell)
        read_shell(line);
      else if (card_ == Card::solid)
        read_solid(line);
    }
    return finish();
  }

 private:
  void begin(std::string_view line) {
    std::string keyword(text::next_word(line));
    if (keyword == "*KEYWORD") {
      if (line.find("LONG=Y") != std::string_view::npos) general_ = {20, 20};
      if (line.find("I10=Y") != std::string_view::npos) general_.integer = 10;
    }
    widths_ = general_;
    for (; std::string_view("+%-").find(keyword.back()) != std::string_view::npos;
         keyword.pop_back()) {  // ends at the '*'
      if (keyword.back() == '+') widths_ = {20, 20};
      if (keyword.back() == '%') widths_.integer = 10;
      if (keyword.back() == '-') widths_ = {};
    }
    skip_ = extra_ = 0;
    card_ = keyword == "*NODE" ? Card::node : Card::none;
    if (keyword.starts_with("*ELEMENT_SHELL")) begin_shell(keyword.substr(14));
    if (keyword == "*ELEMENT_SOLID") card_ = Card::solid;
    has_thick_shells_ |= keyword.starts_with("*ELEMENT_TSHELL");
    has_includes_ |= keyword.starts_with("*INCLUDE");
    if (keyword.starts_with("*ELEMENT_SOLID_"))
      lines_.fail("the option of " + keyword + " is not read", Status::unsupported_input);
  }

  void begin_shell(const std::string& options) {
    constexpr std::array same_card{"_THICKNESS", "_BETA", "_MCID"};
    constexpr std::array own_card{"_OFFSET", "_DOF"};
    card_ = Card::shell;
    std::string rest = options;
    const auto remove = [&](const char* option) {
      const std::size_t at = rest.find(option);
      if (at == std::string::npos) return false;
      rest.erase(at, std::string_view(option).size());
      return true;
    };
    bool has_card = false;
    for (const char* option : same_card) has_card = remove(option) || has_card;
    has_thickness_card_ = has_card;
    extra_ = has_card ? 1 : 0;
    for (const char* option : own_card) extra_ += remove(option) ? 1u : 0u;
    if (!rest.empty())
      lines_.fail("the option of *ELEMENT_SHELL" + options + " is not read", Status::unsupported_input);
  }

  /// A card after a shell. Where cards of thicknesses are missing, every second shell would be skipped.
  void skip_card(std::string_view line) {
    if (skip_ == extra_ && has_thickness_card_ && is_shell_card(line))
      lines_.fail(
          "this is a shell where the card of thicknesses of the one before should be; write *ELEMENT_SHELL "
          "without options, or the cards");
    --skip_;
  }

  /// Cards of thicknesses have up to five numbers, which may be whole ones in equally wide columns.
  bool is_shell_card(std::string_view line) const {
    const auto card = fields(line, 10, 0);
    std::uint32_t value = 0;
    const auto first_other =
        std::find_if(card.begin(), card.end(), [&](auto field) { return !text::parse_integer(field, value); });
    const bool is_narrow = widths_.integer < widths_.real && line.find(',') == std::string_view::npos;
    return first_other - card.begin() >= (is_narrow ? 5 : 6);
  }

  /// Splits a card of `integers` integers, then reals.
  std::vector<std::string_view> fields(std::string_view line, std::size_t integers, std::size_t reals) const {
    if (line.find(',') != std::string_view::npos) return text::split(line, ',');
    std::vector<std::string_view> result;
    for (std::size_t i = 0, at = 0; i < integers + reals && at < line.size(); ++i) {
      const std::size_t width = i < integers ? widths_.integer : widths_.real;
      result.push_back(text::trimmed(line.substr(at, width)));
      at += width;
    }
    return result;
  }

  void read_node(std::string_view line) {
    auto card = fields(line, 1, 3);
    card.resize(std::max<std::size_t>(card.size(), 4));  // blank coordinates are 0, also at the end of a line
    if (!node_points_.emplace(id(card[0]), static_cast<std::uint32_t>(node_ids_.size())).second)
      lines_.fail("node " + std::string(card[0]) + " is defined twice");
    node_ids_.push_back(id(card[0]));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      float value = 0;
      if (!card[axis + 1].empty() && !text::parse_number(card[axis + 1], value))
        lines_.fail("\"" + std::string(card[axis + 1]) + "\" is not a number");
      grid_.positions.push_back(value);
    }
  }

  void read_shell(std::string_view line) {
    const auto card = fields(line, 10, 0);
    if (card.size() < 5) lines_.fail("a shell needs an id, a part and at least three nodes");
    skip_ = extra_;
    const bool is_triangle = card.size() < 6 || card[5].empty() || id(card[5]) == 0;
    begin_element(card, is_triangle ? CellKind::triangle : CellKind::quad);
    for (std::size_t i = 2; i < (is_triangle ? 5u : 6u); ++i) nodes_.push_back(id(card[i]));
  }

  /// One card of id, part and 8 nodes, or a card of id and part followed by one of up to 10 nodes.
  void read_solid(std::string_view line) {
    auto card = fields(line, 10, 0);
    if (card.size() < 2) lines_.fail("a solid needs an id and a part");
    begin_element(card, CellKind::hexahedron);
    std::size_t first = 2;
    if (std::all_of(card.begin() + 2, card.end(), [](auto field) { return field.empty(); })) {
      do {
        if (!lines_.next(line)) lines_.fail("the file ends within a solid; it is cut short");
      } while (line.starts_with('$'));
      card = fields(line, 10, 0);
      first = 0;
    }
    while (!card.empty() && card.back().empty()) card.pop_back();  // after a comma at the end of the line
    std::array<std::uint32_t, 10> nodes{};
    if (card.size() > first + (first == 0 ? nodes.size() : 8)) lines_.fail("a solid has at most 10 nodes");
    for (std::size_t i = first; i < card.size(); ++i)
      if (!card[i].empty()) nodes[i - first] = id(card[i]);
    add_solid(nodes);
  }

  /// Ten nodes are those of a tetrahedron: its corners, then the middles of its edges.
  void add_solid(const std::array<std::uint32_t, 10>& nodes) {
    if (nodes[8] != 0 || nodes[9] != 0) {
      auto sorted = nodes;
      std::sort(sorted.begin(), sorted.end());
      if (sorted[0] == 0 || std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end())
        lines_.fail("nodes 9 and 10 belong to a tetrahedron of ten different nodes; write other solids with 8 nodes");
      kinds_.back() = CellKind::tetrahedron;
      nodes_.insert(nodes_.end(), nodes.begin(), nodes.begin() + 4);
      return;
    }
    std::uint32_t last = 0;
    for (std::size_t i = 0; i < 8; ++i)
      nodes_.push_back(last = nodes[i] != 0 ? nodes[i] : last);  // tetrahedra may omit the last four
  }

  void begin_element(const std::vector<std::string_view>& card, CellKind kind) {
    kinds_.push_back(kind);
    element_ids_.push_back(id(card[0]));
    parts_.push_back(id(card[1]));
    lines_of_.push_back(lines_.line());
  }

  std::uint32_t id(std::string_view field) const {
    std::uint32_t value = 0;
    if (!text::parse_integer(field, value)) lines_.fail(text::quoted(field) + " is not an id");
    return value;
  }

  /// A file without any element that is read.
  [[noreturn]] void refuse_without_elements() const {
    const char* reason = has_thick_shells_ ? "its elements are thick shells (*ELEMENT_TSHELL), which are not read"
                         : has_includes_   ? "its mesh is in other files (*INCLUDE), which are not read; give the file "
                                             "that has nodes and elements, or join them into one"
                                         : "it has no *ELEMENT_SHELL and no *ELEMENT_SOLID; give a file with the mesh";
    throw Error{Status::unsupported_input, name_ + ": " + reason + " (LS-DYNA keyword file)"};
  }

  Grid finish() {
    if (kinds_.empty()) refuse_without_elements();
    std::size_t at = 0;
    std::vector<std::uint32_t> corners;
    for (std::size_t e = 0; e < kinds_.size(); ++e) {
      corners.clear();
      const CellKind kind = kinds_[e];
      const std::size_t count = kind == CellKind::triangle ? 3 : kind == CellKind::hexahedron ? 8 : 4;
      for (std::size_t i = 0; i < count; ++i, ++at) {
        const auto point = node_points_.find(nodes_[at]);
        if (point == node_points_.end())
          throw Error{Status::bad_input, name_ + ", line " + std::to_string(lines_of_[e]) + ": node " +
                                             std::to_string(nodes_[at]) +
                                             " is not in this file; give a file that also has the nodes"};
        corners.push_back(point->second);
      }
      grid_.cells.add(kinds_[e], corners);
    }
    grid_.point_arrays.push_back({"NODE_ID", 1, {node_ids_.begin(), node_ids_.end()}});
    grid_.cell_arrays.push_back({"ELEMENT_ID", 1, {element_ids_.begin(), element_ids_.end()}});
    grid_.cell_arrays.push_back({"PART_ID", 1, {parts_.begin(), parts_.end()}});
    return std::move(grid_);
  }

  text::LineReader lines_;
  const std::string& name_;
  Grid grid_;
  Widths general_, widths_;
  Card card_ = Card::none;
  std::size_t extra_ = 0, skip_ = 0;  // cards after each element
  bool has_thickness_card_ = false;   // the first of them
  bool has_thick_shells_ = false, has_includes_ = false;
  std::unordered_map<std::uint32_t, std::uint32_t> node_points_;
  std::vector<std::uint32_t> node_ids_, element_ids_, parts_, nodes_;
  std::vector<CellKind> kinds_;
  std::vector<std::size_t> lines_of_;
};
}  // namespace

bool is_keyword(std::string_view start) noexcept {
  text::LineReader lines(text::without_byte_order_mark(start));
  for (std::string_view line; lines.next(line);) {
    if (line.starts_with('$') || text::trimmed(line).empty()) continue;
    return line.size() > 3 && line[0] == '*' && text::is_letter(line[1]) && text::is_letter(line[2]);
  }
  return false;
}

/// *NODE, *ELEMENT_SHELL and *ELEMENT_SOLID in fixed columns (8 and 16 wide, I10, LONG=Y) or with commas. Other
/// keywords are skipped, also *INCLUDE. Shells may have the options THICKNESS, BETA, MCID, OFFSET and DOF; solids take
/// one card or two, and tetrahedra may have ten nodes.
Grid parse_keyword(std::string_view text, const std::string& name) { return KeywordParser(text, name).parse(); }
}  // namespace lbea::io::grid
