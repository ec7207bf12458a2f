// Reads the mesh of an LS-DYNA keyword input: nodes, shells, solids and thick shells, with included files.
#include "adapters/files/atomic_file.hpp"
#include "adapters/simulation/keyword/include.hpp"
#include "adapters/simulation/keyword/keyword.hpp"
#include "adapters/simulation/keyword/model.hpp"

#include <algorithm>

namespace lbea::io::keyword {
namespace {
using grid::CellKind;

/// What all files of an input share.
struct Input {
  Includes includes;
  Model model;
  Motions motions;
  bool only_lists_files = false;
};

class FileParser {
 public:
  FileParser(Input& input, std::string_view text, std::size_t file, Widths general, const Transform& transform)
      : input_(input), cards_(text, input.includes.files()[file], general), file_(file), transform_(transform) {}

  void parse() {
    for (std::string keyword; cards_.next_keyword(keyword);) {
      if (keyword.starts_with("*INCLUDE"))
        include(keyword);
      else if (keyword == "*DEFINE_TRANSFORMATION" || keyword == "*DEFINE_TRANSFORMATION_TITLE")
        read_motion(cards_, keyword.ends_with("_TITLE"), transform_.definition_offset, input_.motions);
      else if (!input_.only_lists_files)
        read_mesh(keyword);
    }
  }

 private:
  void include(const std::string& keyword) {
    if (keyword == "*INCLUDE_PATH" || keyword == "*INCLUDE_PATH_RELATIVE") return input_.includes.add_folders(cards_);
    if (keyword.starts_with("*INCLUDE_STAMPED")) return;  // of results, whose nodes are not part of the mesh
    const bool has_transform = keyword == "*INCLUDE_TRANSFORM";
    if (keyword != "*INCLUDE" && !has_transform)
      cards_.fail(keyword + " is not read; use *INCLUDE or *INCLUDE_TRANSFORM", Status::unsupported_input);
    for (std::string name; Includes::next_name(cards_, name);) {
      const Cards at_name = cards_;
      const Transform transform =
          has_transform ? read_transform(cards_, transform_.definition_offset, input_.motions) : Transform();
      input_.includes.read(at_name, name, [&](std::size_t file) {
        const auto content = read_file(input_.includes.files()[file]);
        require_text(at_name, as_text(content), input_.includes.files()[file]);
        FileParser(input_, as_text(content), file, cards_.general(), transform_.of_included(transform)).parse();
      });
    }
  }

  /// Otherwise no line would be a keyword, and the file would add nothing.
  static void require_text(const Cards& at_name, std::string_view content, const std::string& name) {
    const std::string_view start = content.substr(0, 4096);
    static_cast<void>(text::checked_encoding(start, name));
    if (start.find('\0') != std::string_view::npos)
      at_name.fail("the included file " + name + " is not text; unpack it if it is compressed",
                   Status::unsupported_input);
  }

  void read_mesh(const std::string& keyword) {
    if (keyword == "*NODE") return read_nodes();
    if (keyword.starts_with("*ELEMENT_SHELL")) return read_shells(keyword.substr(14));
    if (keyword == "*ELEMENT_SOLID") return read_solids();
    if (keyword == "*ELEMENT_TSHELL" || keyword == "*ELEMENT_TSHELL_BETA")
      return read_thick_shells(keyword.ends_with("_BETA"));
    if (keyword.starts_with("*ELEMENT_SOLID_") || keyword.starts_with("*ELEMENT_TSHELL"))
      cards_.fail("the option of " + keyword + " is not read", Status::unsupported_input);
  }

  void read_nodes() {
    for (std::string_view line; cards_.next(line);) {
      auto card = cards_.split(line, 1, 3);
      card.resize(std::max<std::size_t>(card.size(), 4));  // blank coordinates are 0, also at the end of a line
      input_.model.add_node(cards_, transform_, card[0],
                            {cards_.number(card[1]), cards_.number(card[2]), cards_.number(card[3])});
    }
  }

  void read_shells(const std::string& options) {
    constexpr std::array same_card{"_THICKNESS", "_BETA", "_MCID"};
    constexpr std::array own_card{"_OFFSET", "_DOF"};
    std::string rest = options;
    const auto remove = [&](const char* option) {
      const std::size_t at = rest.find(option);
      if (at == std::string::npos) return false;
      rest.erase(at, std::string_view(option).size());
      return true;
    };
    bool has_thickness_card = false;
    for (const char* option : same_card) has_thickness_card = remove(option) || has_thickness_card;
    std::size_t extra = has_thickness_card ? 1 : 0;
    for (const char* option : own_card) extra += remove(option) ? 1u : 0u;
    if (!rest.empty())
      cards_.fail("the option of *ELEMENT_SHELL" + options + " is not read", Status::unsupported_input);
    for (std::string_view line; cards_.next(line);) {
      read_shell(line);
      skip_cards(extra, has_thickness_card);
    }
  }

  void read_shell(std::string_view line) {
    const auto card = cards_.split(line, 10, 0);
    if (card.size() < 5) cards_.fail("a shell needs an id, a part and at least three nodes");
    const bool is_triangle = card.size() < 6 || card[5].empty() || cards_.id(card[5]) == 0;
    begin_element(card, is_triangle ? CellKind::triangle : CellKind::quad);
    for (std::size_t i = 2; i < (is_triangle ? 5u : 6u); ++i) add_corner(cards_.id(card[i]));
  }

