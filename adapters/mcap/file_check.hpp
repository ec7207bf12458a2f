// Checks a whole MCAP file: every byte is read, and every record is compared with the others that describe it.
#pragma once

#include "adapters/mcap/salvage.hpp"

#include <functional>

namespace lbea::mcap {

struct FileCheck {
  std::uint64_t bytes = 0;
  Header header;
  bool is_mcap = false;      // starts with the magic bytes
  bool is_closed = false;    // ends with a footer and the magic bytes
  bool has_summary = false;  // with indexes
  std::vector<Gap> gaps;
  std::vector<std::string> errors;  // each with its byte offset; at most max_errors
  Definitions definitions;
  Statistics counted;  // from the data, independent of the file's own statistics
  std::vector<Metadata> metadata;

  static constexpr std::size_t max_errors = 20;
  /// Closed, no damaged byte, and no contradiction between records.
  [[nodiscard]] bool is_intact() const noexcept { return is_mcap && is_closed && gaps.empty() && errors.empty(); }
};

/// `channel` is null for a message whose channel is not defined before it.
using MessageVisitor = std::function<void(const Message& message, const Channel* channel)>;

/// Throws Error{bad_input} only when the system cannot read the file.
[[nodiscard]] FileCheck check_file(const ByteSource& source, const MessageVisitor& visit = {});

}  // namespace lbea::mcap
