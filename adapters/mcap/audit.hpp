// Reads a whole MCAP file and holds everything in it against everything else.
#pragma once

#include "adapters/mcap/salvage.hpp"

#include <functional>

namespace lbea::mcap {

struct Audit {
  std::uint64_t bytes = 0;
  Header header;
  bool is_mcap = false;      // begins like one
  bool is_closed = false;    // ends as the writer ends a file
  bool has_summary = false;  // with indexes that find everything in it
  std::vector<Gap> gaps;
  std::vector<std::string> complaints;  // each with its byte; at most max_complaints
  Definitions definitions;
  Statistics counted;  // what is there, whatever the file's own statistics say
  std::vector<Metadata> metadata;

  static constexpr std::size_t max_complaints = 20;
  /// Closed in good order, no byte damaged, nothing that contradicts anything.
  [[nodiscard]] bool is_intact() const noexcept { return is_mcap && is_closed && gaps.empty() && complaints.empty(); }
};

/// `channel` is null for a message whose channel is not defined before it.
using MessageVisitor = std::function<void(const Message& message, const Channel* channel)>;

/// Throws Error{bad_input} only when the system cannot read the file.
[[nodiscard]] Audit audit(const ByteSource& source, const MessageVisitor& visit = {});

}  // namespace lbea::mcap
