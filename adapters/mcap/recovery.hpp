// Makes a sound, indexed file of what can be read of a cut or damaged one.
#pragma once

#include "adapters/mcap/mcap_writer.hpp"
#include "adapters/mcap/salvage.hpp"

namespace lbea::mcap {

struct Recovery {
  std::uint64_t chunks = 0, messages = 0, attachments = 0, metadata = 0;
  std::uint64_t undefined_messages = 0;  // left out: their channel is defined nowhere
  bool was_closed = false;               // the data's end was there
  std::vector<Gap> gaps;                 // what could not be read
  [[nodiscard]] std::uint64_t lost_bytes() const noexcept;
};

/// Every sound chunk goes over as it is, compressed or not; messages outside chunks go into new ones. Writes to
/// `sink` and commits it. Throws Error{bad_input} when nothing in `source` is MCAP or it cannot be read, and
/// Error{write_failed}.
Recovery recover(const ByteSource& source, Sink& sink);

}  // namespace lbea::mcap
