// What a matcher says of the frames that were sent to it, when it is asked.
#pragma once

#include "adapters/wire/access/handshake.hpp"

#include <nlohmann/json_fwd.hpp>

#include <string>

namespace lbea::tool {

struct Receipt {
  bool is_whole = true;  // it said so of each session
  std::uint64_t received = 0, missed = 0, withheld = 0;
  std::uint64_t dropped =
      0;  // received meanwhile, from whomever, and not matched for want of room in the matcher's queue
};

class Receipts {
 public:
  /// `before`: what the matcher said before the first frame.
  explicit Receipts(wire::WireState before) : before_(std::move(before)) {}
  /// Says goodbye for a session until the matcher has said what it has of it, or for 5 s.
  void ask(wire::Handshake& handshake, std::uint64_t session, std::uint64_t next_id);
  /// Whether frames of that session came to the matcher before.
  [[nodiscard]] bool knew(std::uint64_t session) const;
  [[nodiscard]] const Receipt& sum() const noexcept { return sum_; }

 private:
  [[nodiscard]] wire::WireSender before(std::uint64_t session) const;
  wire::WireState before_;
  Receipt sum_;
};

/// To be put behind a sender's own tally.
[[nodiscard]] std::string receipt_text(const Receipt& receipt);
[[nodiscard]] nlohmann::ordered_json receipt_json(const Receipt& receipt);

}  // namespace lbea::tool
