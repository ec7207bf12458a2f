// Writes the readable part of a cut or damaged file to a new file with an index.
#pragma once

#include "adapters/mcap/salvage.hpp"
#include "adapters/mcap/writer.hpp"

namespace lbea::mcap {

struct Recovery {
  std::uint64_t chunks = 0, messages = 0, attachments = 0, metadata = 0;
  std::uint64_t undefined_messages = 0;  // omitted: their channel is not defined anywhere
  bool was_closed = false;               // the record that ends the data was found
  std::vector<Gap> gaps;                 // unreadable bytes
  [[nodiscard]] std::uint64_t lost_bytes() const noexcept;
};

/// Copies every sound chunk unchanged, compressed or not, and writes messages outside chunks to new chunks. Writes to
/// `sink` and commits it. Throws Error{bad_input} when `source` cannot be read or contains no MCAP record, and
/// Error{write_failed}.
Recovery recover(const ByteSource& source, Sink& sink);

}  // namespace lbea::mcap