  /// The cards after a shell. Where cards of thicknesses are missing, every second shell would be skipped.
  void skip_cards(std::size_t cards, bool has_thickness_card) {
    std::string_view line;
    for (std::size_t i = 0; i < cards && cards_.next(line); ++i)
      if (i == 0 && has_thickness_card && is_shell_card(line))
        cards_.fail(
            "this is a shell where the card of thicknesses of the one before should be; write *ELEMENT_SHELL "
            "without options, or the cards");
  }

  /// Cards of thicknesses have up to five numbers, which may be whole ones in equally wide columns.
  bool is_shell_card(std::string_view line) const {
    const auto card = cards_.split(line, 10, 0);
    std::uint32_t value = 0;
    const auto first_other =
        std::find_if(card.begin(), card.end(), [&](auto field) { return !text::parse_integer(field, value); });
    const bool is_narrow = cards_.has_narrow_integers() && line.find(',') == std::string_view::npos;
    return first_other - card.begin() >= (is_narrow ? 5 : 6);
  }

  /// One card of id, part and 8 nodes, or a card of id and part followed by one of up to 10 nodes.
  void read_solids() {
    for (std::string_view line; cards_.next(line);) {
      auto card = cards_.split(line, 10, 0);
      if (card.size() < 2) cards_.fail("a solid needs an id and a part");
      begin_element(card, CellKind::hexahedron);
      std::size_t first = 2;
      if (std::all_of(card.begin() + 2, card.end(), [](auto field) { return field.empty(); })) {
        if (!cards_.next(line)) cards_.fail("the file ends within a solid; it is cut short");
        card = cards_.split(line, 10, 0);
        first = 0;
      }
      add_solid(card, first, first == 0 ? 10 : 8);
    }
  }

  /// Nodes 1 to 4 are the lower side, 5 to 8 the upper one: those of a hexahedron.
  void read_thick_shells(bool has_beta_card) {
    for (std::string_view line; cards_.next(line);) {
      const auto card = cards_.split(line, 10, 0);
      if (card.size() < 10) cards_.fail("a thick shell needs an id, a part and eight nodes");
      begin_element(card, CellKind::hexahedron);
      add_solid(card, 2, 8);
      if (has_beta_card) cards_.next(line);
    }
  }

  void add_solid(std::vector<std::string_view> card, std::size_t first, std::size_t most) {
    while (!card.empty() && card.back().empty()) card.pop_back();  // after a comma at the end of the line
    std::array<std::uint32_t, 10> nodes{};
    if (card.size() > first + most) cards_.fail("a solid has at most 10 nodes");
    for (std::size_t i = first; i < card.size(); ++i)
      if (!card[i].empty()) nodes[i - first] = cards_.id(card[i]);
    if (nodes[8] != 0 || nodes[9] != 0) return add_tetrahedron(nodes);
    std::uint32_t last = 0;
    for (std::size_t i = 0; i < 8; ++i) add_corner(last = nodes[i] != 0 ? nodes[i] : last);  // the last may be omitted
  }

  /// Ten nodes are those of a tetrahedron: its corners, then the middles of its edges.
  void add_tetrahedron(const std::array<std::uint32_t, 10>& nodes) {
    auto sorted = nodes;
    std::sort(sorted.begin(), sorted.end());
    if (sorted[0] == 0 || std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end())
      cards_.fail("nodes 9 and 10 belong to a tetrahedron of ten different nodes; write other solids with 8 nodes");
    input_.model.set_kind(CellKind::tetrahedron);
    for (std::size_t i = 0; i < 4; ++i) add_corner(nodes[i]);
  }

  void begin_element(const std::vector<std::string_view>& card, CellKind kind) {
    input_.model.begin_element(cards_, transform_, card, kind, file_);
  }
  void add_corner(std::uint32_t node) { input_.model.add_corner(cards_, transform_, node); }

  Input& input_;
  Cards cards_;
  std::size_t file_;
  Transform transform_;
};

Input parsed(std::string_view text, const std::string& name, bool only_lists_files) {
  Input input{Includes(name), {}, {}, only_lists_files};
  FileParser(input, text, 0, {}, {}).parse();
  return input;
}
}  // namespace

bool is_keyword(std::string_view start) noexcept {
  text::LineReader lines(text::without_byte_order_mark(start));
  for (std::string_view line; lines.next(line);) {
    if (line.starts_with('$') || text::trimmed(line).empty()) continue;
    return line.size() > 3 && line[0] == '*' && text::is_letter(line[1]) && text::is_letter(line[2]);
  }
  return false;
}

grid::Grid parse_keyword(std::string_view text, const std::string& name) {
  Input input = parsed(text, name, false);
  if (input.model.elements() == 0)
    throw Error{Status::unsupported_input,
                name +
                    ": it has no *ELEMENT_SHELL, *ELEMENT_SOLID or *ELEMENT_TSHELL; give a file with the mesh "
                    "(LS-DYNA keyword file)"};
  return input.model.finish(input.includes.files());
}

std::vector<std::filesystem::path> list_keyword_includes(const std::filesystem::path& file) {
  const auto content = read_file(file);
  const Input input = parsed(as_text(content), file.string(), true);
  return {input.includes.files().begin() + 1, input.includes.files().end()};
}
}  // namespace lbea::io::keyword
