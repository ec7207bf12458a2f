#include "adapters/simulation/d3plot/d3plot_numbering.hpp"

#include <limits>
#include <numeric>

namespace lbea::io::d3plot {
namespace {

constexpr std::uint64_t short_header = 10;
constexpr std::uint64_t long_header = 16;  // NSORT < 0: part ids follow those of the elements

std::vector<std::uint32_t> count_from_one(std::size_t size) {
  std::vector<std::uint32_t> ids(size);
  std::iota(ids.begin(), ids.end(), 1u);
  return ids;
}

std::vector<std::uint32_t> read_ids(const WordFile& file, std::uint64_t word, std::uint64_t count,
                                    const std::string& what) {
  const auto words = file.integers(word, count, what);
  std::vector<std::uint32_t> ids(words.size());
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (words[i] < 0 || words[i] > std::numeric_limits<std::uint32_t>::max())
      file.refuse(Status::bad_input, word + i,
                  what + " contain " + std::to_string(words[i]) +
                      ", which is no id; the file is damaged, copy or compute it again");
    ids[i] = static_cast<std::uint32_t>(words[i]);
  }
  return ids;
}

/// The five lists in the order they stand in the block.
struct Lists {
  std::uint64_t nodes, solids, beams, shells, thick_shells;

  [[nodiscard]] std::uint64_t sum() const { return plus(plus(plus(nodes, solids), plus(beams, shells)), thick_shells); }
};

Lists read_lengths(const WordFile& file, std::uint64_t word, const std::vector<std::int64_t>& header_words,
                   const Header& header) {
  const auto length = [&](std::size_t at, std::uint64_t expected, const char* what) {
    const std::int64_t value = header_words[at];
    if (value != 0 && (value < 0 || static_cast<std::uint64_t>(value) != expected))
      file.refuse(Status::bad_input, word + at,
                  "the numbering block lists " + std::to_string(value) + " " + what + ", the database has " +
                      std::to_string(expected) + "; the file is damaged, copy or compute it again");
    return static_cast<std::uint64_t>(value);
  };
  return {length(5, header.nodes, "nodes"), length(6, header.solids, "solids"), length(7, header.beams, "beams"),
          length(8, header.shells, "shells"), length(9, header.thick_shells, "thick shells")};
}

}  // namespace

void read_numbering(const WordFile& file, std::uint64_t word, const Header& header, Geometry& geometry) {
  geometry.node_ids = count_from_one(header.nodes);
  geometry.solids.ids = count_from_one(header.solids);
  geometry.shells.ids = count_from_one(header.shells);
  if (header.numbering_words == 0) return;

  file.require(word, header.numbering_words, "the numbering block");
  const auto header_words = file.integers(word, short_header, "the numbering block");
  const bool has_part_ids = header_words[0] < 0;
  const Lists lists = read_lengths(file, word, header_words, header);
  const std::uint64_t start = has_part_ids ? long_header : short_header;
  const std::uint64_t needed = plus(plus(start, lists.sum()), has_part_ids ? header.parts : 0);
  if (needed > header.numbering_words)
    file.refuse(Status::bad_input, word,
                "the numbering block has " + std::to_string(header.numbering_words) + " words, its lists need " +
                    std::to_string(needed) + "; the file is damaged, copy or compute it again");

  std::uint64_t at = word + start;
  if (lists.nodes > 0) geometry.node_ids = read_ids(file, at, lists.nodes, "node ids");
  at += lists.nodes;
  if (lists.solids > 0) geometry.solids.ids = read_ids(file, at, lists.solids, "solid ids");
  at += lists.solids + lists.beams;
  if (lists.shells > 0) geometry.shells.ids = read_ids(file, at, lists.shells, "shell ids");
  at += lists.shells + lists.thick_shells;
  if (has_part_ids) geometry.part_ids = read_ids(file, at, header.parts, "part ids");
}

}  // namespace lbea::io::d3plot
